// SPDX-License-Identifier: Apache-2.0
// Faces of a level in groups of one material, for formats whose materials are few: levels have a material per face.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "export/face_looks.h"

namespace farfield {

/// What keeps faces apart; the rest is averaged within groups.
struct GroupRule {
  bool by_diffuse = true, by_transmission = true;
  bool by_opacity = true;  ///< false: only by whether a face is opaque
  uint32_t most_groups = 1024;
};

struct MaterialGroups {
  std::vector<FaceLook> looks;     ///< per group, means by area, of albedos by area and opacity: what is seen is kept
  std::vector<uint32_t> of_face;   ///< per face: its group
  std::vector<uint32_t> faces;     ///< face numbers, group by group, ascending within
  std::vector<uint32_t> begin{0};  ///< faces of group g: faces[begin[g] .. begin[g + 1])
  float widest_step = 0;           ///< of square roots of albedos: how unlike faces of a group may be; 0: not at all
};

/// The finest grouping that has at most most_groups groups, in the order of their first faces.
MaterialGroups group_materials(std::span<const FaceLook> looks, const GroupRule& rule);

}  // namespace farfield
