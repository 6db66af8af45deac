// SPDX-License-Identifier: Apache-2.0
#include "scattering/sggx_codec.h"

#include <gtest/gtest.h>

#include "scattering/sggx.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

double smallest_eigenvalue(const SymMat3& s) {
  // det and trace of the traceless part give eigenvalues to 1e-8 only; shift by a little and ask Cholesky instead.
  const double shift = 1e-6;
  const SymEntries e = entries(s);
  const double xx = e.xx + shift, yx = e.xy, zx = e.xz;
  const double yy = e.yy + shift - yx * yx / xx, zy = e.yz - yx * zx / xx;
  const double zz = e.zz + shift - zx * zx / xx - zy * zy / yy;
  return std::min(xx, std::min(yy, zz)) - shift;
}

SymMat3 random_sggx(Rng& rng, double low_exponent) {
  const dvec3 eigen(1, std::pow(10, low_exponent * rng.next()), std::pow(10, low_exponent * rng.next()));
  return sggx_from(eigen, random_direction(rng));
}

/// Largest difference of sigma over random directions.
double sigma_error(const SymMat3& a, const SymMat3& b, Rng& rng) {
  const BasicSggx<double> x(a), y(b);
  double worst = 0;
  for (int i = 0; i < 50; ++i) {
    const dvec3 w = random_direction(rng);
    worst = std::max(worst, std::abs(x.sigma(w) - y.sigma(w)));
  }
  return worst;
}

TEST(SggxCodec, WhateverIsPackedIsPositiveSemidefinite) {
  Rng rng(1);
  for (int i = 0; i < 50000; ++i) {
    const SymMat3 s = random_sggx(rng, -8) * std::exp(20 * (rng.next() - 0.5f));
    // 1e-7: the rounding of the float entries themselves.
    EXPECT_GE(smallest_eigenvalue(unpack(pack_flake_sggx(s))), -1e-7);
    EXPECT_GE(smallest_eigenvalue(unpack(pack_surface_sggx(s))), -1e-7);
  }
}

TEST(SggxCodec, FlatDistributionsStayFlatWithTheirNormal) {
  Rng rng(2);
  for (int i = 0; i < 20000; ++i) {
    const vec3 n(random_direction(rng));
    const SymMat3 surface = unpack(pack_surface_sggx(SymMat3::outer(n)));
    // sin^2 of the angle to n: half a step of 1/65535 per axis.
    EXPECT_LT((surface.trace() - surface.quadratic(n)) / surface.trace(), 5e-7);
    const SymMat3 flake = unpack(pack_flake_sggx(SymMat3::outer(n)));
    EXPECT_LT((flake.trace() - flake.quadratic(n)) / flake.trace(), 3 * 0.25 / 255 / 255 * 1.1);
  }
  for (const vec3& n : {vec3(1, 0, 0), vec3(0, -1, 0), vec3(0, 0, 1)}) {
    EXPECT_EQ(unpack(pack_surface_sggx(SymMat3::outer(n))), SymMat3::outer(n));
    EXPECT_EQ(unpack(pack_flake_sggx(SymMat3::outer(n) * 0.1f)), SymMat3::outer(n));
  }
}

TEST(SggxCodec, IsotropicIsExact) {
  EXPECT_EQ(unpack(pack_flake_sggx(SymMat3::identity() * 7.0f)), SymMat3::identity());
  EXPECT_EQ(unpack(pack_surface_sggx(SymMat3::identity() * 0.3f)), SymMat3::identity());
}

// The bounds are those of docs/results/light.md, rounded up.
TEST(SggxCodec, ErrorIsBounded) {
  Rng rng(3);
  double flake = 0, surface = 0;
  for (int i = 0; i < 20000; ++i) {
    const SymMat3 s = random_sggx(rng, -6);
    flake = std::max(flake, sigma_error(s, unpack(pack_flake_sggx(s)), rng));
    surface = std::max(surface, sigma_error(s, unpack(pack_surface_sggx(s)), rng));
  }
  EXPECT_LT(flake, 0.1);
  EXPECT_LT(surface, 0.006);
  RecordProperty("flake_sigma_error", std::to_string(flake));
  RecordProperty("surface_sigma_error", std::to_string(surface));
}

TEST(SggxCodec, EmptyAndBrokenInputPackToZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const SymMat3& s :
       {SymMat3{}, SymMat3::identity() * nan, SymMat3::identity() * inf, SymMat3{-1, -1, -1, 0, 0, 0}}) {
    EXPECT_EQ(unpack(pack_flake_sggx(s)), SymMat3{});
    EXPECT_EQ(unpack(pack_surface_sggx(s)), SymMat3{});
  }
}

TEST(SggxCodec, IndefiniteInputStillPacksToSemidefinite) {
  const SymMat3 s = unpack(pack_flake_sggx({1, 1, 1, 1, 1, -1}));
  EXPECT_GE(smallest_eigenvalue(s), -1e-7);
}

TEST(SggxCodec, AnyBytesAreFinite) {
  Rng rng(4);
  for (int i = 0; i < 10000; ++i) {
    PackedFlakeSggx packed;
    for (auto& b : packed.sigma) b = static_cast<uint8_t>(rng.next_uint());
    for (auto& b : packed.correlation) b = static_cast<int8_t>(rng.next_uint());
    const SymMat3 s = unpack(packed);
    EXPECT_TRUE(std::isfinite(s.trace() + s.xy + s.xz + s.yz));
    const Sggx sggx(s);
    EXPECT_TRUE(std::isfinite(sggx.sigma(vec3(random_direction(rng)))));
  }
}

}  // namespace
}  // namespace farfield
