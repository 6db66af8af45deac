// SPDX-License-Identifier: Apache-2.0
#include "prefilter/material_filter.h"

#include <algorithm>
#include <numeric>

#include "base/check.h"

namespace farfield {

FaceMaterial mix(const FaceMaterial& a, float factor_a, const FaceMaterial& b, float factor_b) {
  const auto mean = [&](auto FaceMaterial::*channel) { return a.*channel * factor_a + b.*channel * factor_b; };
  return {mean(&FaceMaterial::sggx),         mean(&FaceMaterial::diffuse),    mean(&FaceMaterial::specular),
          mean(&FaceMaterial::transmission), mean(&FaceMaterial::roughness2), mean(&FaceMaterial::shading_sggx),
          mean(&FaceMaterial::opacity),      mean(&FaceMaterial::emission),   mean(&FaceMaterial::gap),
          mean(&FaceMaterial::sheet)};
}

void filter_materials(std::span<const double> area_before, std::span<const double> area_after,
                      std::span<FaceMaterial> materials) {
  FARFIELD_ASSERT(area_before.size() == materials.size() && area_after.size() == materials.size());
  const double total_before = std::accumulate(area_before.begin(), area_before.end(), 0.0);
  const double total_after = std::accumulate(area_after.begin(), area_after.end(), 0.0);
  if (!(total_before > 0) || !(total_after > 0)) return;
  const auto loss = [&](size_t i) { return area_before[i] / total_before - area_after[i] / total_after; };

  double total_loss = 0;
  for (size_t i = 0; i < materials.size(); ++i) total_loss += std::max(loss(i), 0.0);
  if (total_loss < 1e-12) return;

  // Eq. 8.3.8: what the shrinking faces lose, the growing ones take, each in the same mixture.
  FaceMaterial lost = mix(materials[0], 0.0f, materials[0], 0.0f);
  for (size_t i = 0; i < materials.size(); ++i) {
    if (loss(i) > 0) lost = mix(lost, 1.0f, materials[i], static_cast<float>(loss(i) / total_loss));
  }
  for (size_t i = 0; i < materials.size(); ++i) {
    if (!(loss(i) < 0)) continue;
    const float own = static_cast<float>((area_before[i] / total_before) / (area_after[i] / total_after));
    materials[i] = mix(materials[i], own, lost, 1.0f - own);
  }
}

}  // namespace farfield
