// SPDX-License-Identifier: Apache-2.0
#include "prefilter/layers.h"

#include "scattering/sggx.h"

namespace farfield {

dvec3 eigenvalues_of(const glm::dmat3& m) {
  return eigenvalues(SymEntries{m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]});
}

std::optional<dvec3> eigenvector(const glm::dmat3& m, double eigenvalue) {
  const glm::dmat3 rest = m - glm::dmat3(eigenvalue);
  dvec3 longest(0.0);
  for (int i = 0; i < 3; ++i) {
    const dvec3 candidate = glm::cross(rest[i], rest[(i + 1) % 3]);
    if (glm::dot(candidate, candidate) > glm::dot(longest, longest)) longest = candidate;
  }
  const double length = glm::length(longest);
  if (!(length > 0)) return {};
  return longest / length;
}

}  // namespace farfield
