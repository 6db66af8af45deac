// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/microflake_medium.h"

#include <gtest/gtest.h>

#include "scattering/carlson.h"
#include "scattering/media/lobe_fit.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;
using Mixtured = BasicLobeMixture<double>;
using Lobed = BasicTrigLobe<double>;

template <typename T>
BasicLobeMixture<T> random_mixture(Rng& rng) {
  const WeightedLobe<T> lobes[] = {
      {BasicTrigLobe<T>(LobeKind::Cosine, 1 + int(rng.next() * 20), Vec3<T>(random_direction(rng))), T(rng.next())},
      {BasicTrigLobe<T>(LobeKind::Sine, 1 + int(rng.next() * 20), Vec3<T>(random_direction(rng))), T(rng.next())},
      {BasicTrigLobe<T>(), T(rng.next())}};
  return BasicLobeMixture<T>(lobes);
}

SymMat3 random_shadowing(Rng& rng, double smallest) {
  return sggx_from({smallest + (1 - smallest) * rng.next(), smallest + (1 - smallest) * rng.next(),
                    smallest + (1 - smallest) * rng.next()},
                   random_direction(rng));
}

TEST(LobeMedium, PhaseFunctionsAreNormalised) {
  Rng rng(1);
  for (int i = 0; i < 10; ++i) {
    const BasicLobeMedium<double> medium(2.0, random_mixture<double>(rng), random_shadowing(rng, 0.05));
    const dvec3 wo = random_direction(rng);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& w) { return medium.multiple_phase(w); }, 40), 1, 1e-6);
    // f_ss over w' has its kinks in h; over the normals it is smooth: dw' = 4 (w.h) dh.
    const double single = integrate_sphere(
        [&](const dvec3& m) {
          const double c = glm::dot(wo, m);
          return c > 1e-6 ? medium.single_phase(wo, reflect_about(wo, m)) * 4 * c : 0.0;
        },
        40, wo);
    EXPECT_NEAR(single, 1, 1e-9);
  }
}

TEST(LobeMedium, EnergyBalances) {
  Rng rng(2);
  for (int i = 0; i < 100; ++i) {
    const BasicLobeMedium<double> medium(3.0, random_mixture<double>(rng), random_shadowing(rng, 1e-3));
    const dvec3 w = random_direction(rng);
    // 1e-6: I - S_A is in float.
    EXPECT_NEAR(medium.single(w) + medium.multiple(w), medium.extinction(w), 1e-6 * medium.extinction(w));
  }
}

TEST(LobeMedium, IsReciprocal) {
  Rng rng(3);
  for (int i = 0; i < 100; ++i) {
    MediumAlbedos albedos;
    albedos.single = vec3(0.9f, 0.1f, 0.0f), albedos.multiple = vec3(0.3f, 1.0f, 0.5f);
    const BasicLobeMedium<double> medium(3.0, random_mixture<double>(rng), random_shadowing(rng, 0.01), albedos);
    const dvec3 a = random_direction(rng), b = random_direction(rng);
    const dvec3 forth = medium.extinction(a) * medium.eval(a, b), back = medium.extinction(b) * medium.eval(b, a);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(forth[c], back[c], 1e-12 * (1 + forth[c]));
  }
}

TEST(LobeMedium, EventsFollowTheirDensity) {
  Rng rng(4);
  for (int i = 0; i < 12; ++i) {
    const LobeMedium medium(1.0f, random_mixture<float>(rng), random_shadowing(rng, i % 2 ? 0.02 : 0.5));
    const vec3 wo(random_direction(rng));
    ChiSquareOptions options;
    options.axis = -dvec3(wo);
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(medium.scatter(wo, r).wi); },
                                 [&](const dvec3& w) { return double(medium.pdf(wo, vec3(w))); }, options),
              kSignificance)
        << i;
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(medium.sample_multiple(r)); },
                                 [&](const dvec3& w) { return double(medium.multiple_phase(vec3(w))); }),
              kSignificance)
        << i;
  }
}

TEST(LobeMedium, SingleEventsComeAsOftenAsTheirCoefficientSays) {
  Rng rng(5);
  for (int i = 0; i < 10; ++i) {
    const LobeMedium medium(1.0f, random_mixture<float>(rng), random_shadowing(rng, 0.02));
    const vec3 wo(random_direction(rng));
    const int count = 20000;
    int singles = 0;
    for (int k = 0; k < count; ++k) singles += !medium.scatter(wo, rng).is_multiple;
    const double p = medium.single(wo) / medium.extinction(wo);
    EXPECT_NEAR(double(singles) / count, p, 5 * std::sqrt(p * (1 - p) / count) + 1e-9);
  }
}

TEST(LobeMedium, WhiteFurnaceIsExact) {
  Rng rng(6);
  for (int i = 0; i < 100; ++i) {
    const LobeMedium medium(1.0f, random_mixture<float>(rng), random_shadowing(rng, 1e-3));
    const MediumEvent event = medium.scatter(vec3(random_direction(rng)), rng);
    EXPECT_EQ(event.weight, vec3(1.0f));
    EXPECT_GT(event.pdf, 0);
  }
}

