// SPDX-License-Identifier: Apache-2.0
#include "bake/volume_job.h"

#include <array>

#include "bake/pack_level.h"
#include "base/hash.h"

namespace farfield {
namespace {

uint64_t hash_surface(const Surface& surface, uint64_t key) {
  key = hash_values<vec3>(surface.positions, key);
  key = hash_values<uvec3>(surface.triangles, key);
  return hash_values<FaceMaterial>(surface.materials, key);
}

}  // namespace

uint64_t VolumeJob::key() const {
  uint64_t key = mix64(kVoxelizeVersion, mix64(options.rays_per_voxel, options.seed));
  const std::array<double, 4> place = {lattice.origin.x, lattice.origin.y, lattice.origin.z, lattice.voxel_size};
  key = hash_values<double>(place, key);
  return hash_surface(macrosurface, hash_surface(geometry, key));
}

std::string VolumeJob::file_name() const { return "volume_" + to_hex(key()) + ".ffl"; }

Result<LevelData> VolumeJob::run() const {
  FARFIELD_TRY_LET(const auto volume, measure_volume(geometry, macrosurface, lattice, options));
  return pack_volume(volume);
}

}  // namespace farfield
