// SPDX-License-Identifier: Apache-2.0
// The plan: which levels of each asset rays may use so that everything fits the budget (docs/architecture.md, decision
// 5; docs/decisions/0020). Pure and deterministic.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"

namespace farfield {

/// What the instances ask of one stored level: those for which the next coarser one is too coarse.
struct LevelDemand {
  double pixels = 0;          ///< how much of the images they cover
  double pixels_lambda = 0;   ///< sum of pixels * lambda
  double pixels_detail = 0;   ///< sum of pixels * 2^-lambda: times 2^k, what serving them level k in its place misses
  float coarsest_lambda = 0;  ///< of them
};

/// What a morph takes beside its two levels.
struct MorphSize {
  uint64_t resident_bytes = 0;
  uint64_t build_peak_bytes = 0;
};

/// What one asset costs and what the cameras ask of it.
struct PlanAsset {
  std::vector<uint64_t> resident_bytes;    ///< per stored level, finest first; the last is the root
  std::vector<uint64_t> build_peak_bytes;  ///< same length
  std::vector<float> lambda;               ///< of each stored level: its number k (levels may be skipped), same length
  std::vector<float> ray_cost;  ///< work of a ray in each stored level, 0 where it is not known; same length or empty
  std::vector<LevelDemand> demand;               ///< of each stored level; empty: no instance
  std::vector<std::optional<MorphSize>> morphs;  ///< of each stored level to the next; same length or empty

  /// Adds an instance that the cameras see at this lambda (clamped to the levels; NaN asks for the finest) with so many
  /// pixels >= 0.
  void ask(float wanted_lambda, double pixels);
};

struct Plan {
  /// Per asset: indices into its stored levels that rays may use, finest first; the last is the root.
  std::vector<std::vector<uint8_t>> usable;
  /// Per asset: the usable levels that morph to the next stored one, usable too.
  std::vector<std::vector<uint8_t>> morphs;
  uint32_t morphs_given_up = 0;   ///< pairs of usable levels that instances see blended and whose morph does not fit
  uint64_t resident_bytes = 0;    ///< of everything the plan allows
  uint64_t build_peak_bytes = 0;  ///< of the largest single build
  /// Pixel-weighted mean over instances of how much wider voxels are than asked: 1 if nothing was given up, 2 if all
  /// levels are one too coarse. What the plan minimises.
  double error = 1;
  double bias = 0;           ///< pixel-weighted mean of how many levels coarser than asked; 0: nothing was given up
  uint64_t asked_bytes = 0;  ///< the smallest budget that gives nothing up, fixed bytes included
  std::vector<float> levels_given_up;  ///< per asset: how many levels coarser than its finest instance asks

  uint8_t finest(size_t asset) const { return usable[asset].front(); }
};

/// Chooses each asset's levels, in this order:
///   1. the finest level that each asset needs, so that the projected error is small while resident + peak + fixed
///      bytes fit the budget; the root is always there;
///   2. where room is left, what costs rays less: a finer level than asked, if by a fifth, and coarser ones for
///      instances that ask for no more. A level that costs rays more than a finer usable one is left out;
///   3. where room is left, morphs between usable neighbours that instances see blended.
/// More budget never gives a larger error. Errors: OutOfBudget if the roots alone do not fit; the message has the
/// number of bytes that would. InvalidArgument: lists of different lengths, more than 256 levels, numbers not sorted.
Result<Plan> plan_levels(std::span<const PlanAsset> assets, uint64_t budget_bytes, uint64_t fixed_bytes);

}  // namespace farfield
