// SPDX-License-Identifier: Apache-2.0
// The planner: greedy refinement of a multiple-choice knapsack.
//
// An instance that asks for level i is served by the coarsest usable level that is not coarser, or else by the finest
// usable one. So what is resident is the asset's finest level and its root, and what matters is
//
//   error of finest level i = sum over instances of pixels * 2^(levels that i is coarser than asked)  [voxels in
//   pixels] bytes of finest level i = resident_bytes[i] + resident_bytes[root].
//
// Of each asset only the levels on the lower convex hull of (bytes, error) are tried: there each further byte buys less
// than the one before. From the roots on, the step that buys most per byte is taken; an asset whose step does not fit
// stays where it is, and the others go on.
//
// So more budget never gives a larger error. Two budgets take the same steps until one step fits only the larger. What
// is left of the smaller budget is then less than that step takes, and no later step buys more per byte: whatever it
// goes on to buy is less than that step.
//
// That needs bytes that add up, and the peak of the largest build does not. So all of it is done for a few caps on the
// peak, each with a budget less by that cap, and the best is taken. Which caps does not depend on the budget.
#include "lodselect/planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "base/bytes.h"

namespace farfield {

namespace {

using Bytes = unsigned __int128;  // sums of any 64-bit sizes, which must not wrap

constexpr size_t kMostLevels = 256;
constexpr size_t kMostCaps = 32;

uint64_t saturated(Bytes bytes) {
  constexpr uint64_t kMax = std::numeric_limits<uint64_t>::max();
  return bytes > kMax ? kMax : static_cast<uint64_t>(bytes);
}

bool is_weight(double x) { return std::isfinite(x) && x >= 0; }

std::optional<std::string> find_problem(const PlanAsset& asset) {
  const size_t levels = asset.resident_bytes.size();
  const auto has_length = [&](const auto& list) { return list.empty() || list.size() == levels; };
  if (levels == 0) return "it has no levels";
  if (levels > kMostLevels) return "it has more than 256 levels";
  if (asset.build_peak_bytes.size() != levels || asset.lambda.size() != levels) return "its lists differ in length";
  if (!has_length(asset.ray_cost) || !has_length(asset.demand) || !has_length(asset.morphs))
    return "its lists differ in length";
  for (size_t i = 0; i < levels; ++i) {
    if (!std::isfinite(asset.lambda[i])) return "a level's lambda is not finite";
    if (i > 0 && !(asset.lambda[i] > asset.lambda[i - 1])) return "its levels are not sorted by lambda";
  }
  for (const LevelDemand& demand : asset.demand) {
    if (!is_weight(demand.pixels)) return "its pixels are negative or not finite";
  }
  return {};
}

/// Index of the coarsest level that is at least as fine as asked; the finest one if none is (and for NaN).
size_t level_for(const std::vector<float>& lambda, float wanted) {
  size_t level = 0;
  while (level + 1 < lambda.size() && lambda[level + 1] <= wanted) ++level;
  return level;
}

/// An asset as the steps see it.
class Choice {
 public:
  explicit Choice(const PlanAsset& asset) : asset_(asset), root_(static_cast<uint8_t>(asset.lambda.size() - 1)) {
    LevelDemand finer;  // of all levels that are finer
    double not_finer = 0;
    for (const LevelDemand& demand : asset.demand) not_finer += demand.pixels;
    for (size_t i = 0; i <= root_; ++i) {
      const double wider = finer.pixels > 0 ? finer.pixels_detail * std::exp2(asset.lambda[i]) : 0.0;
      error_.push_back(std::max(wider, finer.pixels) + not_finer);
      coarser_.push_back(finer.pixels > 0 ? finer.pixels * asset.lambda[i] - finer.pixels_lambda : 0.0);
      if (i >= asset.demand.size()) continue;
      finer.pixels += asset.demand[i].pixels;
      finer.pixels_lambda += asset.demand[i].pixels_lambda;
      finer.pixels_detail += asset.demand[i].pixels_detail;
      not_finer -= asset.demand[i].pixels;
    }
    while (asked_ < root_ && !is_asked(asked_)) ++asked_;
  }

