// SPDX-License-Identifier: Apache-2.0
#include "evaluate/lights.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

vec3 sun_of(Light light, const OrthoView& view) {
  return std::get<vec3>(light_metadata(light, view).at("farfield:sun_direction"));
}

TEST(Lights, StandInFrontBehindAndAboveInEveryView) {
  for (const vec3& direction : view_directions(12)) {
    const OrthoView view = frame_view({vec3(-1.0f), vec3(1.0f)}, direction, 0.1f);
    const vec3 front = sun_of(Light::Front, view), behind = sun_of(Light::Behind, view);
    EXPECT_NEAR(glm::length(front), 1.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(front, view.direction), -std::sqrt(0.75f), 1e-5f);  // 30 degrees off the axis
    EXPECT_NEAR(glm::dot(behind, view.direction), std::sqrt(0.75f), 1e-5f);
    EXPECT_NEAR(sun_of(Light::Above, view).y, std::cos(kPi / 9), 1e-3f);
  }
}

TEST(Lights, AreWhatTheirMetadataSays) {
  const OrthoView view = frame_view({vec3(-1.0f), vec3(1.0f)}, {0.6f, 0.0f, 0.8f}, 0.1f);
  for (const Light light : {Light::Front, Light::Behind, Light::Above}) {
    const Environment environment = lights_for(light, view).environment;
    const vec3 sun = sun_of(light, view);
    EXPECT_GT(environment.radiance(sun).x, 1000.0f);
    EXPECT_EQ(environment.radiance(-sun), vec3(0.0f));  // a sun alone
  }
  const Environment sky = lights_for(Light::Sky, view).environment;
  EXPECT_EQ(sky.radiance({0, 1, 0}), vec3(1.0f));
  EXPECT_EQ(sky.radiance({0, -1, 0}), vec3(1.0f));
}

TEST(Lights, AreReadByName) {
  for (const Light light : all_lights()) EXPECT_EQ(parse_lights(name_of(light)), std::vector<Light>{light});
  EXPECT_EQ(parse_lights("sky,front"), (std::vector<Light>{Light::Sky, Light::Front}));
  for (const char* wrong : {"", "moon", "sky,", ",sky", "sky,sky", "Sky"}) {
    const auto lights = parse_lights(wrong);
    ASSERT_FALSE(lights) << wrong;
    EXPECT_EQ(lights.error().code, ErrorCode::InvalidArgument);
  }
}

}  // namespace
}  // namespace farfield
