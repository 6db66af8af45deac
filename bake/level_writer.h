// SPDX-License-Identifier: Apache-2.0
// Levels into the folder of an asset and into its manifest, if they are worth their bytes.
#pragma once

#include <filesystem>
#include <functional>

#include "bake/slab_hull.h"
#include "base/result.h"
#include "cache/level.h"
#include "cache/manifest.h"

namespace farfield {

/// What measures the cost of a level; empty: measure_level_scene(), as the runtime would.
using MeasureLevel = std::function<Result<LevelCost>(const LevelView&)>;

/// Writes the levels of one asset, finest first. Refers to the manifest. One thread at a time.
class LevelWriter {
 public:
  LevelWriter(std::filesystem::path folder, MeasureLevel measure, Manifest& manifest);

  /// Writes a level as level_K.ffl and notes it in the manifest, unless it has nothing in it or takes more than
  /// `most_bytes` of a host's memory; whether it was written. grid: for the manifest. Errors: Io, those of measuring.
  Result<bool> write(const LevelView& level, uint32_t grid, uint64_t most_bytes);

  /// Gives the manifest the hull and the bounds of all levels, and writes it. Errors: those of write_manifest().
  Result<void> finish();

 private:
  /// What the morph from the last level that was written to this one takes.
  Result<std::optional<LevelCost>> measure_morph_to(const LevelView& level) const;

  std::filesystem::path folder_;
  MeasureLevel measure_;
  Manifest& manifest_;
  SlabHull hull_;
};

/// What a level may take so that it saves a tenth against one that takes `bytes`; of a root, which stays resident, any
/// saving will do.
uint64_t most_bytes_after(uint64_t bytes, bool is_root);

}  // namespace farfield
