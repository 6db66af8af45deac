// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/trig_lobe.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;
using Lobed = BasicTrigLobe<double>;

constexpr LobeKind kKinds[] = {LobeKind::Cosine, LobeKind::Sine};
const char* name_of(LobeKind kind) { return kind == LobeKind::Cosine ? "cos" : "sin"; }

/// PSD with eigenvalues in (0, 1].
SymMat3 random_shadowing(Rng& rng) {
  return sggx_from({1, 0.01 + 0.99 * rng.next(), 0.01 + 0.99 * rng.next()}, random_direction(rng));
}

double quadratic(const SymMat3& s, const dvec3& w) { return glm::dot(w, glm::dmat3(s.to_mat3()) * w); }

TEST(TrigLobe, FirstCoefficientsAreTheExactFractions) {
  const LobeCoefficients& c = lobe_coefficients(LobeKind::Cosine, 1);
  EXPECT_DOUBLE_EQ(c.sigma[0], 3.0 / 16);
  EXPECT_DOUBLE_EQ(c.sigma[1], 3.0 / 16);
  EXPECT_DOUBLE_EQ(c.shadow_w[0], 1.0 / 32);
  EXPECT_DOUBLE_EQ(c.shadow_axis[0], 1.0 / 16);
  EXPECT_DOUBLE_EQ(c.shadow_trace[0], 1.0 / 32);
  EXPECT_DOUBLE_EQ(c.shadow_w[1], 1.0 / 32);
  EXPECT_DOUBLE_EQ(c.shadow_axis[1], 0.0);
  EXPECT_DOUBLE_EQ(c.shadow_trace[1], 3.0 / 32);
  EXPECT_DOUBLE_EQ(c.shadow_cross[0], -1.0 / 8);
  const LobeCoefficients& s = lobe_coefficients(LobeKind::Sine, 1);
  EXPECT_DOUBLE_EQ(s.sigma[0], 9.0 / 32);
  EXPECT_DOUBLE_EQ(s.sigma[1], -3.0 / 32);
  EXPECT_DOUBLE_EQ(s.shadow_w[0], -1.0 / 64);
  EXPECT_DOUBLE_EQ(s.shadow_axis[0], -1.0 / 32);
  EXPECT_DOUBLE_EQ(s.shadow_trace[0], 7.0 / 64);
  EXPECT_DOUBLE_EQ(s.shadow_w[1], -1.0 / 64);
  EXPECT_DOUBLE_EQ(s.shadow_trace[1], -3.0 / 64);
  EXPECT_DOUBLE_EQ(s.shadow_cross[0], 1.0 / 16);
}

// C1[j] = K1 (-1)^(j+1) binom(n, j) / (2j - 1): an independent closed form for every n.
TEST(TrigLobe, CosineCoefficientsMeetTheirBinomialForm) {
  for (int n = 1; n <= kLargestLobeExponent; ++n) {
    const LobeCoefficients& c = lobe_coefficients(LobeKind::Cosine, n);
    double binomial = 1;
    for (int j = 0; j <= n; ++j) {
      const double expected = c.sigma[0] * (j % 2 ? 1 : -1) * binomial / (2 * j - 1);
      EXPECT_NEAR(c.sigma[j], expected, 1e-13 * std::abs(expected)) << n << ' ' << j;
      binomial *= double(n - j) / (j + 1);
    }
  }
}

TEST(TrigLobe, DistributionIsNormalisedAndEven) {
  Rng rng(1);
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      const dvec3 axis = random_direction(rng), m = random_direction(rng);
      const Lobed lobe(kind, n, axis);
      EXPECT_NEAR(integrate_sphere([&](const dvec3& w) { return lobe.ndf(w); }, 24, random_direction(rng)), 1, 1e-12)
          << name_of(kind) << n;
      EXPECT_EQ(lobe.ndf(m), lobe.ndf(-m));
    }
  }
}

// Closed forms against quadrature over the normals; <w.m> has its kink on the equator about w, where the rule is split.
// D <w.m> is a polynomial of degree 2n + 1 on each half and w'^T S w' of degree 4: 32 nodes are exact.
TEST(TrigLobe, SigmaIsItsIntegral) {
  Rng rng(2);
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      const Lobed lobe(kind, n, random_direction(rng));
      for (const dvec3& w : {random_direction(rng), lobe.axis(), BasicFrame<double>(lobe.axis()).x, -lobe.axis()}) {
        const double exact =
            integrate_sphere([&](const dvec3& m) { return lobe.ndf(m) * std::max(0.0, glm::dot(w, m)); }, 32, w);
        EXPECT_NEAR(lobe.sigma(w), exact, 1e-12 * exact) << name_of(kind) << n;
      }
    }
  }
}

