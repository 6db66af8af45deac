// SPDX-License-Identifier: Apache-2.0
// One pixel of a planned frame: what rays through it hit, and which instances' bounds they meet.
#pragma once

#include <string>
#include <vector>

#include "path_tracer/camera.h"
#include "path_tracer/integrator.h"
#include "path_tracer/pixel_report.h"

namespace farfield {

/// What the runtime's assets and instances are called, by id.
struct PixelNames {
  std::vector<std::string> assets, objects;
};

/// Fills in report.hits, of report.rays random rays, and report.visits, of the ray through the middle.
void look_at_pixel(const TraceScene& scene, const Camera& camera, const PlanSummary& plan, const PixelNames& names,
                   PixelReport& report);

}  // namespace farfield
