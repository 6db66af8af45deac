// SPDX-License-Identifier: Apache-2.0
// From a metallic-roughness material and what its maps say at a place, or on average over one, to how it reflects
// (docs/decisions/0006). The bake and close-ups both go through here, so they agree.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/surface_material.h"
#include "base/vec.h"
#include "farfield/material.h"

namespace farfield {

/// What a material's maps say, each mean weighted by alpha where there is alpha. Without the factors of the material
/// and the vertex colour, which come in afterwards. The defaults are those of a material without maps.
struct MapMeans {
  vec3 dielectric{1.0f};  ///< base colour times (1 - metallic)
  vec3 metal{0.0f};       ///< base colour times metallic
  float metallic = 0;
  float roughness2 = 1;  ///< roughness^4, which is alpha^2 of GGX
  float opacity = 1;     ///< coverage by mask, or alpha; the material's own alpha included
  vec3 emission{1.0f};   ///< of the emission map
  vec3 normal{0, 0, 1};  ///< mean of unit normals in the tangent frame: shorter where they spread
};

/// Whether texture coordinates can be used: finite, and not so large that float has no texels there any more.
inline bool is_usable_uv(const vec2& uv) {
  constexpr float kLargest = 1e6f;
  return std::abs(uv.x) <= kLargest && std::abs(uv.y) <= kLargest;  // false for NaN
}

/// What a texel of a normal map means, in the tangent frame; of any length.
inline vec3 mapped_normal(const vec3& texel, float scale) { return (2.0f * texel - 1.0f) * vec3(scale, scale, 1); }

/// The roughness2 of a GGX lobe that spreads as far as normals do of whose second moment (trace 1) a share of `aside`
/// lies along each of the two axes beside their mean; in [0, 1/2).
inline float roughness2_of_spread(float aside) { return aside / (1 - 2 * aside); }

/// The means of a material whose maps are missing or not looked at.
inline MapMeans means_without_maps(const MaterialFactors& material, float vertex_alpha = 1) {
  MapMeans means;
  means.dielectric = vec3(1 - material.metallic);
  means.metal = vec3(material.metallic);
  means.metallic = material.metallic;
  means.roughness2 = std::pow(material.roughness, 4.0f);
  const float alpha = material.alpha * vertex_alpha;
  if (material.alpha_mode == AlphaMode::Mask) means.opacity = alpha >= material.alpha_cutoff ? 1.0f : 0.0f;
  if (material.alpha_mode == AlphaMode::Blend) means.opacity = std::clamp(alpha, 0.0f, 1.0f);
  return means;
}

/// `color`: the mean vertex colour, linear. Diffuse and transmission are of the light that the specular lobe leaves
/// (scattering/surface_bsdf.h), so their own sum is at most 1. Beside metal, which shares that lobe, the dielectric
/// part keeps what glTF gives it.
inline MaterialSample material_sample(const MaterialFactors& material, const MapMeans& means, const vec3& color) {
  const vec3 base = glm::clamp(material.base_color * color, vec3(0.0f), vec3(1.0f));
  MaterialSample out;
  out.specular = glm::clamp(material.dielectric_f0 * (1 - means.metallic) + base * means.metal, vec3(0.0f), vec3(1.0f));
  const vec3 left = glm::max(1.0f - out.specular, vec3(1e-6f));
  const vec3 share = glm::clamp(1.0f - material.dielectric_f0, vec3(0.0f), vec3(1.0f)) / left;
  const float through = material.diffuse_transmission;
  out.diffuse = glm::min(base * means.dielectric * (1 - through) * share, vec3(1.0f));
  out.transmission =
      glm::min(material.diffuse_transmission_color * (through * (1 - means.metallic)) * share, 1.0f - out.diffuse);
  out.roughness = std::sqrt(std::sqrt(std::clamp(means.roughness2, 0.0f, 1.0f)));
  out.opacity = std::clamp(means.opacity, 0.0f, 1.0f);
  out.emission = glm::max(material.emission * means.emission, vec3(0.0f));
  out.normal = means.normal;
  if (material.thin_transmission > 0) {
    // A pane: of what does not reflect at its two sides a share goes on as if it were not there; rays have no colour,
    // so it goes as grey. What does not pass reflects as much more as fewer rays meet it.
    const vec3 passes = vec3(material.thin_transmission) * glm::max(1.0f - 2.0f * out.specular, vec3(0.0f)) * base;
    const float pane = std::max(1 - (passes.x + passes.y + passes.z) / 3, 1e-3f);
    out.diffuse = glm::min(out.diffuse * ((1 - material.thin_transmission) / pane), vec3(1.0f));
    out.specular = glm::min(2.0f * out.specular / pane, vec3(1.0f));
    out.opacity *= pane;
  }
  return out;
}

/// What a host's function answered, within its ranges: albedos in [0, 1], NaN is 0, no negative light.
inline MaterialSample in_range(MaterialSample sample) {
  const auto clean = [](float x, float most) {
    return x > 0 ? std::min(x, most) : 0.0f;
  };  // NaN fails every comparison
  const auto clean_color = [&](const vec3& c, float most) {
    return vec3(clean(c.x, most), clean(c.y, most), clean(c.z, most));
  };
  sample.diffuse = clean_color(sample.diffuse, 1);
  sample.specular = clean_color(sample.specular, 1);
  sample.transmission = clean_color(sample.transmission, 1);
  sample.roughness = clean(sample.roughness, 1);
  sample.opacity = clean(sample.opacity, 1);
  sample.emission = clean_color(sample.emission, 1e30f);
  if (!is_finite(sample.normal)) sample.normal = {0, 0, 1};
  return sample;
}

}  // namespace farfield
