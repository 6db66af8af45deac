// SPDX-License-Identifier: Apache-2.0
// The plan: the finest level each asset may use so that everything fits the budget (docs/architecture.md, decision 5).
// Pure and deterministic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"

namespace farfield {

/// What one asset costs and what the cameras ask of it.
struct PlanAsset {
  std::vector<uint64_t> resident_bytes;    ///< per stored level, finest first; the last is the root
  std::vector<uint64_t> build_peak_bytes;  ///< same length
  std::vector<float> lambda;               ///< of each stored level: its number k (levels may be skipped), same length
  float wanted_lambda = 0;                 ///< finest lambda over its instances and the cameras, unclamped
  double pixels = 1;                       ///< how much of the images its instances cover, a weight >= 0
};

struct Plan {
  std::vector<uint32_t> finest;   ///< per asset: index into its stored levels; coarser ones are allowed too
  uint64_t resident_bytes = 0;    ///< of everything the plan allows
  uint64_t build_peak_bytes = 0;  ///< of the largest single build
  double bias = 0;  ///< pixel-weighted mean of how many levels coarser than asked; 0: nothing was given up
};

/// Chooses each asset's finest level: what the cameras ask for, coarsened while resident + peak + fixed bytes exceed
/// the budget, each time where the projected error grows least per byte freed (ties: lowest asset index). Errors:
/// OutOfBudget if the roots alone do not fit; the message has the number of bytes that would.
Result<Plan> plan_levels(std::span<const PlanAsset> assets, uint64_t budget_bytes, uint64_t fixed_bytes);

}  // namespace farfield
