// SPDX-License-Identifier: Apache-2.0
#include "tools/use_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/bytes.h"
#include "tools/console.h"

namespace farfield::tool {

namespace {

/// The uses of one asset's levels over all frames, by level; bytes are the most of any frame.
std::map<uint32_t, LevelUse> sum_uses(const RenderReport& report, size_t asset) {
  std::map<uint32_t, LevelUse> sums;
  for (const FrameReport& frame : report.frames) {
    if (asset >= frame.levels.size()) continue;  // a frame of before they were recorded
    for (const LevelUse& use : frame.levels[asset]) {
      LevelUse& sum = sums[use.level];
      sum.hits += use.hits;
      sum.loads += use.loads;
      sum.load_seconds += use.load_seconds;
      sum.resident_bytes = std::max(sum.resident_bytes, use.resident_bytes);
      sum.served_coarser += use.served_coarser;
    }
  }
  return sums;
}

float most_given_up(const RenderReport& report, size_t asset) {
  float most = 0;
  for (const FrameReport& frame : report.frames)
    if (asset < frame.levels_given_up.size()) most = std::max(most, frame.levels_given_up[asset]);
  return most;
}

}  // namespace

std::string use_table(const RenderReport& report) {
  uint64_t hits = 0;
  for (const FrameReport& frame : report.frames)
    for (const auto& asset : frame.levels)
      for (const LevelUse& use : asset) hits += use.hits;

  std::vector<std::vector<std::string>> rows = {
      {"asset", "level", "loads", "load s", "bytes", "hits", "share", "served coarser", "given up"}};
  for (size_t asset = 0; asset < report.assets.size(); ++asset) {
    bool is_first = true;
    for (const auto& [level, use] : sum_uses(report, asset)) {
      rows.push_back(
          {is_first ? one_line(report.assets[asset]) : "", fmt::format("{}", level), fmt::format("{}", use.loads),
           fmt::format("{:.3f}", use.load_seconds), format_bytes(use.resident_bytes), fmt::format("{}", use.hits),
           hits > 0 ? fmt::format("{:.1f} %", 100.0 * static_cast<double>(use.hits) / static_cast<double>(hits)) : "",
           fmt::format("{}", use.served_coarser), is_first ? fmt::format("{:.1f}", most_given_up(report, asset)) : ""});
      is_first = false;
    }
  }
  return format_table(rows);
}

}  // namespace farfield::tool
