// SPDX-License-Identifier: Apache-2.0
#include "prefilter/seen_sums.h"

#include "prefilter/density.h"
#include "scattering/normal_moments.h"

namespace farfield {
namespace {

std::array<float, 6> entries_of(const SymMat3& s) { return {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}; }

void add(std::array<FixedSum, 3>& sums, const vec3& color) {
  for (int i = 0; i < 3; ++i) sums[static_cast<size_t>(i)].add(static_cast<double>(color[i]));
}

/// R_G(S), the mean of sigma over directions: the slope of the opacity of a very thin medium.
double mean_sigma(const SymMat3& s) { return mean_opacity(s, 1e-9, 1) / 1e-9; }

}  // namespace

void SeenSums::add_hit(const FaceMaterial& m) {
  hits_.add(1);
  const auto sggx = entries_of(m.flake_normals());
  for (size_t i = 0; i < sggx.size(); ++i) sggx_[i].add(static_cast<double>(sggx[i]));
  add(diffuse_, m.diffuse);
  add(specular_, m.specular);
  add(transmission_, m.transmission);
  const double weight = static_cast<double>(component_sum(m.specular));
  specular_weight_.add(weight);
  weighted_roughness2_.add(weight * static_cast<double>(m.roughness2));
}

void SeenSums::apply(double prior, Voxel& voxel) const {
  const double all = hits() + prior;
  const auto mixed = [&](float own, const FixedSum& sum) {
    return static_cast<float>((prior * static_cast<double>(own) + sum.value()) / all);
  };
  const auto mix = [&](const std::array<FixedSum, 3>& sums, vec3& color) {
    color = {mixed(color.x, sums[0]), mixed(color.y, sums[1]), mixed(color.z, sums[2])};
  };
  const double own_weight = prior * static_cast<double>(component_sum(voxel.specular));
  if (const double weight = specular_weight_.value() + own_weight; weight > 0) {
    voxel.roughness2 = static_cast<float>(
        (weighted_roughness2_.value() + own_weight * static_cast<double>(voxel.roughness2)) / weight);
  }
  mix(diffuse_, voxel.diffuse);
  mix(specular_, voxel.specular);
  mix(transmission_, voxel.transmission);

  const double before = mean_sigma(voxel.sggx);
  const SymMat3 own = normal_moments(voxel.sggx);
  const SymMat3 seen{mixed(own.xx, sggx_[0]), mixed(own.yy, sggx_[1]), mixed(own.zz, sggx_[2]),
                     mixed(own.xy, sggx_[3]), mixed(own.xz, sggx_[4]), mixed(own.yz, sggx_[5])};
  voxel.sggx = sggx_of_moments(seen);
  voxel.density *= static_cast<float>(before / mean_sigma(voxel.sggx));
}

}  // namespace farfield
