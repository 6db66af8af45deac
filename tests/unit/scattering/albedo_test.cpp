// SPDX-License-Identifier: Apache-2.0
#include "scattering/albedo.h"

#include <gtest/gtest.h>

#include <limits>

namespace farfield {
namespace {

const vec3 kAlbedo(0.02f, 0.4f, 0.97f);

TEST(ClusterAlbedo, IsTheSumOfItsOrders) {
  for (const float share : {0.1f, 0.5f, 0.9f}) {
    vec3 sum(0.0f), order = share * kAlbedo;
    for (int n = 0; n < 2000; ++n) sum += order, order *= (1 - share) * kAlbedo;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(cluster_albedo(kAlbedo, share)[c], sum[c], 1e-5f);
  }
}

TEST(ClusterAlbedo, OfAClusterOfClustersMultipliesTheShares) {
  const vec3 nested = cluster_albedo(cluster_albedo(kAlbedo, 0.3f), 0.6f), at_once = cluster_albedo(kAlbedo, 0.18f);
  const vec3 back = cluster_albedo(cluster_albedo(kAlbedo, 0.3f), 1 / 0.3f);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(nested[c], at_once[c], 1e-6f);
    EXPECT_NEAR(back[c], kAlbedo[c], 1e-6f);
  }
}

TEST(ClusterAlbedo, LeavesBlackAndWhiteAlone) {
  for (const float share : {1e-4f, 0.5f, 1.0f, 2.0f, 1e4f}) {
    EXPECT_EQ(cluster_albedo(vec3(0.0f), share), vec3(0.0f));
    EXPECT_EQ(cluster_albedo(vec3(1.0f), share), vec3(1.0f));
  }
}

TEST(ClampAlbedo, PutsAllInRange) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(clamp_albedo({nan, -1.0f, infinity}), vec3(0, 0, 1));
  EXPECT_EQ(clamp_albedo(kAlbedo), kAlbedo);
}

TEST(LimitSum, ScalesBothWhereTheSumIsAboveOne) {
  vec3 reflected(0.5f, 1.0f, 0.0f), transmitted(0.25f, 1.0f, 1.0f);
  limit_sum(reflected, transmitted);
  EXPECT_EQ(reflected, vec3(0.5f, 0.5f, 0.0f));
  EXPECT_EQ(transmitted, vec3(0.25f, 0.5f, 1.0f));
}

}  // namespace
}  // namespace farfield
