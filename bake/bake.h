// SPDX-License-Identifier: Apache-2.0
// The bake: a source becomes a folder of levels (thesis 6.4 and chapters 7-10).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/asset_textures.h"
#include "base/job.h"
#include "base/result.h"
#include "cache/level.h"
#include "cache/manifest.h"
#include "import/source_volume.h"
#include "prefilter/condition.h"
#include "prefilter/downsample_fog.h"
#include "prefilter/keep_apart.h"
#include "prefilter/simplify.h"
#include "prefilter/surface.h"

namespace farfield {

/// What a level is made of, as the bake decides it; valid during the call.
struct LevelSurfaces {
  uint32_t level = 0;
  uint32_t grid = 0;
  double resolution = 0;          ///< r_k, scene units
  const Surface& macrosurface;    ///< what stayed surface, before simplification, and what is wrapped around walls
  const Surface& sub_resolution;  ///< what becomes voxels: all that left the surface up to this level
  const Surface& simplified;      ///< the macrosurface as the level has it
};

struct BakeOptions {
  uint32_t finest_grid = 512;     ///< level 1: longest side of the bounds / r_1. A power of two >= coarsest_grid
  uint32_t coarsest_grid = 8;     ///< last level, the root
  uint32_t rays_per_voxel = 200;  ///< thesis 10.1.3
  Downsampling downsampling = Downsampling::Matched;  ///< of volumes, whose grids and rays the file decides
  SimplifyMethod simplify = SimplifyMethod::Auto;     ///< of meshes
  bool source_only = false;                           ///< write only level 0 (what --full-detail renders)
  bool even_if_up_to_date = false;  ///< of an asset in memory: its hash does not say all that it depends on
  ImportOptions import;
  TextureFiles known_textures;  ///< of other assets on the same disk, to which equal ones are linked

  /// Called by the baking thread for each level of a mesh that is made, from 1 on; its error ends the bake.
  std::function<Result<void>(const LevelSurfaces&)> see_surfaces;
  /// Only for see_surfaces: nothing is voxelised, of levels none but the source is weighed against their bytes, and no
  /// asset is left in `out`. That holds none before, or there may be nothing to do.
  bool surfaces_only = false;

  /// What a level costs a host. Empty: measured by loading it as the runtime would (measure_level_scene).
  std::function<Result<LevelCost>(const LevelView&)> measure_resident;
  /// Reports come from the baking thread ("level 3: voxelise"). After a cancel what is finished stays for the next run.
  Job job;
};

/// What the import of a source is told: the bake's, with a cage's grid as fine as level 0.
ImportOptions import_options(const BakeOptions& options);

/// One level's part of the report.
struct LevelReport {
  uint32_t level = 0;
  uint32_t grid = 0;
  uint64_t macrosurface_triangles = 0;  ///< of the previous level's surface that stayed surface, before simplification
  uint64_t voxelized_triangles = 0;     ///< all sub-resolution geometry up to this level
  uint64_t triangles = 0;               ///< after simplification
  uint64_t voxels = 0;
  ApartReport apart;  ///< of walls close behind each other
  double analysis_seconds = 0, simplify_seconds = 0, voxelize_seconds = 0, write_seconds = 0;
  bool resumed = false;     ///< taken from an earlier, interrupted bake
  bool is_written = false;  ///< false: it saves nothing over a finer level
  bool worthless = false;   ///< so surely that it was not even voxelised; `voxels` is 0
};

struct BakeReport {
  Manifest manifest;
  std::vector<LevelReport> levels;
  std::vector<std::string> warnings;
  double import_seconds = 0, total_seconds = 0;
  bool up_to_date = false;  ///< the folder already held exactly this bake; nothing was done
};

/// The manifest of the asset in `out`, if it is whole and just what bake(source, out, options) would make. Reads and
/// hashes the files, without looking at what they mean; nothing if that is not enough to tell.
std::optional<Manifest> find_up_to_date(const std::filesystem::path& source, const std::filesystem::path& out,
                                        const BakeOptions& options);

/// Bakes `source` into the folder `out` (created; conventionally NAME.farfield). Same source and options give the same
/// bytes for any thread count. Interrupted bakes resume: finished levels are found by hash and kept; the manifest is
/// written last. Errors, with the warnings that came before: those of import_asset or read_volume; InvalidArgument
/// (options); Io (with nothing half-written under a final name); Cancelled.
Result<BakeReport> bake(const std::filesystem::path& source, const std::filesystem::path& out,
                        const BakeOptions& options);

/// The same for a volume in memory.
Result<BakeReport> bake(SourceVolume volume, const std::string& source_name, const std::filesystem::path& out,
                        const BakeOptions& options);

/// The same for an asset in memory; source_name goes into the manifest. options.import only names what was asked for.
Result<BakeReport> bake(ImportedAsset asset, const std::string& source_name, const std::filesystem::path& out,
                        const BakeOptions& options);

}  // namespace farfield
