// SPDX-License-Identifier: Apache-2.0
// A direction drawn from a scattering model.
#pragma once

#include <glm/glm.hpp>

namespace farfield {

/// One sampled direction. weight = f |cos| / pdf on surfaces, albedo * phase function / pdf in volumes. A zero weight
/// is a failed sample: end the path.
struct ScatterSample {
  glm::vec3 wi{0.0f};      ///< unit, away from the point
  glm::vec3 weight{0.0f};  ///< linear RGB: what to multiply the path's throughput by. Not eval() / pdf in volumes
  float pdf = 0;           ///< per steradian: pdf(wi), for multiple importance sampling
};

}  // namespace farfield
