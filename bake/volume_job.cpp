// SPDX-License-Identifier: Apache-2.0
#include "bake/volume_job.h"

#include <array>

#include "bake/pack_level.h"
#include "base/hash.h"

namespace farfield {

uint64_t VolumeJob::key() const {
  uint64_t key = mix64(kVoxelizeVersion, mix64(options.rays_per_voxel, options.seed));
  key = mix64(key, mix64(options.bricks.first, options.bricks.count));
  const std::array<double, 4> place = {lattice.origin.x, lattice.origin.y, lattice.origin.z, lattice.voxel_size};
  key = hash_values<double>(place, key);
  key = hash_values<vec3>(geometry.positions, key);
  key = hash_values<uvec3>(geometry.triangles, key);
  return hash_values<FaceMaterial>(geometry.materials, key);
}

std::string VolumeJob::file_name() const { return "volume_" + to_hex(key()) + ".ffl"; }

Result<LevelData> VolumeJob::run() const {
  FARFIELD_TRY_LET(const auto volume, voxelize(geometry, lattice, options));
  return pack_volume(volume);
}

}  // namespace farfield
