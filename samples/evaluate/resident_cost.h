// SPDX-License-Identifier: Apache-2.0
// Where bake and runtime meet: what the runtime would take for a level, in the words of the bake.
#pragma once

#include "base/result.h"
#include "cache/level.h"
#include "prefilter/bake.h"

namespace farfield {

/// For BakeOptions::measure_resident: builds the level's BVH as the runtime would. Errors: those of
/// measure_level_scene. Any thread.
Result<ResidentCost> measure_resident(const LevelView& level);

}  // namespace farfield