  uint8_t root() const { return root_; }
  /// The finest level that an instance asks for.
  uint8_t asked() const { return asked_; }
  double pixels() const { return error_.front(); }
  double error(uint8_t finest) const { return error_[finest]; }
  /// Sum over instances of pixels * levels that this one is coarser than asked.
  double levels_coarser(uint8_t finest) const { return coarser_[finest]; }
  /// How many levels this one is coarser than the finest instance asks.
  float levels_given_up(uint8_t finest) const {
    if (finest <= asked_) return 0.0f;
    const LevelDemand& demand = asset_.demand[asked_];
    const double lambda = demand.pixels > 0 ? demand.pixels_lambda / demand.pixels : asset_.lambda[asked_];
    return asset_.lambda[finest] - static_cast<float>(lambda);
  }
  Bytes bytes(uint8_t finest) const {
    const Bytes root = asset_.resident_bytes[root_];
    return finest == root_ ? root : root + asset_.resident_bytes[finest];
  }
  uint64_t peak(uint8_t finest) const {
    return std::max(asset_.build_peak_bytes[finest], asset_.build_peak_bytes[root_]);
  }

  /// The levels that are worth trying as the finest under a cap on the peak, from the root to finer ones: on the lower
  /// convex hull, the error ever smaller and dearer.
  std::vector<uint8_t> hull(uint64_t peak_cap) const {
    std::vector<uint8_t> hull = {root_};
    for (int i = root_ - 1; i >= asked_; --i) {
      const auto level = static_cast<uint8_t>(i);
      if (peak(level) > peak_cap || !(error(level) < error(hull.back()))) continue;
      while (hull.size() > 1 && (bytes(level) <= bytes(hull.back()) ||
                                 gain(hull[hull.size() - 2], level) >= gain(hull[hull.size() - 2], hull.back()))) {
        hull.pop_back();
      }
      hull.push_back(level);
    }
    return hull;
  }
  /// Error that each byte takes away between two levels; infinite if it takes no bytes.
  double gain(uint8_t from, uint8_t to) const {
    const double more = static_cast<double>(bytes(to)) - static_cast<double>(bytes(from));
    const double gain = (error(from) - error(to)) / more;
    return more > 0 && !std::isnan(gain) ? gain : std::numeric_limits<double>::infinity();
  }

  // ---- what costs rays less ----

  /// Whether rays cost less in a level than in a finer one; where that is not known, coarser ones are taken to.
  bool is_cheaper(uint8_t level, uint8_t finer) const {
    if (asset_.ray_cost.empty() || !(asset_.ray_cost[level] > 0) || !(asset_.ray_cost[finer] > 0)) return true;
    return asset_.ray_cost[level] < asset_.ray_cost[finer];
  }
  /// The levels from `finest` on, each of which costs rays less than all before; and the root.
  std::vector<uint8_t> cheaper_from(uint8_t finest) const {
    std::vector<uint8_t> levels = {finest};
    for (unsigned i = finest + 1u; i <= root_; ++i) {
      const auto level = static_cast<uint8_t>(i);
      if (level == root_ || is_cheaper(level, levels.back())) levels.push_back(level);
    }
    return levels;
  }
  /// The level that serves what is asked: the asked one, or a finer one in which rays cost a fifth less. That is about
  /// what the count is right to, and what bytes are worth giving for.
  uint8_t best_for_asked() const {
    constexpr float kWorthwhile = 0.8f;
    const std::vector<uint8_t> levels = cheaper_from(0);
    const uint8_t level = *std::prev(std::upper_bound(levels.begin(), levels.end(), asked_));
    if (level == asked_ || asset_.ray_cost.empty()) return asked_;
    return asset_.ray_cost[level] < kWorthwhile * asset_.ray_cost[asked_] ? level : asked_;
  }
  /// Pixels of the instances that use a level, not the finest, if the next coarser usable one is `next`; of those that
  /// see it blended with a finer one, too.
  double pixels_between(uint8_t level, uint8_t next) const {
    double pixels = 0;
    for (size_t i = level - 1u; i < next && i < asset_.demand.size(); ++i) {
      if (i >= level || asset_.demand[i].coarsest_lambda > asset_.lambda[level] - 1) pixels += asset_.demand[i].pixels;
    }
    return pixels;
  }
  /// The morph from a usable level to the next usable one; none if levels lie between them.
  std::optional<MorphSize> morph(uint8_t level, uint8_t next) const {
    return asset_.morphs.empty() || next != level + 1 ? std::nullopt : asset_.morphs[level];
  }
  /// Pixels of the instances that may see a level blended with the next.
  double pixels_blended(uint8_t level) const {
    if (level >= asset_.demand.size()) return 0;
    const LevelDemand& demand = asset_.demand[level];
    return demand.coarsest_lambda > asset_.lambda[level + 1u] - 1 ? demand.pixels : 0;
  }
  uint64_t level_bytes(uint8_t level) const { return asset_.resident_bytes[level]; }
  uint64_t level_peak(uint8_t level) const { return asset_.build_peak_bytes[level]; }

