// SPDX-License-Identifier: Apache-2.0
#include "scattering/sggx.h"

#include <gtest/gtest.h>

#include "scattering/carlson.h"
#include "tests/support/statistics.h"

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
    ChiSquareOptions options;
    options.samples = 1000000, options.bins = 4, options.nodes_per_bin = 48;  // few cells see small errors best
    const double norm = 4 * kPiOf<double> * mean_sigma(s.sggx);
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(sggx.sample_sigma(r)); },
                                 [&](const dvec3& w) { return sggx.sigma(vec3(w)) / norm; }, options),
              kSignificance)
        << s.name;
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(sggx.sample_normal(r)); },
                                 [&](const dvec3& m) { return sggx.ndf(vec3(m)) * kPiOf<double> / norm; }, options),
              kSignificance)
        << s.name;
  }
}

// Directly over the sphere of normals, which for ratios of eigenvalues up to 10 converges to rounding.
TEST(Sggx, DistributionAndSigmaMeetTheirIntegrals) {
  Rng rng(4);
  for (const dvec3& l : {dvec3(1, 1, 1), dvec3(1, 0.4, 0.1), dvec3(1, 0.1, 0.1), dvec3(1, 1, 0.1)}) {
    const BasicFrame<double> frame(random_direction(rng));
    const Sggxd sggx(cholesky<double>(entries_from_axes(l, frame.x, frame.y, frame.z)));
    const double norm = 4 * carlson_rg(l.x, l.y, l.z);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& m) { return sggx.ndf(m); }, 64), norm, 1e-12 * norm);
    const dvec3 w = random_direction(rng);
    const double area =
        integrate_sphere([&](const dvec3& m) { return sggx.ndf(m) * std::max(0.0, glm::dot(m, w)); }, 64, w);
    EXPECT_NEAR(area, sggx.sigma(w), 1e-12);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& m) { return sggx.visible_pdf(w, m); }, 64, w), 1, 1e-12);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& v) { return sggx.sigma(v); }, 64), kPiOf<double> * norm, 1e-11);
    // The specular phase function over wi = over the normals, dwi = 4 (wo.m) dm.
    const double phase = integrate_sphere(
        [&](const dvec3& m) {
          const double c = glm::dot(w, m);
          return c > 0 ? sggx.specular_phase(w, reflect_about(w, m)) * 4 * c : 0.0;
        },
        64, w);
    EXPECT_NEAR(phase, 1, 1e-9);  // |wo + wi|^2 < 1e-12 is cut out
  }
}

// Float against long double, down to needles and flat flakes with eigenvalues of 1e-8. The factor is computed from axes
// in double and rounded once: an error of 6e-8 sqrt(lambda_max) beside sqrt(lambda_min), four times in D.
TEST(Sggx, NeedlesAndFlatFlakesStayCorrectInFloat) {
  Rng rng(5);
  for (const double small : {1e-2, 1e-4, 1e-6, 1e-8}) {
    for (const dvec3& l : {dvec3(1, small, small), dvec3(1, 1, small), dvec3(1, std::sqrt(small), small)}) {
      double worst_ndf = 0, worst_sigma = 0;
      for (int i = 0; i < 200; ++i) {
        const BasicFrame<double> frame(random_direction(rng));
        const Sggx sggx(cholesky<float>(entries_from_axes(l, frame.x, frame.y, frame.z)));
        // A normal where D matters: drawn from D.
        const vec3 m = sggx.sample_normal(rng);
        long double exponent = 0, area = 0;
        const dvec3 md(m), w = random_direction(rng);
        const dvec3 axes[3] = {frame.x, frame.y, frame.z};
        for (int k = 0; k < 3; ++k) {
          const long double c = glm::dot(md, axes[k]), d = glm::dot(w, axes[k]);
          exponent += c * c / l[k], area += d * d * l[k];
        }
        const long double det = l.x * l.y * l.z;
        const long double ndf = 1 / (kPiOf<long double> * std::sqrt(det) * exponent * exponent);
        worst_ndf = std::max(worst_ndf, double(std::abs(sggx.ndf(m) / ndf - 1)));
        worst_sigma = std::max(worst_sigma, double(std::abs(sggx.sigma(vec3(w)) - std::sqrt(area))));
      }
      EXPECT_LT(worst_ndf, 2e-6 / std::sqrt(small)) << l.y << ' ' << l.z;
      EXPECT_LT(worst_sigma, 4e-7) << l.y << ' ' << l.z;
    }
  }
}

