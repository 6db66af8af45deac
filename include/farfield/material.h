// SPDX-License-Identifier: Apache-2.0
// What a surface is made of, asked of the host: one function serves the bake and the close-ups (level 0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>

namespace farfield {

/// A place on a surface of the source.
struct MaterialQuery {
  uint32_t material = 0;      ///< id: the number that the source's faces carry
  uint32_t face = 0;          ///< number of the source's face, in the order in which the source has them
  glm::vec2 uv{0.0f};         ///< texture coordinates; v points down the image. NaN where the source has none
  glm::vec2 duv_dx{0.0f};     ///< the footprint: two half-axes, as vectors in uv, of the area that the answer is to be
  glm::vec2 duv_dy{0.0f};     ///< the mean of; both zero: the point itself
  glm::vec4 color{1.0f};      ///< vertex colour, linear RGBA, interpolated; white where the source has none
  bool opacity_only = false;  ///< nothing but `opacity` of the answer will be looked at: a ray wants to pass
};

/// What is there. Linear RGB, albedos in [0, 1]; what lies outside is clamped, NaN is 0.
struct MaterialSample {
  glm::vec3 diffuse{0.8f};       ///< albedo of diffuse reflection, of the light that the highlight leaves
  glm::vec3 specular{0.0f};      ///< reflectance at normal incidence (F0); 0: no highlight
  glm::vec3 transmission{0.0f};  ///< albedo of diffuse transmission; with `diffuse` above 1 both are scaled down
  float roughness = 1;           ///< of the highlight, perceptual as in glTF: GGX with alpha = roughness^2
  float opacity = 1;             ///< share of rays that meet the surface; the others pass as if it were not there
  glm::vec3 normal{0, 0, 1};     ///< in the tangent frame (along u, along -v, along the shading normal); any length
  glm::vec3 emission{0.0f};      ///< radiance that both sides emit, >= 0
};

/// The host's materials. Called from any thread, at the same time; the same query must get the same answer. Must not
/// throw.
using MaterialFunction = std::function<MaterialSample(const MaterialQuery&)>;

/// The same for many places in one call, for hosts to whom a call is dear: samples[i], as constructed, becomes the
/// answer to queries[i]. How a bake divides its questions into calls does not change with threads.
using MaterialBatchFunction = std::function<void(const MaterialQuery* queries, MaterialSample* samples, size_t count)>;

}  // namespace farfield
