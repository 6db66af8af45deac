// SPDX-License-Identifier: Apache-2.0
#include "scattering/sggx.h"

#include <gtest/gtest.h>

#include "scattering/carlson.h"
#include "statistics.h"

namespace farfield {
namespace {

using namespace test;
using Sggxd = BasicSggx<double>;

double mean_sigma(const SymMat3& s) {
  const dvec3 l = eigenvalues(s);
  return carlson_rg(l.x, l.y, l.z);
}

TEST(Sggx, FactorReproducesTheMatrix) {
  for (const NamedSggx& s : sample_sggx()) {
    const Sggxd sggx(s.sggx);
    Rng rng(1);
    for (int i = 0; i < 20; ++i) {
      const dvec3 w = random_direction(rng);
      const double expected = std::max(0.0, double(glm::dot(w, glm::dmat3(s.sggx.to_mat3()) * w)));
      EXPECT_NEAR(std::pow(sggx.sigma(w), 2), expected, 2e-7 * s.sggx.trace()) << s.name;
    }
  }
}

TEST(Sggx, VisibleNormalsFollowTheirDensity) {
  Rng rng(2);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;  // peaks that a grid does not resolve: see the reflected ones
    const Sggx sggx(s.sggx);
    const vec3 wo(random_direction(rng));
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(sggx.sample_visible(wo, r.next(), r.next())); },
                                 [&](const dvec3& m) { return double(sggx.visible_pdf(wo, vec3(m))); }),
              kSignificance)
        << s.name;
  }
}

TEST(Sggx, SigmaAndNormalSamplersFollowTheirDensities) {
  for (const NamedSggx& s : sample_sggx()) {
    const Sggx sggx(s.sggx);
    const double norm = 4 * kPiOf<double> * mean_sigma(s.sggx);
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(sggx.sample_sigma(r)); },
                                 [&](const dvec3& w) { return sggx.sigma(vec3(w)) / norm; }),
              kSignificance)
        << s.name;
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(sggx.sample_normal(r)); },
                                 [&](const dvec3& m) { return sggx.ndf(vec3(m)) * kPiOf<double> / norm; }),
              kSignificance)
        << s.name;
  }
}

TEST(Sggx, EmptyMatrixHasNoFlakes) {
  const Sggx sggx(SymMat3{});
  EXPECT_TRUE(sggx.is_empty());
  EXPECT_EQ(sggx.sigma(vec3(0, 0, 1)), 0);
}

TEST(Sggx, EigenvaluesAreThoseItWasMadeFrom) {
  Rng rng(3);
  for (const dvec3& l : {dvec3(1, 1, 1), dvec3(1, 0.5, 0.2), dvec3(1, 1, 0), dvec3(1, 0, 0), dvec3(3, 1e-3, 1e-6)}) {
    const BasicFrame<double> frame(random_direction(rng));
    const dvec3 found = eigenvalues(entries_from_axes(l, frame.x, frame.y, frame.z));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], l[i], 2e-8 * l.x);
  }
}

TEST(Sggx, NormalisingKeepsTheAttenuation) {
  for (const NamedSggx& s : sample_sggx()) {
    const NormalisedSggx n = normalise_sggx(s.sggx);
    EXPECT_NEAR(eigenvalues(n.sggx).x, 1, 1e-6);
    const vec3 w = glm::normalize(vec3(1, 2, -1));
    EXPECT_NEAR(Sggx(n.sggx).sigma(w) * n.rho_factor / Sggx(s.sggx).sigma(w), 1, 1e-5) << s.name;
  }
  EXPECT_EQ(normalise_sggx(SymMat3{}).rho_factor, 0);
}

}  // namespace
}  // namespace farfield
