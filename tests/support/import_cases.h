// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace farfield::test {

/// Small files with traits of real exports; see its README.
inline const std::filesystem::path kCases = std::filesystem::path(FARFIELD_TEST_DATA) / "import_cases";

}  // namespace farfield::test
