// SPDX-License-Identifier: Apache-2.0
#include "scattering/microfacet.h"

#include <gtest/gtest.h>

#include "scattering/fresnel.h"
#include "scattering/microfacet_brdf.h"
#include "tests/support/statistics.h"

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

/// Normal, lower half excluded: the integral of f over m.n > 0.
template <typename F>
double integrate_upper(const F& f, const dvec3& n, int count) {
  return integrate_sphere([&](const dvec3& m) { return glm::dot(m, n) > 0 ? f(m) : 0.0; }, count, n);
}

TEST(Microfacets, CoverTheirSurfaceOnce) {
  Rng rng(2);
  for (const dvec3& l : {dvec3(1, 1, 1), dvec3(1, 0.4, 0.1), dvec3(1, 0.1, 0.1), dvec3(1, 1, 0.1)}) {
    for (int i = 0; i < 5; ++i) {
      const dvec3 n = random_direction(rng);
      const Microfacetsd facets(sggx_from(l, random_direction(rng)), n);
      EXPECT_NEAR(integrate_upper([&](const dvec3& m) { return facets.ndf(m) * glm::dot(m, n); }, n, 96), 1, 1e-12);
    }
  }
}

// a(w) from its definition. Both m.n > 0 and m.w > 0 cut the sphere, so the rule converges slowly: the difference
// a(w) - a(-w) = w.S n, which has one cut only, is exact.
TEST(Microfacets, ProjectedAreaIsItsIntegral) {
  Rng rng(3);
  for (const dvec3& l : {dvec3(1, 1, 1), dvec3(1, 0.4, 0.1), dvec3(1, 0.1, 0.1), dvec3(1, 1, 0.1)}) {
    const dvec3 n = random_direction(rng), w = random_direction(rng);
    const Microfacetsd facets(sggx_from(l, random_direction(rng)), n);
    const double signed_area = integrate_upper([&](const dvec3& m) { return facets.ndf(m) * glm::dot(m, w); }, n, 96);
    EXPECT_NEAR(facets.projected_area(w) - facets.projected_area(-w), signed_area, 1e-12);
    const double area =
        integrate_upper([&](const dvec3& m) { return facets.ndf(m) * std::max(0.0, glm::dot(m, w)); }, n, 128);
    EXPECT_NEAR(area, facets.projected_area(w), 1e-3 * area);
  }
}

// The table of docs/theory.md, section 5: albedo with F = 1 and separable masking, for alpha, the tilt of the ellipsoid
// against n (degrees), and theta = 0, +70 (towards the tilt), -70. Two digits: 0.01 and 40000 samples' noise.
TEST(Microfacets, WhiteFurnaceLosesWhatTheReferenceLoses) {
  struct Row {
    float alpha;
    double tilt, expected[3];
  };
  const Row rows[] = {{0.1f, 0, {0.99, 0.94, 0.94}},  {0.1f, 5, {0.97, 0.99, 0.51}}, {0.1f, 15, {0.85, 0.99, 0.07}},
                      {0.1f, 30, {0.49, 0.98, 0.02}}, {0.5f, 0, {0.69, 0.71, 0.70}}, {0.5f, 5, {0.68, 0.75, 0.65}},
                      {0.5f, 15, {0.62, 0.79, 0.57}}, {0.5f, 30, {0.45, 0.77, 0.40}}};
  const dvec3 n(0, 0, 1);
  for (const Row& row : rows) {
    const double tilt = row.tilt * kPiOf<double> / 180;
    const Microfacetsd facets(ggx(vec3(dvec3(std::sin(tilt), 0, std::cos(tilt))), row.alpha, row.alpha), n);
    for (int k = 0; k < 3; ++k) {
      const double theta = (k == 0 ? 0 : k == 1 ? 70 : -70) * kPiOf<double> / 180;
      const dvec3 wo(std::sin(theta), 0, std::cos(theta));
      double sum = 0;
      constexpr int count = 200;
      for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) {
          const dvec3 wi = reflect_about(wo, facets.sample_visible(wo, (i + 0.5) / count, (j + 0.5) / count));
          if (wi.z <= 0) continue;
          sum += masking_weight<Masking::Separable>(wo.z, facets.projected_area(wo), wi.z, facets.projected_area(wi));
        }
      }
      EXPECT_NEAR(sum / (count * count), row.expected[k], 0.012) << row.alpha << ' ' << row.tilt << ' ' << k;
    }
  }
}

TEST(MicrofacetBrdf, IsReciprocalForBothMaskings) {
  Rng rng(5);
  const auto fresnel = [](double cos) { return double(fresnel_dielectric(float(cos), 1.5f)); };
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 n = random_direction(rng);
    const Microfacetsd facets(s.sggx, n);
    for (int i = 0; i < 20; ++i) {
      const dvec3 a = cosine_lobe(n, double(rng.next()), double(rng.next()));
      const dvec3 b = cosine_lobe(n, double(rng.next()), double(rng.next()));
      const double ca = glm::dot(a, n), cb = glm::dot(b, n);
      const double separable = eval_specular_facets<Masking::Separable>(facets, a, ca, b, cb, fresnel);
      const double correlated = eval_specular_facets<Masking::HeightCorrelated>(facets, a, ca, b, cb, fresnel);
      EXPECT_NEAR(separable * ca, (eval_specular_facets<Masking::Separable>(facets, b, cb, a, ca, fresnel) * cb),
                  1e-9 * (1 + separable));
      EXPECT_NEAR(correlated * ca,
                  (eval_specular_facets<Masking::HeightCorrelated>(facets, b, cb, a, ca, fresnel) * cb),
                  1e-9 * (1 + correlated));
      EXPECT_LE(separable, correlated * (1 + 1e-12));
    }
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