 private:
  bool is_asked(uint8_t level) const { return level < asset_.demand.size() && asset_.demand[level].pixels > 0; }

  const PlanAsset& asset_;
  uint8_t root_;
  uint8_t asked_ = 0;
  std::vector<double> error_, coarser_;  // per level, if it were the finest
};

/// The finest level of each asset, with the sums.
struct Draft {
  std::vector<uint8_t> finest;
  Bytes resident = 0;
  uint64_t peak = 0;
  double error = 0;
};

Draft measured(std::span<const Choice> choices, std::vector<uint8_t> finest) {
  Draft draft{std::move(finest), 0, 0, 0};
  for (size_t i = 0; i < choices.size(); ++i) {
    draft.resident += choices[i].bytes(draft.finest[i]);
    draft.peak = std::max(draft.peak, choices[i].peak(draft.finest[i]));
    draft.error += choices[i].error(draft.finest[i]);
  }
  return draft;
}

template <typename Level>
Draft draft_of(std::span<const Choice> choices, Level level) {
  std::vector<uint8_t> finest;
  for (const Choice& choice : choices) finest.push_back(level(choice));
  return measured(choices, std::move(finest));
}

/// One asset made finer.
struct Step {
  double gain;
  size_t asset;
  uint8_t from, to;
};

/// All steps along the hulls, those first that take most error away per byte. Along one hull gains fall, and ties keep
/// their order, so an asset's steps stay in order.
std::vector<Step> steps_under(std::span<const Choice> choices, uint64_t peak_cap) {
  std::vector<Step> steps;
  for (size_t i = 0; i < choices.size(); ++i) {
    const std::vector<uint8_t> hull = choices[i].hull(peak_cap);
    for (size_t k = 1; k < hull.size(); ++k) {
      const double before = k > 1 ? steps.back().gain : std::numeric_limits<double>::infinity();
      steps.push_back({std::min(before, choices[i].gain(hull[k - 1], hull[k])), i, hull[k - 1], hull[k]});
    }
  }
  std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.gain > b.gain; });
  return steps;
}

/// The best plan that greedy steps find in which no build takes more than the cap.
Draft refine(std::span<const Choice> choices, const Draft& roots, uint64_t peak_cap, Bytes budget) {
  std::vector<uint8_t> finest = roots.finest;
  Bytes resident = roots.resident;
  for (const Step& step : steps_under(choices, peak_cap)) {
    if (finest[step.asset] != step.from) continue;  // an earlier step did not fit
    const Choice& choice = choices[step.asset];
    const Bytes after = resident - choice.bytes(step.from) + choice.bytes(step.to);
    if (after + peak_cap > budget) continue;
    resident = after;
    finest[step.asset] = step.to;
  }
  return measured(choices, std::move(finest));
}

/// Caps on the peak of builds that are worth trying: what some level takes, at least what the roots take.
std::vector<uint64_t> peak_caps(std::span<const Choice> choices, uint64_t of_roots) {
  std::vector<uint64_t> peaks = {of_roots};
  for (const Choice& choice : choices) {
    for (unsigned i = choice.asked(); i < choice.root(); ++i) peaks.push_back(choice.peak(static_cast<uint8_t>(i)));
  }
  std::sort(peaks.begin(), peaks.end());
  peaks.erase(std::unique(peaks.begin(), peaks.end()), peaks.end());
  peaks.erase(peaks.begin(), std::lower_bound(peaks.begin(), peaks.end(), of_roots));
  if (peaks.size() <= kMostCaps) return peaks;
  std::vector<uint64_t> some;
  for (size_t i = 0; i < kMostCaps; ++i) some.push_back(peaks[i * (peaks.size() - 1) / (kMostCaps - 1)]);
  return some;
}

bool fits(const Draft& draft, Bytes budget) { return draft.resident + draft.peak <= budget; }

Draft best_under(std::span<const Choice> choices, const Draft& roots, const Draft& asked, Bytes budget) {
  if (fits(asked, budget)) return asked;
  Draft best = roots;
  for (const uint64_t cap : peak_caps(choices, roots.peak)) {
    if (roots.resident + cap > budget) break;
    Draft draft = refine(choices, roots, cap, budget);
    if (draft.error < best.error) best = std::move(draft);
  }
  return best;
}

