// SPDX-License-Identifier: Apache-2.0
// The planner: greedy coarsening along an order that does not depend on the budget.
//
// Every asset starts at the level its cameras ask for. A *step* makes one asset one stored level coarser. Its price is
//
//   growth of the projected error / bytes freed,
//   projected error of level i = pixels * 2^(levels that it is coarser than asked),   [a voxel's width in pixels]
//   bytes freed by leaving level i = resident_bytes[i] + what the asset's own largest build shrinks by.
//
// Steps are taken cheapest first until the plan fits. Since prices do not look at the budget, all budgets walk the same
// sequence of plans and stop at different places. So a larger budget never gives any asset a coarser level.
#include "lodselect/planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <set>

#include "base/bytes.h"

namespace farfield {

namespace {

uint64_t saturating_add(uint64_t a, uint64_t b) {
  uint64_t sum;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<uint64_t>::max() : sum;
}

std::optional<std::string> find_problem(const PlanAsset& asset) {
  const size_t levels = asset.resident_bytes.size();
  if (levels == 0) return "it has no levels";
  if (asset.build_peak_bytes.size() != levels || asset.lambda.size() != levels) return "its lists differ in length";
  for (size_t i = 0; i < levels; ++i) {
    if (!std::isfinite(asset.lambda[i])) return "a level's lambda is not finite";
    if (i > 0 && !(asset.lambda[i] > asset.lambda[i - 1])) return "its levels are not sorted by lambda";
  }
  if (!std::isfinite(asset.pixels) || asset.pixels < 0) return "its pixels are negative or not finite";
  return {};
}

/// Index of the coarsest stored level that is at least as fine as the cameras ask; the finest one if none is (and for
/// NaN).
uint32_t wanted_level(const PlanAsset& asset) {
  uint32_t wanted = 0;
  while (wanted + 1 < asset.lambda.size() && asset.lambda[wanted + 1] <= asset.wanted_lambda) ++wanted;
  return wanted;
}

/// How many levels coarser than asked a stored level is; 0 if it is fine enough. NaN asks for the finest.
double levels_too_coarse(const PlanAsset& asset, uint32_t level) {
  const double asked = asset.wanted_lambda > asset.lambda[0] ? asset.wanted_lambda : asset.lambda[0];
  return std::max(0.0, asset.lambda[level] - asked);
}

double projected_error(const PlanAsset& asset, uint32_t level) {
  return asset.pixels * std::exp2(levels_too_coarse(asset, level));
}

/// Largest build among the levels from `level` to the root.
uint64_t build_peak_from(const PlanAsset& asset, uint32_t level) {
  return *std::max_element(asset.build_peak_bytes.begin() + level, asset.build_peak_bytes.end());
}

/// Making one asset leave its level `from` for the next coarser one.
struct Step {
  double price;
  uint32_t asset;
  uint32_t from;
  /// Cheapest first, then the lowest asset index. An asset has one step in the queue at a time.
  bool operator>(const Step& other) const { return price != other.price ? price > other.price : asset > other.asset; }
};

Step step_of(std::span<const PlanAsset> assets, uint32_t index, uint32_t from) {
  const PlanAsset& asset = assets[index];
  const double growth = projected_error(asset, from + 1) - projected_error(asset, from);
  const double freed = static_cast<double>(asset.resident_bytes[from]) +
                       static_cast<double>(build_peak_from(asset, from) - build_peak_from(asset, from + 1));
  const double price = growth / freed;
  // The last resort: a step that frees nothing, even if it costs nothing, and errors too large for a double.
  return {std::isfinite(price) ? price : std::numeric_limits<double>::infinity(), index, from};
}

/// The plan while it is being made, with the sums that a step changes.
class Draft {
 public:
  explicit Draft(std::span<const PlanAsset> assets) : assets_(assets) {
    for (uint32_t i = 0; i < assets.size(); ++i) {
      finest.push_back(wanted_level(assets[i]));
      for (size_t k = finest[i]; k < assets[i].resident_bytes.size(); ++k) {
        resident_bytes_ += assets[i].resident_bytes[k];
      }
      peaks_.insert(build_peak_from(assets[i], finest[i]));
    }
  }

  void coarsen(uint32_t asset) {
    resident_bytes_ -= assets_[asset].resident_bytes[finest[asset]];
    peaks_.erase(peaks_.find(build_peak_from(assets_[asset], finest[asset])));
    peaks_.insert(build_peak_from(assets_[asset], ++finest[asset]));
  }
  bool can_coarsen(uint32_t asset) const { return finest[asset] + 1 < assets_[asset].resident_bytes.size(); }

  uint64_t resident_bytes() const { return resident_bytes_ > kMax ? kMax : static_cast<uint64_t>(resident_bytes_); }
  uint64_t build_peak_bytes() const { return peaks_.empty() ? 0 : *peaks_.rbegin(); }
  uint64_t needed_bytes(uint64_t fixed_bytes) const {
    return saturating_add(saturating_add(resident_bytes(), build_peak_bytes()), fixed_bytes);
  }

  std::vector<uint32_t> finest;

 private:
  static constexpr uint64_t kMax = std::numeric_limits<uint64_t>::max();
  std::span<const PlanAsset> assets_;
  unsigned __int128 resident_bytes_ = 0;  // sums of any 64-bit sizes, subtracted again: must not wrap or saturate
  std::multiset<uint64_t> peaks_;         // one per asset
};

double bias_of(std::span<const PlanAsset> assets, const std::vector<uint32_t>& finest) {
  double sum = 0, weight = 0;
  for (size_t i = 0; i < assets.size(); ++i) {
    sum += assets[i].pixels * levels_too_coarse(assets[i], finest[i]);
    weight += assets[i].pixels;
  }
  return weight > 0 ? sum / weight : 0.0;
}

}  // namespace

Result<Plan> plan_levels(std::span<const PlanAsset> assets, uint64_t budget_bytes, uint64_t fixed_bytes) {
  for (size_t i = 0; i < assets.size(); ++i) {
    if (const auto problem = find_problem(assets[i])) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("cannot plan asset {}: {}", i, *problem));
    }
  }

  Draft draft(assets);
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  for (uint32_t i = 0; i < assets.size(); ++i) {
    if (draft.can_coarsen(i)) steps.push(step_of(assets, i, draft.finest[i]));
  }
  while (draft.needed_bytes(fixed_bytes) > budget_bytes && !steps.empty()) {
    const uint32_t asset = steps.top().asset;
    steps.pop();
    draft.coarsen(asset);
    if (draft.can_coarsen(asset)) steps.push(step_of(assets, asset, draft.finest[asset]));
  }

  const uint64_t needed = draft.needed_bytes(fixed_bytes);
  if (needed > budget_bytes) {
    return make_error(
        ErrorCode::OutOfBudget,
        fmt::format("the budget of {} ({} bytes) is too small: the coarsest levels of {} assets alone "
                    "need {} ({} bytes); raise the budget to at least that",
                    format_bytes(budget_bytes), budget_bytes, assets.size(), format_bytes(needed), needed));
  }
  return Plan{draft.finest, draft.resident_bytes(), draft.build_peak_bytes(), bias_of(assets, draft.finest)};
}

}  // namespace farfield
