// SPDX-License-Identifier: Apache-2.0
#include "tools/suggest.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace farfield::tool {
namespace {

constexpr size_t kMostEdits = 2;

std::string_view without_dashes(std::string_view name) {
  return name.substr(std::min(name.find_first_not_of('-'), name.size()));
}

/// Letters to add, to leave out or to replace [Levenshtein distance], one row of the table at a time.
size_t edit_distance(std::string_view from, std::string_view to) {
  std::vector<size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < from.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i + 1);
    for (size_t k = 0; k < to.size(); ++k) {
      const size_t replaced = diagonal + (from[i] == to[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// Also bounds the work: a word may be as long as a command line.
bool can_be_near(std::string_view word, std::string_view name) { return word.size() <= name.size() + kMostEdits; }

}  // namespace

std::optional<std::string> nearest_name(std::string_view word, std::span<const std::string> known) {
  std::optional<std::string> nearest;
  size_t fewest = kMostEdits + 1;
  for (const std::string& candidate : known) {
    const std::string_view name = without_dashes(candidate);
    if (!can_be_near(without_dashes(word), name)) continue;
    const size_t edits = edit_distance(without_dashes(word), name);
    if (edits >= fewest || 2 * edits > name.size()) continue;
    nearest = candidate;
    fewest = edits;
  }
  return nearest;
}

}  // namespace farfield::tool
