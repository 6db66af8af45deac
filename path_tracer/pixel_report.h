// SPDX-License-Identifier: Apache-2.0
// `farfield why`: what one pixel of a frame shows, and why not more of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "path_tracer/render_job.h"

namespace farfield {

/// A level of an asset under the frame's plan.
struct PixelLevel {
  uint32_t level = 0;   ///< k
  float footprint = 0;  ///< world units: it serves what is at least so wide on the instance
  uint64_t bytes = 0;   ///< once loaded
  bool is_loaded = false;
  bool is_broken = false;
  bool is_planned = false;  ///< rays may use it in this frame
};

/// An instance whose bounds the middle of the pixel meets.
struct PixelVisit {
  std::string asset, object;
  RayVisit visit;
  float levels_given_up = 0;       ///< of the asset in this frame, for the budget's sake
  std::vector<PixelLevel> levels;  ///< finest first
};

/// What some of the rays through the pixel have hit.
struct PixelHit {
  std::string asset, object;  ///< empty: nothing, the background
  uint32_t level = 0;
  bool is_volume = false;
  int rays = 0;
  double distance = 0;  ///< mean, world units
};

struct PixelReport {
  int frame = 0, x = 0, y = 0, width = 0, height = 0;
  vec3 origin{0.0f}, direction{0.0f};  ///< of the ray through the pixel's middle
  float cone_width = 0, cone_spread = 0;
  uint64_t budget_bytes = 0, planned_bytes = 0, asked_bytes = 0;
  int rays = 0;
  std::vector<PixelHit> hits;      ///< of `rays` rays, the most frequent first
  std::vector<PixelVisit> visits;  ///< nearest first
};

/// Plans the frame as render_frame() does and looks at one pixel of it; x to the right, y down, from 0. Errors: those
/// of render_frame(); InvalidArgument (no such pixel).
Result<PixelReport> explain_pixel(const RenderOptions& options, int frame, int x, int y);

/// Why this visit sees the level that it sees, in words, a sentence each: why nothing finer, and why nothing coarser
/// where it is finer than asked.
std::vector<std::string> reasons(const PixelVisit& visit, const PixelReport& report);

}  // namespace farfield
