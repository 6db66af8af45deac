// SPDX-License-Identifier: Apache-2.0
// What a host wants to know again of an instance when a ray meets it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace farfield {

/// Farfield keeps it and hands it back (Runtime::instance_data); no picture of its own depends on it.
struct InstanceData {
  uint64_t id = 0;       ///< the host's own number
  glm::vec3 tint{1.0f};  ///< linear; by convention a factor for the colour

  friend bool operator==(const InstanceData& a, const InstanceData& b) { return a.id == b.id && a.tint == b.tint; }
  friend bool operator!=(const InstanceData& a, const InstanceData& b) { return !(a == b); }
};

}  // namespace farfield
