// SPDX-License-Identifier: Apache-2.0
// Sizes in bytes, as people read and write them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"

namespace farfield {

/// "512 B", "1.50 KiB", "3.20 MiB", "7.00 GiB": binary units, two decimals.
std::string format_bytes(uint64_t bytes);

/// Reads "1536", "300K", "1.5M", "4GiB", and what format_bytes() writes, "4.00 GiB" (powers of 1024; case, and
/// "B"/"iB", do not matter). Errors: InvalidArgument for anything else, for negative values, and for more than 2^62.
Result<uint64_t> parse_bytes(std::string_view text);

}  // namespace farfield