/// A level that may be added for speed: in place of the asset's finest, or beside it. Or a morph from that level.
struct Extra {
  double pixels_per_byte;
  size_t asset;
  uint8_t level;
  bool is_finest;
};

/// Adds what fits of what is not needed, that first which most pixels see per byte.
class SpeedUp {
 public:
  SpeedUp(std::span<const Choice> choices, const Draft& draft, Bytes budget)
      : choices_(choices), finest_(draft.finest), resident_(draft.resident), peak_(draft.peak), budget_(budget) {}

  /// A finer level than asked where rays cost clearly less in it.
  void refine_for_speed() {
    std::vector<Extra> extras;
    for (size_t i = 0; i < choices_.size(); ++i) {
      const uint8_t level = choices_[i].best_for_asked();
      if (finest_[i] <= choices_[i].asked() && level < finest_[i]) add(extras, i, level, choices_[i].pixels(), true);
    }
    take_what_fits(extras);
  }
  /// Coarser levels than the finest, for the instances that ask for no more.
  void coarsen_for_speed() {
    usable_.resize(choices_.size());
    std::vector<Extra> extras;
    for (size_t i = 0; i < choices_.size(); ++i) {
      usable_[i] = {finest_[i]};
      if (finest_[i] != choices_[i].root()) usable_[i].push_back(choices_[i].root());
      const std::vector<uint8_t> cheaper = choices_[i].cheaper_from(finest_[i]);
      for (size_t k = 1; k + 1 < cheaper.size(); ++k) {
        const double pixels = choices_[i].pixels_between(cheaper[k], cheaper[k + 1]);
        if (pixels > 0) add(extras, i, cheaper[k], pixels, false);
      }
    }
    take_what_fits(extras);
    for (std::vector<uint8_t>& levels : usable_) std::sort(levels.begin(), levels.end());
  }

  /// Morphs between usable neighbours.
  void add_morphs() {
    morphs_.resize(choices_.size());
    peak_ = peak();
    std::vector<Extra> extras;
    for (size_t i = 0; i < choices_.size(); ++i) {
      for (size_t k = 0; k + 1 < usable_[i].size(); ++k) {
        const uint8_t level = usable_[i][k];
        const auto morph = choices_[i].morph(level, usable_[i][k + 1]);
        const double pixels = choices_[i].pixels_blended(level);
        if (morph && pixels > 0) {
          extras.push_back({pixels / (1.0 + static_cast<double>(morph->resident_bytes)), i, level, false});
        }
      }
    }
    sort_by_worth(extras);
    for (const Extra& extra : extras) add_morph(extra);
    for (std::vector<uint8_t>& levels : morphs_) std::sort(levels.begin(), levels.end());
  }

  const std::vector<std::vector<uint8_t>>& usable() const { return usable_; }
  const std::vector<std::vector<uint8_t>>& morphs() const { return morphs_; }
  uint32_t morphs_given_up() const { return morphs_given_up_; }
  Bytes resident() const { return resident_; }
  /// Of the largest build among what is usable now.
  uint64_t peak() const {
    uint64_t peak = morph_peak_;
    for (size_t i = 0; i < choices_.size(); ++i) {
      for (const uint8_t level : usable_[i]) peak = std::max(peak, choices_[i].level_peak(level));
    }
    return peak;
  }

 private:
  void add(std::vector<Extra>& extras, size_t asset, uint8_t level, double pixels, bool is_finest) const {
    const double bytes = 1.0 + static_cast<double>(choices_[asset].level_bytes(level));
    extras.push_back({pixels / bytes, asset, level, is_finest});
  }
  static void sort_by_worth(std::vector<Extra>& extras) {
    std::stable_sort(extras.begin(), extras.end(),
                     [](const Extra& a, const Extra& b) { return a.pixels_per_byte > b.pixels_per_byte; });
  }
  void add_morph(const Extra& extra) {
    const MorphSize size = *choices_[extra.asset].morph(extra.level, static_cast<uint8_t>(extra.level + 1));
    const uint64_t peak = std::max(peak_, size.build_peak_bytes);
    if (resident_ + size.resident_bytes + peak > budget_) {
      ++morphs_given_up_;
      return;
    }
    resident_ += size.resident_bytes;
    peak_ = peak;
    morph_peak_ = std::max(morph_peak_, size.build_peak_bytes);
    morphs_[extra.asset].push_back(extra.level);
  }
  void take_what_fits(std::vector<Extra>& extras) {
    sort_by_worth(extras);
    for (const Extra& extra : extras) {
      const Choice& choice = choices_[extra.asset];
      const Bytes given_back = extra.is_finest ? choice.bytes(finest_[extra.asset]) : 0;
      const Bytes taken = extra.is_finest ? choice.bytes(extra.level) : choice.level_bytes(extra.level);
      const uint64_t peak = std::max(peak_, choice.level_peak(extra.level));
      if (resident_ - given_back + taken + peak > budget_) continue;
      resident_ = resident_ - given_back + taken;
      peak_ = peak;
      if (extra.is_finest) {
        finest_[extra.asset] = extra.level;
      } else {
        usable_[extra.asset].push_back(extra.level);
      }
    }
  }

