// SPDX-License-Identifier: Apache-2.0
// What somebody meant who mistyped a name.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace farfield::tool {

/// The known name nearest to `word`; of equally near ones the first. At most 2 letters are added, left out or replaced,
/// and no more than half of the name: of shorter ones anything would be near. Dashes in front do not count.
std::optional<std::string> nearest_name(std::string_view word, std::span<const std::string> known);

}  // namespace farfield::tool
