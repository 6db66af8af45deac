// SPDX-License-Identifier: Apache-2.0
// Where inside a voxel its density is: a share for each of its 2^3 octants (docs/decisions/0016).
#pragma once

#include <array>
#include <cstdint>

#include "base/vec.h"

namespace farfield {

/// Two bits for each octant, number of a share: bits 2 o and 2 o + 1 of octant o. Bit a of o: the upper half along axis
/// a.
using PackedOctants = uint16_t;
inline constexpr PackedOctants kFullOctants = 0xffff;

/// Shares of the voxel's density: about even in what they stop. docs/decisions/0016 has what they were chosen by.
inline constexpr std::array<float, 4> kOctantShares = {0, 0.12f, 0.4f, 1};

inline float octant_share(PackedOctants octants, int octant) {
  return kOctantShares[static_cast<size_t>(octants >> 2 * octant & 3)];
}

/// Of all octants.
inline float mean_share(PackedOctants octants) {
  float sum = 0;
  for (int o = 0; o < 8; ++o) sum += octant_share(octants, o);
  return sum / 8;
}

/// The octant of the voxel in which a point is; points outside count for the nearest octant. In voxels.
template <typename T>
int octant_at(const glm::vec<3, T>& point, const ivec3& voxel) {
  const glm::vec<3, T> middle = glm::vec<3, T>(voxel) + T(0.5);
  return (point.x >= middle.x ? 1 : 0) | (point.y >= middle.y ? 2 : 0) | (point.z >= middle.z ? 4 : 0);
}

/// The octants of `voxel` along the part [enter, leave] of a ray that is in it: calls visit(octant, enter, leave) in
/// order while it returns true; false if it did not. `inverse`: 1 / direction. In voxels.
template <typename T, typename Visit>
bool walk_octants(const glm::vec<3, T>& origin, const glm::vec<3, T>& direction, const glm::vec<3, T>& inverse,
                  const ivec3& voxel, T enter, T leave, Visit&& visit) {
  const glm::vec<3, T> planes = (glm::vec<3, T>(voxel) + T(0.5) - origin) * inverse;  // NaN: in the plane, along it
  while (enter < leave) {
    T next = leave;
    for (int axis = 0; axis < 3; ++axis) {
      if (planes[axis] > enter && planes[axis] < next) next = planes[axis];
    }
    const T middle = T(0.5) * (enter + next);
    if (!visit(octant_at<T>(origin + middle * direction, voxel), enter, next)) return false;
    enter = next;
  }
  return true;
}

}  // namespace farfield