  std::span<const Choice> choices_;
  std::vector<uint8_t> finest_;
  std::vector<std::vector<uint8_t>> usable_;
  std::vector<std::vector<uint8_t>> morphs_;
  uint32_t morphs_given_up_ = 0;
  Bytes resident_;
  uint64_t peak_;
  uint64_t morph_peak_ = 0;
  Bytes budget_;
};

tl::unexpected<Error> roots_do_not_fit(size_t assets, uint64_t budget_bytes, uint64_t fixed_bytes, uint64_t needed) {
  return make_error(ErrorCode::OutOfBudget,
                    fmt::format("the budget of {} ({} bytes) is too small: instances and tables take {}, and with them "
                                "the coarsest levels of {} assets alone need {} ({} bytes); raise the budget to at "
                                "least that",
                                format_bytes(budget_bytes), budget_bytes, format_bytes(fixed_bytes), assets,
                                format_bytes(needed), needed));
}

void describe_error(std::span<const Choice> choices, const Draft& draft, Plan& plan) {
  double pixels = 0, coarser = 0;
  for (size_t i = 0; i < choices.size(); ++i) {
    pixels += choices[i].pixels();
    coarser += choices[i].levels_coarser(draft.finest[i]);
    plan.levels_given_up.push_back(choices[i].levels_given_up(draft.finest[i]));
  }
  if (!(pixels > 0)) return;
  plan.error = draft.error / pixels;
  plan.bias = coarser / pixels;
}

}  // namespace

void PlanAsset::ask(float wanted_lambda, double pixels) {
  demand.resize(lambda.size());
  const size_t level = level_for(lambda, wanted_lambda);
  const double asked = std::clamp(wanted_lambda > lambda[0] ? wanted_lambda : lambda[0], lambda[0], lambda.back());
  demand[level].pixels += pixels;
  demand[level].pixels_lambda += pixels * asked;
  demand[level].pixels_detail += pixels * std::exp2(-asked);
  demand[level].coarsest_lambda = std::max(demand[level].coarsest_lambda, static_cast<float>(asked));
}

Result<Plan> plan_levels(std::span<const PlanAsset> assets, uint64_t budget_bytes, uint64_t fixed_bytes) {
  std::vector<Choice> choices;
  for (size_t i = 0; i < assets.size(); ++i) {
    if (const auto problem = find_problem(assets[i])) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("cannot plan asset {}: {}", i, *problem));
    }
    choices.emplace_back(assets[i]);
  }

  const Draft roots = draft_of(choices, [](const Choice& choice) { return choice.root(); });
  const Draft asked = draft_of(choices, [](const Choice& choice) { return choice.asked(); });
  const Bytes needed = roots.resident + roots.peak + fixed_bytes;
  if (needed > budget_bytes) return roots_do_not_fit(assets.size(), budget_bytes, fixed_bytes, saturated(needed));

  const Bytes budget = budget_bytes - fixed_bytes;
  const Draft best = best_under(choices, roots, asked, budget);
  SpeedUp speed_up(choices, best, budget);
  speed_up.refine_for_speed();
  speed_up.coarsen_for_speed();
  speed_up.add_morphs();

  Plan plan;
  plan.usable = speed_up.usable();
  plan.morphs = speed_up.morphs();
  plan.morphs_given_up = speed_up.morphs_given_up();
  plan.resident_bytes = saturated(speed_up.resident());
  plan.build_peak_bytes = speed_up.peak();
  plan.asked_bytes = saturated(asked.resident + asked.peak + fixed_bytes);
  describe_error(choices, best, plan);
  return plan;
}

}  // namespace farfield
