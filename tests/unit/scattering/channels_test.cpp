// SPDX-License-Identifier: Apache-2.0
// Trimmed models say the same as the full ones where the absent channels are 0.
#include "scattering/channels.h"

#include <gtest/gtest.h>

#include "scattering/flake_phase.h"
#include "scattering/surface_bsdf.h"
#include "tests/support/channel_sets.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

/// Of surfaces, and of flakes by one random flake.
template <typename Model>
vec3 value_of(const Model& model, const vec3& wi, Rng& rng) {
  if constexpr (requires { model.eval(wi); }) {
    return model.eval(wi);
  } else {
    return model.eval(wi, rng);
  }
}

/// Both models see the same random numbers, so that stochastic values agree too.
template <typename Full, typename Trimmed>
void expect_same(const Full& full, const Trimmed& trimmed, unsigned channels) {
  Rng directions(7);
  for (int i = 0; i < 20; ++i) {
    const vec3 wi(random_direction(directions));
    Rng a(i), b(i);
    const vec3 x = value_of(full, wi, a), y = value_of(trimmed, wi, b);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(x[c], y[c], 1e-5f * (1 + std::abs(x[c]))) << channels;
    EXPECT_NEAR(full.pdf(wi), trimmed.pdf(wi), 1e-5f * (1 + full.pdf(wi))) << channels;
    const ScatterSample s = full.sample(a), t = trimmed.sample(b);
    EXPECT_NEAR(s.pdf, t.pdf, 1e-4f * (1 + s.pdf)) << channels;
    EXPECT_NEAR(s.weight.x, t.weight.x, 1e-4f) << channels;
  }
}

TEST(VisitChannels, HandsOverEverySetAndIgnoresOtherBits) {
  for (unsigned channels = 0; channels < 64; ++channels) {
    const unsigned seen = visit_channels<kSurfaceChannels>(channels, [](auto set) { return unsigned(set()); });
    EXPECT_EQ(seen, channels & kSurfaceChannels);
    const unsigned flakes = visit_channels<kFlakeChannels>(channels, [](auto set) { return unsigned(set()); });
    EXPECT_EQ(flakes, channels & kFlakeChannels);
  }
}

TEST(Channels, TrimmedSurfacesAgreeWithTheFullModel) {
  const vec3 n = glm::normalize(vec3(1, 2, -1));
  const vec3 wo = glm::normalize(n + vec3(0.3f, -0.4f, 0.2f));
  for (unsigned channels = 0; channels <= kSurfaceChannels; ++channels) {
    SurfaceParams p;
    if ((channels & kDiffuse) != 0) p.diffuse = vec3(0.5f, 0.2f, 0.1f);
    if ((channels & kTransmission) != 0) p.transmission = vec3(0.4f, 0.3f, 0.1f);
    if ((channels & kSpecular) != 0) p.specular = vec3(0.04f, 0.3f, 0.9f), p.roughness2 = 0.2f;
    visit_channels<kSurfaceChannels>(
        channels, [&](auto set) { expect_same(SurfaceBsdf(p, n, wo), SurfaceModel<set()>(p, n, wo), channels); });
  }
}

TEST(Channels, TrimmedFlakesAgreeWithTheFullModel) {
  const vec3 wo = glm::normalize(vec3(0.3f, -0.4f, 0.2f));
  for (unsigned channels = 0; channels <= kFlakeChannels; ++channels) {
    FlakeParams p;
    p.sggx = sggx_from({1, 0.3, 0.2}, {1, 2, 3});
    if ((channels & kDiffuse) != 0) p.diffuse = vec3(0.5f, 0.2f, 0.1f);
    if ((channels & kTransmission) != 0) p.transmission = vec3(0.4f, 0.3f, 0.1f);
    if ((channels & kSpecular) != 0) p.specular = vec3(0.04f, 0.3f, 0.9f), p.roughness2 = 0.2f;
    p.self_shadowing = (channels & kSelfShadowing) != 0 ? 0.4f : 1.0f;
    visit_channels<kFlakeChannels>(
        channels, [&](auto set) { expect_same(FlakePhase(p, wo), FlakeModel<set()>(p, wo), channels); });
  }
}

TEST(Channels, AbsentOnesTakeNoMemory) {
  EXPECT_LT(sizeof(SurfaceModel<kDiffuse>), sizeof(SurfaceBsdf) / 2);
  EXPECT_LE(sizeof(FlakeModel<kDiffuse>), 80u);
}

}  // namespace
}  // namespace farfield