TEST(LobeMedium, WithoutShadowingItIsThePlainMicroflakeModel) {
  Rng rng(7);
  for (int i = 0; i < 20; ++i) {
    const Mixtured flakes = random_mixture<double>(rng);
    const BasicLobeMedium<double> shadowed(1.0, flakes, SymMat3::identity());
    const BasicLobeMedium<double> almost(1.0, flakes, SymMat3::identity() * 0.99999f);
    const BasicLobeMedium<double, false> plain(1.0, flakes, SymMat3::identity());
    const dvec3 a = random_direction(rng), b = random_direction(rng);
    EXPECT_NEAR(shadowed.extinction(a), plain.extinction(a), 1e-12);
    EXPECT_NEAR(shadowed.single_phase(a, b), plain.single_phase(a, b), 1e-12 * (1 + plain.single_phase(a, b)));
    EXPECT_EQ(shadowed.multiple(a), 0);
    EXPECT_EQ(shadowed.multiple_phase(a), 0);
    EXPECT_NEAR(shadowed.pdf(a, b), plain.pdf(a, b), 1e-12 * (1 + plain.pdf(a, b)));
    EXPECT_NEAR(almost.pdf(a, b), plain.pdf(a, b), 1e-4);
    EXPECT_TRUE(std::isfinite(almost.multiple_phase(a)));
  }
}

TEST(LobeMedium, IsotropicLimitsAreTheClosedForms) {
  Rng rng(8);
  const BasicLobeMedium<double> medium(8.0, Mixtured(), SymMat3::identity() * 0.25f);
  const dvec3 a = random_direction(rng), b = random_direction(rng);
  EXPECT_NEAR(medium.extinction(a), 8 * 0.25 / 4, 1e-12);
  EXPECT_NEAR(medium.single(a), 8 * 0.25 * 0.25 / 4, 1e-12);
  EXPECT_NEAR(medium.single_phase(a, b), 1 / (4 * kPiOf<double>), 1e-12);
  EXPECT_NEAR(medium.multiple_phase(b), 1 / (4 * kPiOf<double>), 1e-7);
}

TEST(SggxMedium, PhaseFunctionsAreNormalised) {
  Rng rng(9);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;
    const BasicSggxMedium<double> medium(1.0, s.sggx, 0.3);
    const dvec3 wo = random_direction(rng);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& w) { return medium.multiple_phase(w); }, 100), 1, 1e-6) << s.name;
    const double single = integrate_sphere(
        [&](const dvec3& m) {
          const double c = glm::dot(wo, m);
          return c > 1e-6 ? medium.single_phase(wo, reflect_about(wo, m)) * 4 * c : 0.0;
        },
        200, wo);
    EXPECT_NEAR(single, 1, 1e-6) << s.name;
  }
}

TEST(SggxMedium, IsReciprocalAndBalances) {
  Rng rng(10);
  for (const NamedSggx& s : sample_sggx()) {
    MediumAlbedos albedos;
    albedos.single = vec3(0.9f, 0.1f, 0.0f), albedos.multiple = vec3(0.3f, 1.0f, 0.5f);
    const BasicSggxMedium<double> medium(3.0, s.sggx, 0.4, albedos);
    const dvec3 a = random_direction(rng), b = random_direction(rng);
    const dvec3 forth = medium.extinction(a) * medium.eval(a, b), back = medium.extinction(b) * medium.eval(b, a);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(forth[c], back[c], 1e-9 * forth[c]) << s.name;
    EXPECT_NEAR(medium.single(a) + medium.multiple(a), medium.extinction(a), 1e-12 * medium.extinction(a));
  }
}

TEST(SggxMedium, EventsFollowTheirDensity) {
  Rng rng(11);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 eigen = eigenvalues(s.sggx);
    if (eigen.z < 1e-3 * eigen.x) continue;
    const SggxMedium medium(1.0f, s.sggx, 0.6f);
    const vec3 wo(random_direction(rng));
    ChiSquareOptions options;
    options.axis = -dvec3(wo);
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(medium.scatter(wo, r).wi); },
                                 [&](const dvec3& w) { return double(medium.pdf(wo, vec3(w))); }, options),
              kSignificance)
        << s.name;
  }
}

TEST(SggxMedium, WhiteFurnaceIsExactAndEmptyMediumHasNoEvents) {
  Rng rng(12);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float shadowing : {1.0f, 0.5f, 1e-3f}) {
      const SggxMedium medium(1.0f, s.sggx, shadowing);
      EXPECT_EQ(medium.scatter(vec3(random_direction(rng)), rng).weight, vec3(1.0f)) << s.name;
    }
  }
  const SggxMedium empty(1.0f, SymMat3{}, 0.5f);
  EXPECT_EQ(empty.scatter({0, 0, 1}, rng).weight, vec3(0.0f));
  EXPECT_EQ(empty.pdf({0, 0, 1}, {0, 1, 0}), 0);
  EXPECT_EQ(empty.extinction({0, 0, 1}), 0);
}

