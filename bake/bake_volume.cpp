// SPDX-License-Identifier: Apache-2.0
#include "bake/bake_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "bake/level_writer.h"
#include "bake/pack_fog.h"
#include "base/stopwatch.h"
#include "scattering/fog_phase.h"

namespace farfield {
namespace {

static_assert(static_cast<float>(kMostAnisotropy) == kMostFogAnisotropy);

uint32_t longest_side(const ivec3& dims) { return static_cast<uint32_t>(std::max({dims.x, dims.y, dims.z})); }

uint32_t last_level(const ivec3& dims, const BakeOptions& options) {
  if (options.source_only) return 0;
  uint32_t level = 0;
  while ((longest_side(dims) - 1) >> level >= options.coarsest_grid) ++level;
  return level;
}

/// How much of the whole is done when levels up to `level` are: each takes about as long as the others.
double done_before(uint32_t level, uint32_t last) { return static_cast<double>(level) / (last + 1.0); }

}  // namespace

Result<BakeReport> bake_levels(const SourceVolume& volume, const BakeOptions& options, BakeWorkspace workspace,
                               BakeReport report) {
  Manifest& manifest = report.manifest;
  manifest.origin = volume.origin;
  manifest.rotation = volume.rotation;
  manifest.base_resolution = volume.voxel_size;
  LevelWriter writer(workspace.asset_dir(), options.measure_resident, manifest);
  const uint32_t last = last_level(volume.dims, options);
  for (uint32_t level = 0; level <= last; ++level) {
    LevelReport done;
    done.level = level;
    done.grid = ((longest_side(volume.dims) - 1) >> level) + 1;
    const Job job = options.job.step(fmt::format("level {}: {}", level, level == 0 ? "pack" : "downsample"),
                                     done_before(level, last), done_before(level + 1, last));
    const Stopwatch making;
    FARFIELD_TRY_LET(const FogLevel packed,
                     level == 0 ? pack_source_fog(volume, job) : pack_fog(volume, level, options.downsampling, job));
    done.voxels = voxel_count(packed);
    done.voxelize_seconds = making.seconds();
    const Stopwatch writing;
    const uint64_t most = manifest.levels.empty()
                              ? std::numeric_limits<uint64_t>::max()
                              : most_bytes_after(manifest.levels.back().resident_bytes, level == last);
    FARFIELD_TRY_LET(done.is_written, writer.write(view_of(packed), done.grid, most));
    done.write_seconds = writing.seconds();
    report.levels.push_back(done);
  }
  FARFIELD_TRY(writer.finish());
  FARFIELD_TRY(workspace.publish());
  options.job.report(1, "done");
  return report;
}

}  // namespace farfield
