// SPDX-License-Identifier: Apache-2.0
#include "scattering/microfacet.h"

#include <gtest/gtest.h>

#include "statistics.h"

namespace farfield {
namespace {

using namespace test;
using Microfacetsd = BasicMicrofacets<double>;

SymMat3 ggx(const vec3& n, float alpha_x, float alpha_y) {
  const Frame frame(n);
  return SymMat3::outer(frame.x) * (alpha_x * alpha_x) + SymMat3::outer(frame.y) * (alpha_y * alpha_y) +
         SymMat3::outer(n);
}

TEST(Microfacets, AlignedEllipsoidIsGgxWithSmithMasking) {
  const double alpha = 0.3, a2 = double(0.3f * 0.3f);
  const Microfacetsd facets(ggx({0, 0, 1}, 0.3f, 0.3f), dvec3(0, 0, 1));
  Rng rng(1);
  for (int i = 0; i < 100; ++i) {
    dvec3 m = random_direction(rng);
    m.z = std::abs(m.z);
    const double c2 = m.z * m.z, d = c2 * (a2 - 1) + 1;
    EXPECT_NEAR(facets.ndf(m), a2 / (kPiOf<double> * d * d), 1e-6 * facets.ndf(m));
    const double tan2 = (1 - c2) / c2;
    const double smith = 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
    EXPECT_NEAR(m.z / facets.projected_area(m), smith, 1e-6);
  }
}

TEST(Microfacets, ProjectedAreaIsItsIntegral) {
  Rng rng(2);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-2 * eigen.x) continue;
    const dvec3 n = random_direction(rng);
    const Microfacetsd facets(s.sggx, n);
    const auto upper = [&](const auto& f) {
      return integrate_sphere([&](const dvec3& m) { return glm::dot(m, n) > 0 ? facets.ndf(m) * f(m) : 0.0; }, 128, n);
    };
    EXPECT_NEAR(upper([&](const dvec3& m) { return glm::dot(m, n); }), 1, 1e-3) << s.name;
    const dvec3 w = random_direction(rng);
    EXPECT_NEAR(upper([&](const dvec3& m) { return std::max(0.0, glm::dot(m, w)); }), facets.projected_area(w),
                2e-3 * facets.projected_area(w))
        << s.name;
  }
}

TEST(Microfacets, VisibleFacetsFollowTheirDensity) {
  Rng rng(3);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;
    const vec3 n(random_direction(rng));
    const Microfacets facets(s.sggx, n);
    const vec3 w = cosine_lobe(n, rng.next(), rng.next());
    ChiSquareOptions options;
    options.axis = dvec3(n);
    EXPECT_GT(
        chi_square_p_value([&](Rng& r) { return dvec3(facets.sample_visible(w, r.next(), r.next())); },
                           [&](const dvec3& md) {
                             const vec3 m(md);
                             if (glm::dot(m, n) <= 0) return 0.0;
                             return double(facets.ndf(m) * std::max(0.0f, glm::dot(m, w)) / facets.projected_area(w));
                           },
                           options),
        kSignificance)
        << s.name;
  }
}

TEST(Microfacets, ScaleOfTheMatrixDoesNotMatter) {
  const vec3 n = glm::normalize(vec3(1, 1, 0.3f)), w = glm::normalize(vec3(1, 0.2f, 0.1f));
  const SymMat3 s = sggx_from({1, 0.3, 0.2}, {1, 0.4, 0});
  for (const float scale : {1e-30f, 1e-3f, 1e20f}) {
    EXPECT_NEAR(Microfacets(s * scale, n).projected_area(w) / Microfacets(s, n).projected_area(w), 1, 1e-5);
    EXPECT_NEAR(Microfacets(s * scale, n).ndf(w) / Microfacets(s, n).ndf(w), 1, 1e-4);
  }
}

TEST(MaskingWeight, NeverExceedsOneAndIsReciprocal) {
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) {
    const double ca = rng.next() + 1e-4, cb = rng.next() + 1e-4, aa = 2 * rng.next(), ab = 2 * rng.next();
    EXPECT_LE((masking_weight<Masking::HeightCorrelated>(ca, aa, cb, ab)), 1 + 1e-12);
    EXPECT_LE((masking_weight<Masking::Separable>(ca, aa, cb, ab)),
              (masking_weight<Masking::HeightCorrelated>(ca, aa, cb, ab)) + 1e-12);
    // G2 = weight G1u.
    EXPECT_NEAR((masking_weight<Masking::HeightCorrelated>(ca, aa, cb, ab)) * ca / aa,
                (masking_weight<Masking::HeightCorrelated>(cb, ab, ca, aa)) * cb / ab, 1e-9);
  }
}

}  // namespace
}  // namespace farfield