// Two independent routes: an SGGX medium and the lobes fitted to it, in attenuation and in scattering.
TEST(SggxMedium, AgreesWithFittedLobes) {
  Rng rng(13);
  for (const dvec3& eigen : {dvec3(1, 1, 1), dvec3(1, 0.25, 0.25), dvec3(1, 1, 0.1), dvec3(1, 0.5, 0.1)}) {
    const SymMat3 s = sggx_from(eigen, random_direction(rng));
    const LobeFit fit = fit_lobes(s);
    const SggxMedium sggx(2.0f, s, 0.5f);
    const LobeMedium lobes(2.0f * fit.rho_factor, fit.flakes, SymMat3::identity() * 0.5f);
    double phase_difference = 0;
    const int count = 2000;
    for (int i = 0; i < count; ++i) {
      const vec3 a(random_direction(rng)), b(random_direction(rng));
      EXPECT_NEAR(lobes.extinction(a) / sggx.extinction(a), 1, 0.06);
      EXPECT_NEAR(lobes.multiple_phase(a) / sggx.multiple_phase(a), 1, 0.06);
      phase_difference += std::abs(lobes.single_phase(a, b) - sggx.single_phase(a, b)) * 4 * kPi / count;
    }
    // The fit is to sigma, which smooths D: the phase functions agree less well.
    EXPECT_LT(phase_difference, 0.25) << eigen.y << ' ' << eigen.z;
  }
}

TEST(Medium, ExtremesAreFiniteAndNotNegative) {
  Rng rng(14);
  const vec3 directions[] = {
      {0, 0, 1}, {1, 0, 0}, {0, -1, 0}, glm::normalize(vec3(1, 0, 1e-6f)), glm::normalize(vec3(0.2f, -0.3f, 0.7f))};
  const auto check = [&](const auto& medium, const char* what) {
    for (const vec3& wo : directions) {
      for (const vec3& d : directions) {
        for (const vec3& wi : {d, -d}) {
          for (const float value : {medium.extinction(wo), medium.single(wo), medium.multiple(wo),
                                    medium.single_phase(wo, wi), medium.multiple_phase(wi), medium.pdf(wo, wi)}) {
            ASSERT_TRUE(std::isfinite(value) && value >= 0) << what << ' ' << value;
          }
          ASSERT_TRUE(is_finite(medium.eval(wo, wi)));
        }
      }
      const MediumEvent event = medium.scatter(wo, rng);
      ASSERT_TRUE(is_finite(event.wi) && is_finite(event.weight) && std::isfinite(event.pdf)) << what;
    }
  };
  for (const float rho : {0.0f, 1e-8f, 1.0f, 1e8f}) {
    for (const float shadowing : {1e-3f, 0.5f, 1.0f - 1e-7f, 1.0f}) {
      std::vector<SymMat3> matrices = {SymMat3{}, {1, 1e-4f, 1e-8f, 0, 0, 0}, {0, 0, 1, 0, 0, 0}};
      for (const NamedSggx& s : sample_sggx()) matrices.push_back(s.sggx);
      for (const SymMat3& s : matrices) check(SggxMedium(rho, s, shadowing), "SGGX");
      for (const int n : {1, 20}) {
        for (const LobeKind kind : {LobeKind::Cosine, LobeKind::Sine}) {
          const WeightedLobe<float> lobe[] = {{TrigLobe(kind, n, {0, 0, 1}), 1.0f}};
          check(LobeMedium(rho, LobeMixture(lobe), SymMat3::identity() * shadowing), "lobe");
          check(LobeMedium(rho, LobeMixture(lobe), {1, shadowing, shadowing, 0, 0, 0}), "lobe, anisotropic");
          check(LobeMedium(rho, LobeMixture(lobe), {shadowing, shadowing, 1, 0, 0, 0}), "lobe, anisotropic");
        }
      }
    }
  }
}

TEST(Medium, FlightsAndOpacitiesHoldFromThinToThick) {
  EXPECT_EQ(free_flight(0, 0.5f), std::numeric_limits<float>::infinity());
  EXPECT_EQ(free_flight(0, 0), std::numeric_limits<float>::infinity());
  EXPECT_EQ(free_flight(2, 0), 0);
  EXPECT_NEAR(free_flight(1e8f, 0.5f), std::log(2.0) * 1e-8, 1e-14);
  for (double tau = 1e-8; tau < 1e9; tau *= 10) {
    const double exact = -std::expm1(-tau);
    EXPECT_NEAR(opacity(float(tau), 1), exact, 2e-7 * exact) << tau;
  }
}

}  // namespace
}  // namespace farfield
