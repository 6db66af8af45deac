// SPDX-License-Identifier: Apache-2.0
// The pictures of an evaluation: rendered in independent parts, written as EXR.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "evaluate/lights.h"
#include "evaluate/plan.h"
#include "path_tracer/asset_view.h"

namespace farfield {

/// kParts renders of the view, samples_per_pixel / kParts samples per pixel each, from seeds of their own: halves of
/// one render would share the even spread of its samples, and their products would be too small. R, G, B, A.
Result<std::vector<Image>> render_parts(const AssetView& asset, const OrthoView& view, int samples_per_pixel,
                                        uint64_t seed, const Lights& lights, const Job& job);

/// Makes the folder, and in it environment.exr: daylight for other renderers.
Result<void> prepare_images(const std::filesystem::path& folder);

/// Writes level_KK_view_VV_source.exr and .._level.exr into the folder; under other lights than daylight the light's
/// name stands behind the view: level_03_view_01_front_source.exr.
Result<void> write_images(const std::filesystem::path& folder, const LevelPlan& plan, size_t view, Light light,
                          const Image& source, const Image& level);

}  // namespace farfield