TEST(TrigLobe, ShadowedSigmaIsItsIntegral) {
  Rng rng(3);
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      const Lobed lobe(kind, n, random_direction(rng));
      const SymMat3 s = random_shadowing(rng);
      for (const dvec3& w : {random_direction(rng), lobe.axis(), BasicFrame<double>(lobe.axis()).y}) {
        const double exact = integrate_sphere(
            [&](const dvec3& m) {
              return lobe.ndf(m) * std::max(0.0, glm::dot(w, m)) * quadratic(s, reflect_about(w, m));
            },
            32, w);
        EXPECT_NEAR(lobe.shadowed_sigma(w, s), exact, 1e-12 * std::max(exact, 0.1)) << name_of(kind) << n;
      }
    }
  }
}

TEST(TrigLobe, SingleAndMultipleSumToAll) {
  Rng rng(4);
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      const Lobed lobe(kind, n, random_direction(rng));
      const SymMat3 s = random_shadowing(rng), rest = SymMat3::identity() + s * -1.0f;
      const dvec3 w = random_direction(rng);
      // 1e-7: 1 - S in float.
      EXPECT_NEAR(lobe.shadowed_sigma(w, s) + lobe.shadowed_sigma(w, rest), lobe.sigma(w), 1e-7);
      EXPECT_NEAR(lobe.shadowed_sigma(w, SymMat3::identity()), lobe.sigma(w), 1e-12);
    }
  }
}

TEST(TrigLobe, SphereIntegralsAreThoseOfTheFunctions) {
  Rng rng(5);
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      const Lobed lobe(kind, n, random_direction(rng));
      const SymMat3 s = random_shadowing(rng), r = random_shadowing(rng);
      const double sigma = integrate_sphere([&](const dvec3& w) { return quadratic(s, w) * lobe.sigma(w); }, 32);
      const double shadowed =
          integrate_sphere([&](const dvec3& w) { return quadratic(s, w) * lobe.shadowed_sigma(w, r); }, 32);
      EXPECT_NEAR(lobe.integral_sigma(s), sigma, 2e-12 * sigma) << name_of(kind) << n;
      EXPECT_NEAR(lobe.integral_shadowed(s, r), shadowed, 2e-12 * shadowed) << name_of(kind) << n;
      EXPECT_NEAR(lobe.integral_shadowed(s, r), lobe.integral_shadowed(r, s), 1e-12);
      EXPECT_NEAR(lobe.integral_shadowed(s, SymMat3::identity()), lobe.integral_sigma(s), 1e-12);
    }
  }
}

// A sine lobe is the mean of n + 1 equally spaced cosine lobes across its axis: the two kinds prove each other.
TEST(TrigLobe, SineLobeIsTheMeanOfCosineLobesAcross) {
  Rng rng(6);
  for (int n = 1; n <= kLargestLobeExponent; ++n) {
    const dvec3 axis = random_direction(rng), w = random_direction(rng);
    const BasicFrame<double> frame(axis);
    const SymMat3 s = random_shadowing(rng);
    double sigma = 0, shadowed = 0;
    for (int i = 0; i <= n; ++i) {
      const double angle = kPiOf<double> * i / (n + 1);
      const Lobed cosine(LobeKind::Cosine, n, std::cos(angle) * frame.x + std::sin(angle) * frame.y);
      sigma += cosine.sigma(w) / (n + 1), shadowed += cosine.shadowed_sigma(w, s) / (n + 1);
    }
    const Lobed sine(LobeKind::Sine, n, axis);
    EXPECT_NEAR(sine.sigma(w), sigma, 1e-12) << n;
    EXPECT_NEAR(sine.shadowed_sigma(w, s), shadowed, 1e-12) << n;
  }
}

TEST(TrigLobe, FloatAgreesWithDouble) {
  Rng rng(7);
  double worst_sigma = 0, worst_shadowed = 0;
  for (const LobeKind kind : kKinds) {
    for (int n = 0; n <= kLargestLobeExponent; ++n) {
      for (int i = 0; i < 50; ++i) {
        const vec3 axis(random_direction(rng)), w(random_direction(rng));
        const SymMat3 s = random_shadowing(rng);
        const Lobed exact(kind, n, dvec3(axis));
        const TrigLobe lobe(kind, n, axis);
        worst_sigma = std::max(worst_sigma, std::abs(lobe.sigma(w) / exact.sigma(dvec3(w)) - 1));
        worst_shadowed =
            std::max(worst_shadowed, std::abs(lobe.shadowed_sigma(w, s) / exact.shadowed_sigma(dvec3(w), s) - 1));
      }
    }
  }
  EXPECT_LT(worst_sigma, 2e-6);
  EXPECT_LT(worst_shadowed, 5e-6);
}

