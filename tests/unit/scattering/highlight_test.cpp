// SPDX-License-Identifier: Apache-2.0
#include "scattering/highlight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scattering/microfacet.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

TEST(Highlight, SharesAreTheMeansOverVisibleFacets) {
  for (const float alpha : {0.002f, 0.01f, 0.07f, 0.1f, 0.33f, 0.47f, 0.8f, 1.0f}) {
    const BasicMicrofacets<double> facets(SymMat3{alpha * alpha, alpha * alpha, 1, 0, 0, 0}, dvec3(0, 0, 1));
    const Highlight highlight(vec3(0.04f), alpha * alpha);
    for (const double cos : {1.0, 0.8, 0.6, 0.42, 0.25, 0.11, 0.05, 0.01}) {
      const dvec3 wo(std::sqrt(1 - cos * cos), 0, cos);
      double all = 0, grazing = 0;
      constexpr int n = 300;
      for (int i = 0; i < n * n; ++i) {
        const dvec3 m = facets.sample_visible(wo, (i / n + 0.5) / n, (i % n + 0.5) / n);
        const dvec3 wi = reflect_about(wo, m);
        if (!(wi.z > 0)) continue;
        const double weight =
            masking_weight<Masking::HeightCorrelated>(cos, facets.projected_area(wo), wi.z, facets.projected_area(wi));
        all += weight / (n * n);
        grazing += weight * std::pow(1 - glm::dot(wo, m), 5) / (n * n);
      }
      const HighlightShare share = highlight.share(float(cos));
      const double tolerance = alpha < 0.01f && cos < 0.03 ? 0.015 : 0.004;
      EXPECT_NEAR(share.all, all, tolerance) << alpha << ' ' << cos;
      EXPECT_NEAR(share.grazing, grazing, tolerance) << alpha << ' ' << cos;
    }
  }
}

TEST(Highlight, MeanIsTheMeanOfTheTable) {
  for (const float alpha : {0.001f, 0.1f, 0.37f, 1.0f}) {
    for (const float f0 : {0.001f, 0.04f, 1.0f}) {
      const Highlight highlight(vec3(f0), alpha * alpha);
      double mean = 0;
      constexpr int count = 100000;
      for (int i = 0; i < count; ++i) {
        const double cos = (i + 0.5) / count;
        mean += 2 * cos * highlight.albedo(highlight.share(float(cos))).x / count;
      }
      EXPECT_NEAR(highlight.mean_albedo().x, mean, 1e-5);
    }
  }
}

TEST(Highlight, EndsAreWhatTheyShouldBe) {
  const Highlight mirror(vec3(0.04f), 0);
  EXPECT_NEAR(mirror.albedo(mirror.share(1)).x, 0.04, 1e-3);
  EXPECT_NEAR(mirror.mean_albedo().x, 0.04 + 0.96 / 21, 2e-3);
  for (const float roughness2 : {0.0f, 0.3f, 1.0f}) {
    const Highlight white(vec3(1.0f), roughness2);
    for (const float cos : {0.0f, 0.01f, 0.5f, 1.0f}) EXPECT_NEAR(white.albedo(white.share(cos)).x, 1, 1e-6);
  }
  EXPECT_FALSE(Highlight(vec3(0.0f), 0.5f).exists());
  EXPECT_FALSE(Highlight().exists());
}

TEST(Highlight, NothingIsOutOfRange) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float f0 : {-1.0f, 1e-9f, 2.0f, nan}) {
    for (const float roughness2 : {-1.0f, 0.0f, 1e-30f, 7.0f, nan}) {
      const Highlight highlight(vec3(f0), roughness2);
      for (const float cos : {-1.0f, 0.0f, 1.0f, 2.0f, nan}) {
        const float albedo = highlight.albedo(highlight.share(cos)).x, lobe = highlight.multiple_lobe().x;
        EXPECT_TRUE(albedo >= 0 && albedo <= 1 + 1e-6f) << f0 << ' ' << roughness2 << ' ' << cos << ' ' << albedo;
        EXPECT_TRUE(lobe >= 0 && std::isfinite(lobe)) << f0 << ' ' << roughness2;
      }
    }
  }
}

}  // namespace
}  // namespace farfield
