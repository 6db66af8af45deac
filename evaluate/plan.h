// SPDX-License-Identifier: Apache-2.0
// What an evaluation renders: levels, views, samples.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "cache/manifest.h"
#include "evaluate/views.h"

namespace farfield {

struct EvaluateOptions;

/// What will be rendered for one level, under each light.
struct LevelPlan {
  LevelEntry entry;
  std::vector<OrthoView> views;
  uint64_t pixels = 0;  ///< over all views
  int samples_per_pixel = 0;

  double cost() const { return static_cast<double>(pixels) * samples_per_pixel; }
};

/// The levels that the options choose, finest first, with pictures that show both the level and the source. Errors:
/// those of LevelFile::open; InvalidArgument (no such level, pictures beyond 2^26 pixels).
Result<std::vector<LevelPlan>> plan_evaluation(const Manifest& manifest, const Box3& source_bounds,
                                               const EvaluateOptions& options);

/// Samples per pixel that keep a level's cost bounded: many for the few pixels of coarse levels. pixels: over all
/// views. A multiple of kParts in [8, 4096].
int default_samples_per_pixel(uint64_t pixels);

}  // namespace farfield
