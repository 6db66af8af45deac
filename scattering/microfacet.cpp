// SPDX-License-Identifier: Apache-2.0
#include "scattering/microfacet.h"

namespace farfield {

template <typename T>
BasicMicrofacets<T>::BasicMicrofacets(const SymMat3& s, const Vec3<T>& n) {
  const dvec3 nd(n);
  SymEntries e = entries(s);
  const double trace = e.xx + e.yy + e.zz;
  const bool usable = trace > 0 && std::isfinite(trace) && std::isfinite(e.xy + e.xz + e.yz);
  if (!usable) e = {};
  const double upright = e.xx * nd.x * nd.x + e.yy * nd.y * nd.y + e.zz * nd.z * nd.z +
                         2 * (e.xy * nd.x * nd.y + e.xz * nd.x * nd.z + e.yz * nd.y * nd.z);
  const double missing = usable ? std::max(0.0, kSmallestUprightShare * trace - upright) : 1.0;
  e.xx += missing * nd.x * nd.x, e.yy += missing * nd.y * nd.y, e.zz += missing * nd.z * nd.z;
  e.xy += missing * nd.x * nd.y, e.xz += missing * nd.x * nd.z, e.yz += missing * nd.y * nd.z;

  const CholeskyFactor<double> b = cholesky<double>(e);
  const double scale = 1 / glm::length(b.transposed_times(nd));
  b_ = {T(b.xx * scale), T(b.yx * scale), T(b.yy * scale), T(b.zx * scale), T(b.zy * scale), T(b.zz * scale)};
  upright_ = glm::normalize(b_.transposed_times(n));
}

template class BasicMicrofacets<float>;
template class BasicMicrofacets<double>;

}  // namespace farfield
