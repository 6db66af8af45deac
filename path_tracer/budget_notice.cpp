// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/budget_notice.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "base/bytes.h"

namespace farfield {

namespace {

constexpr size_t kMostNamed = 3;

bool gave_up(const FrameReport& frame) {
  return std::ranges::any_of(frame.levels_given_up, [](float levels) { return levels > 0; });
}

/// "oak by 3.2 levels, ground by 1.0", the worst first.
std::string name_worst(const FrameReport& frame, const std::vector<std::string>& assets) {
  std::vector<size_t> order(std::min(assets.size(), frame.levels_given_up.size()));
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::greater<>(), [&](size_t i) { return frame.levels_given_up[i]; });
  std::string text;
  size_t named = 0;
  for (const size_t i : order) {
    if (!(frame.levels_given_up[i] > 0)) break;
    if (named == kMostNamed) return text + " and others";
    text += fmt::format("{}{} by {:.1f}{}", named > 0 ? ", " : "", assets[i], frame.levels_given_up[i],
                        named > 0 ? "" : " levels");
    ++named;
  }
  return text;
}

}  // namespace

std::optional<std::string> budget_notice(const RenderReport& report) {
  const auto frames = std::ranges::count_if(report.frames, gave_up);
  if (frames == 0) return std::nullopt;
  const FrameReport& worst = *std::ranges::max_element(report.frames, {}, &FrameReport::bias);
  const uint64_t asked = std::ranges::max(report.frames, {}, &FrameReport::asked_bytes).asked_bytes;
  return fmt::format(
      "the budget of {} makes levels coarser than asked in {} of {} frames; at most, in frame {}: {}; {} would do",
      format_bytes(report.budget_bytes), frames, report.frames.size(), worst.frame, name_worst(worst, report.assets),
      format_bytes(asked));
}

std::optional<std::string> morph_notice(const RenderReport& report) {
  const auto frames =
      std::ranges::count_if(report.frames, [](const FrameReport& frame) { return frame.morphs_given_up > 0; });
  if (frames == 0) return std::nullopt;
  const FrameReport& worst = *std::ranges::max_element(report.frames, {}, &FrameReport::morphs_given_up);
  return fmt::format(
      "the budget of {} has no room for {} morphs in frame {}: those levels dissolve; in {} of {} frames",
      format_bytes(report.budget_bytes), worst.morphs_given_up, worst.frame, frames, report.frames.size());
}

}  // namespace farfield
