// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/sggx_filter.h"

#include "scattering/carlson.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

double mean_sigma(const SymMat3& s) {
  const dvec3 l = eigenvalues(s);
  return carlson_rg(l.x, l.y, l.z);
}

}  // namespace

void SggxAverage::add(const SggxFlakes& flakes, float weight) {
  weight_ += weight;
  const NormalisedSggx s = normalise_sggx(flakes.sggx);
  const float rho = flakes.rho * s.rho_factor;
  if (!(rho > 0) || !(weight > 0)) return;
  weighted_ += s.sggx * (rho * weight);
  extinction_ += static_cast<double>(weight) * rho * mean_sigma(s.sggx);
}

SggxFlakes SggxAverage::result() const {
  const NormalisedSggx s = normalise_sggx(weighted_);
  if (!(s.rho_factor > 0)) return {};
  return {s.sggx, static_cast<float>(extinction_ / (weight_ * mean_sigma(s.sggx)))};
}

SggxFlakes lerp(const SggxFlakes& a, const SggxFlakes& b, float t) {
  SggxAverage average;
  average.add(a, 1.0f - t);
  average.add(b, t);
  return average.result();
}

}  // namespace farfield