// Peaks that no grid over the sphere resolves become uniform in the unit sphere's space: N = B^-1 m / |B^-1 m| of a
// visible normal is a cosine lobe about B^T wo.
TEST(Sggx, VisibleNormalsOfNeedlesFollowTheirDensity) {
  Rng rng(6);
  for (const dvec3& l : {dvec3(1, 1e-4, 1e-4), dvec3(1, 1, 1e-4), dvec3(1, 1e-2, 1e-4), dvec3(1, 1e-6, 1e-6)}) {
    const BasicFrame<double> frame(random_direction(rng));
    const CholeskyFactor<float> b = cholesky<float>(entries_from_axes(l, frame.x, frame.y, frame.z));
    const Sggx sggx(b);
    const vec3 wo(random_direction(rng));
    const dvec3 axis = glm::normalize(dvec3(b.transposed_times(wo)));
    ChiSquareOptions options;
    options.axis = axis;
    EXPECT_GT(chi_square_p_value(
                  [&](Rng& r) { return glm::normalize(dvec3(b.solve(sggx.sample_visible(wo, r.next(), r.next())))); },
                  [&](const dvec3& n) { return std::max(0.0, glm::dot(n, axis)) / kPiOf<double>; }, options),
              kSignificance)
        << l.y << ' ' << l.z;
  }
}

TEST(Sggx, EverythingIsFiniteForEverySemidefiniteMatrix) {
  Rng rng(7);
  const vec3 directions[] = {
      {0, 0, 1}, {1, 0, 0}, {0, -1, 0}, glm::normalize(vec3(1, 0, 1e-6f)), glm::normalize(vec3(0.2f, -0.3f, 0.7f))};
  for (const dvec3& l :
       {dvec3(1, 1, 1), dvec3(1, 1e-4, 1e-8), dvec3(1, 0, 0), dvec3(1, 1, 0), dvec3(1e-8, 1e-8, 1e-8)}) {
    for (int i = 0; i < 20; ++i) {
      const Sggx sggx(sggx_from(l, i == 0 ? dvec3(0, 0, 1) : random_direction(rng)));
      for (const vec3& wo : directions) {
        ASSERT_TRUE(std::isfinite(sggx.sigma(wo)) && sggx.sigma(wo) >= 0);
        ASSERT_TRUE(std::isfinite(sggx.ndf(wo)) && sggx.ndf(wo) >= 0);
        const vec3 m = sggx.sample_visible(wo, rng.next(), rng.next());
        ASSERT_NEAR(glm::length(m), 1, 1e-5);
        ASSERT_GT(glm::dot(m, wo), -1e-5);
        ASSERT_NEAR(glm::length(sggx.sample_sigma(rng)), 1, 1e-5);
        ASSERT_NEAR(glm::length(sggx.sample_normal(rng)), 1, 1e-5);
        for (const vec3& wi : {-wo, wo, directions[4]}) {
          ASSERT_TRUE(std::isfinite(sggx.specular_phase(wo, wi)) && sggx.specular_phase(wo, wi) >= 0);
          ASSERT_TRUE(std::isfinite(sggx.visible_pdf(wo, wi)));
        }
        ASSERT_EQ(sggx.specular_phase(wo, -wo), 0);
      }
    }
  }
}

TEST(Sggx, ScalingsConvertIntoEachOther) {
  for (const dvec3& l : {dvec3(1, 1, 1), dvec3(1, 1, 0), dvec3(1, 0, 0)}) {
    const double mean = carlson_rg(l.x, l.y, l.z);
    EXPECT_NEAR(normalised_rho(1.0, mean), l.z > 0 ? 4 : l.y > 0 ? kPiOf<double> : 2, 1e-14);
    EXPECT_NEAR(sggx_rho(normalised_rho(3.0, mean), mean), 3, 1e-14);
  }
  EXPECT_EQ(sggx_rho(1.0, 0.0), 0);
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