TEST(TrigLobe, FloatSurvivesEveryDirection) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const TrigLobe lobe(LobeKind::Cosine, 20, {0, 0, 1});
  const Lobed exact(LobeKind::Cosine, 20, {0, 0, 1});
  EXPECT_NEAR(lobe.sigma({0, 0, 1}), exact.sigma({0, 0, 1}), 1e-6);
  EXPECT_NEAR(lobe.sigma({0, 0, -1.0000001f}), exact.sigma({0, 0, 1}), 1e-6);
  EXPECT_NEAR(lobe.sigma({1, 0, 0}), exact.sigma({1, 0, 0}), 1e-6);
  EXPECT_FALSE(lobe.sigma(vec3(nan)) < 0);
  EXPECT_FALSE(lobe.shadowed_sigma(vec3(nan), SymMat3::identity()) < 0);
}

TEST(TrigLobe, NormalsFollowTheDistribution) {
  Rng rng(8);
  for (const LobeKind kind : kKinds) {
    for (const int n : {0, 1, 2, 5, 20}) {
      const vec3 axis(random_direction(rng));
      const TrigLobe lobe(kind, n, axis);
      EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(lobe.sample_normal(r)); },
                                   [&](const dvec3& m) { return double(lobe.ndf(vec3(m))); }),
                kSignificance)
          << name_of(kind) << n;
    }
  }
}

TEST(TrigLobe, VisibleNormalsFollowTheirDensity) {
  Rng rng(9);
  for (const LobeKind kind : kKinds) {
    for (const int n : {0, 1, 2, 3, 7, 12, 20}) {
      const vec3 axis(random_direction(rng));
      const TrigLobe lobe(kind, n, axis);
      for (const vec3& w : {vec3(random_direction(rng)), axis, Frame(axis).x, -axis, vec3(random_direction(rng))}) {
        ChiSquareOptions options;
        options.axis = dvec3(w);
        EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(lobe.sample_visible(w, r)); },
                                     [&](const dvec3& m) {
                                       const float c = glm::dot(vec3(m), w);
                                       return c > 0 ? double(lobe.ndf(vec3(m)) * c / lobe.sigma(w)) : 0.0;
                                     },
                                     options),
                  kSignificance)
            << name_of(kind) << n;
      }
    }
  }
}

TEST(LobeMixture, WeightsSumToOneAndBadOnesAreDropped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const WeightedLobe<float> lobes[] = {{TrigLobe(LobeKind::Cosine, 3, {1, 0, 0}), 2.0f},
                                       {TrigLobe(), nan},
                                       {TrigLobe(), -1.0f},
                                       {TrigLobe(LobeKind::Sine, 4, {0, 1, 0}), 6.0f}};
  const LobeMixture mixture(lobes);
  ASSERT_EQ(mixture.lobes().size(), 2u);
  EXPECT_FLOAT_EQ(mixture.lobes()[0].weight, 0.25f);
  EXPECT_FLOAT_EQ(mixture.lobes()[1].weight, 0.75f);
  EXPECT_EQ(mixture.isotropic_weight(), 0);
  EXPECT_FLOAT_EQ(LobeMixture().ndf({0, 0, 1}), kInvPi / 4);
}

TEST(LobeMixture, SamplersFollowTheirDensities) {
  Rng rng(10);
  const WeightedLobe<float> lobes[] = {{TrigLobe(LobeKind::Cosine, 8, vec3(random_direction(rng))), 0.5f},
                                       {TrigLobe(LobeKind::Sine, 5, vec3(random_direction(rng))), 0.3f},
                                       {TrigLobe(), 0.2f}};
  const LobeMixture mixture(lobes);
  EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(mixture.sample_normal(r)); },
                               [&](const dvec3& m) { return double(mixture.ndf(vec3(m))); }),
            kSignificance);
  const vec3 w(random_direction(rng));
  ChiSquareOptions options;
  options.axis = dvec3(w);
  EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(mixture.sample_visible(w, r)); },
                               [&](const dvec3& m) {
                                 const float c = std::max(0.0f, glm::dot(vec3(m), w));
                                 return double(mixture.ndf(vec3(m)) * c / mixture.sigma(w));
                               },
                               options),
            kSignificance);
}

}  // namespace
}  // namespace farfield
