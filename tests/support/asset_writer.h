// SPDX-License-Identifier: Apache-2.0
// Baked assets on disk, made without the bake.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "cache/level.h"
#include "cache/manifest.h"

namespace farfield::test {

/// What a level will take in memory.
using MeasureLevel = std::function<LevelCost(const LevelView&)>;

/// What the morph between two levels will take.
using MeasureMorph = std::function<LevelCost(const LevelView& fine, const LevelView& coarse)>;

/// Writes an asset of these levels, finest first; without measure_morph they dissolve. Stops the test program if it
/// cannot. Returns the manifest.
Manifest write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels,
                     const MeasureLevel& measure, dvec3 origin = dvec3(0.0), const MeasureMorph& measure_morph = {});

/// A manifest of three levels (0, 1 and 3).
Manifest sample_manifest();

/// Writes a sound asset of three levels (0, 1 and 3) with surfaces, volumes and morph maps. Returns its manifest.
Manifest write_sample_asset(const std::filesystem::path& folder);

}  // namespace farfield::test
