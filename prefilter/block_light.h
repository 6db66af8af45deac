// SPDX-License-Identifier: Apache-2.0
// What light does in a block of a medium that it enters along one of the axes, uniformly over a side: how much of it
// leaves after one event, how bright it is when it leaves at all (thesis 14.1.4). The same rays and random numbers go
// through the block and through the homogeneous voxel that is to stand for it, so that blocks that are homogeneous
// already stay exactly what they are.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "import/source_volume.h"
#include "prefilter/fog_shape.h"
#include "scattering/fog_phase.h"

namespace farfield {

struct FogBlockVoxel {
  ivec3 at;        ///< in the block
  uint32_t brick;  ///< of the source
  size_t in_brick;
  double depth = 0;  ///< density times the edge: what sqrt(w^T S w) is multiplied with, if there is an S
  vec3 albedo;       ///< of all that it scatters
};

/// A cube of voxels of a source, in voxels from its lower corner. What lies outside of the source is empty. Refers to
/// the source. Immutable; any thread.
class FogBlock {
 public:
  FogBlock(const SourceVolume& source, const ivec3& lower, int side);

  int side() const { return side_; }
  bool is_empty() const { return bricks_.empty(); }
  /// sigma_t of a voxel towards w times the length of its edge; 0 outside of the source.
  double depth(const ivec3& voxel, const dvec3& w) const;
  /// Of all that the voxel scatters.
  vec3 albedo(const ivec3& voxel) const;
  /// How it scatters, but for the albedo. anisotropy: where voxels have none of their own.
  FogParams phase(const ivec3& voxel, float anisotropy) const;
  /// Calls visit(FogBlockVoxel) for the voxels with a density, in a fixed order.
  template <typename Visit>
  void for_each_voxel(const Visit& visit) const;

 private:
  /// A part of the block in one brick of the source.
  struct Part {
    ivec3 lower;     ///< of the brick, in the block's voxels
    uint32_t brick;  ///< index into the source's bricks
  };
  vec3 albedo_of(uint32_t brick, size_t in_brick) const;
  /// The brick of a voxel that has a density.
  uint32_t brick_of(const ivec3& at) const { return source_.brick_table[source_.table_index(at / kVolumeBrickSide)]; }

  const SourceVolume& source_;
  ivec3 lower_;
  int side_;
  double voxel_size_;
  std::vector<Part> bricks_;  ///< that are not empty
};

/// The voxel that stands for a block, as wide as it.
struct FogCube {
  double depth = 0;  ///< along an edge
  int side = 1;      ///< in the block's voxels
  vec3 albedo{1.0f};
  bool has_shape = false;
  SymMat3 shape{};  ///< of the attenuation; depth is along its largest axis
};

/// Means over all rays that enter.
struct BlockLight {
  dvec3 single{0.0};                  ///< share that leaves after exactly one event
  double single_if_white = 0;         ///< the same for albedo 1
  dvec3 albedo{1.0};                  ///< throughput of what is scattered at all, when it leaves: the effective albedo
  double cosine = 0;                  ///< between how light came and how it leaves, of what is scattered at all
  std::vector<double> events;         ///< share of what is scattered at all that has n events, n = 1, ...: of cubes
  std::vector<double> event_cosines;  ///< the same, times the mean cosine of these

  /// The cosine that a cube of another albedo would have: its light takes the same ways.
  double cosine_for(double cube_albedo) const;
};

struct BlockRays {
  uint32_t count = 0;  ///< rounded up to a multiple of 6: the directions along the axes
  uint64_t seed = 0;
  float anisotropy = 0;     ///< g
  bool with_single = true;  ///< whether single scattering is wanted, too
};

BlockLight follow_light(const FogBlock& block, const BlockRays& rays);
BlockLight follow_light(const FogCube& cube, const BlockRays& rays);

// ---- inline

template <typename Visit>
void FogBlock::for_each_voxel(const Visit& visit) const {
  for (const Part& part : bricks_) {
    const DensityBrick& densities = source_.bricks[part.brick];
    const ivec3 first = glm::max(part.lower, ivec3(0)), end = glm::min(part.lower + kVolumeBrickSide, ivec3(side_));
    ivec3 voxel;
    for (voxel.z = first.z; voxel.z < end.z; ++voxel.z)
      for (voxel.y = first.y; voxel.y < end.y; ++voxel.y)
        for (voxel.x = first.x; voxel.x < end.x; ++voxel.x) {
          const size_t i = index_in_brick(voxel - part.lower);
          if (!(densities[i] > 0)) continue;
          visit(FogBlockVoxel{voxel, part.brick, i, static_cast<double>(densities[i]) * voxel_size_,
                              albedo_of(part.brick, i)});
        }
  }
}

}  // namespace farfield
