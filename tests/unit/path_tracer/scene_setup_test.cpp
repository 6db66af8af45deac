// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/scene_setup.h"

#include <gtest/gtest.h>

#include "path_tracer/image.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

GltfLight directional(const vec3& direction, float lux) {
  GltfLight light;
  light.direction = direction;
  light.intensity = lux;
  return light;
}

TEST(SceneSetup, CamerasAreFoundByNameAndIndexAndListedInTheError) {
  const auto scene = read_gltf_scene(FARFIELD_TEST_DATA "/import_cases/g18_two_cameras.glb");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(find_camera(*scene, "").value(), 0u);
  EXPECT_EQ(find_camera(*scene, "shot").value(), 1u);
  EXPECT_EQ(find_camera(*scene, "1").value(), 1u);
  for (const char* wrong : {"2", "-1", "1x", "Shot"}) {
    const auto none = find_camera(*scene, wrong);
    ASSERT_FALSE(none) << wrong;
    EXPECT_NE(none.error().message.find("0 \"preview\", 1 \"shot\""), std::string::npos) << none.error().message;
  }
  EXPECT_EQ(make_camera(*scene, 1, 0, 20, 10).position(), vec3(0, 0, 5));
}

TEST(MakeCamera, KeepsTheVerticalAngleForAnyShapeOfImage) {
  GltfScene scene;
  GltfCamera camera;
  camera.position = {1, 2, 3};
  camera.yfov_rad = 0.8f;
  camera.aspect = 1.0f;
  scene.cameras = {camera};
  scene.nodes.resize(1);
  scene.nodes[0].translation = dvec3(1, 2, 3);
  for (const int width : {10, 400}) {
    const Camera made = make_camera(scene, 0, 0, width, 100);
    EXPECT_NEAR(made.tessellation().pixel_spread, 2 * std::tan(0.4f) / 100, 1e-7f);
    EXPECT_LT(glm::length(made.position() - vec3(1, 2, 3)), 1e-6f);
    EXPECT_LT(glm::length(made.forward() - vec3(0, 0, -1)), 1e-6f);
  }
}

TEST(MakeCamera, OrthographicKeepsItsHeight) {
  GltfScene scene;
  GltfCamera camera;
  camera.is_orthographic = true;
  camera.half_height = 3;
  scene.cameras = {camera};
  scene.nodes.resize(1);
  const Camera made = make_camera(scene, 0, 0, 40, 30);
  EXPECT_TRUE(made.is_orthographic());
  EXPECT_FLOAT_EQ(made.tessellation().pixel_width, 6.0f / 30);
}

TEST(MakeCamera, WithoutACameraTheWholeSceneIsSeen) {
  GltfScene scene;
  GltfMesh mesh;
  mesh.bounds = {vec3(-1), vec3(1)};
  scene.meshes = {mesh};
  for (const vec3& place : {vec3(-50, 0, 0), vec3(70, 5, 30)}) {
    GltfInstance instance;
    instance.to_world = mat4x3(1.0f);
    instance.to_world[3] = place;
    scene.instances.push_back(instance);
  }
  for (const auto& [width, height] : {std::pair{100, 20}, std::pair{20, 100}}) {
    const Camera camera = make_camera(scene, 0, 0, width, height);
    // Both ends project into the image: inverse of Camera::ray.
    const vec3 right = glm::normalize(glm::cross(camera.forward(), camera.up()));
    for (const vec3& point : {vec3(-51, 0, 0), vec3(71, 5, 30)}) {
      const vec3 offset = point - camera.position();
      const float depth = glm::dot(offset, camera.forward());
      ASSERT_GT(depth, 0.0f);
      const float pixel = depth * camera.tessellation().pixel_spread;
      EXPECT_LT(std::abs(glm::dot(offset, right)), 0.5f * pixel * static_cast<float>(width));
      EXPECT_LT(std::abs(glm::dot(offset, camera.up())), 0.5f * pixel * static_cast<float>(height));
    }
  }
  EXPECT_GT(make_camera(GltfScene(), 0, 0, 10, 10).tessellation().pixel_spread, 0.0f);  // nothing to see: no crash
}

TEST(MakeLights, BrightestDirectionalLightIsTheSunAndTheOthersShineBesideIt) {
  GltfScene scene;
  const vec3 travels = glm::normalize(vec3(-1, -2, 0.5f));
  scene.lights = {directional({0, -1, 0}, 683), directional(travels, 3073.5f)};
  scene.lights[1].color = vec3(1.0f, 0.8f, 0.6f);
  std::vector<std::string> warnings;
  const auto lights = make_lights(scene, RenderOptions(), warnings);
  ASSERT_TRUE(lights);
  EXPECT_TRUE(warnings.empty());
  const vec3 sun = lights->environment.radiance(-travels),
             beside = lights->environment.radiance(glm::normalize(-travels + vec3(0.02f, 0, 0)));
  EXPECT_GT(luminance(sun), 1000 * luminance(beside));
  EXPECT_NEAR(sun.z / sun.x, 0.6f, 0.01f);
  const vec3 second = lights->environment.radiance({0, 1, 0});
  EXPECT_NEAR(second.x * kPi * 0.00465f * 0.00465f, 1.0f, 0.01f);  // 683 lux are 1 W / m^2
}

// About +y: what is lit from the front comes to be lit from behind, as high as before.
TEST(MakeLights, TheTurnedSunStandsOppositeAndSoDoesItsSky) {
  const vec3 towards_sun = glm::normalize(vec3(1, 2, -0.5f));
  RenderOptions turned;
  turned.turn_sun = true;
  for (const bool has_own_sun : {true, false}) {
    GltfScene scene;
    if (has_own_sun) scene.lights = {directional(-towards_sun, 3073.5f)};
    std::vector<std::string> warnings;
    const auto before = make_lights(scene, RenderOptions(), warnings), after = make_lights(scene, turned, warnings);
    ASSERT_TRUE(before && after);
    EXPECT_TRUE(warnings.empty());
    const vec3 at = has_own_sun ? towards_sun : glm::normalize(default_sun_sky().sun_direction);
    for (const vec3& wi : {at, glm::normalize(vec3(0.3f, 0.4f, 0.9f)), glm::normalize(vec3(1, -0.2f, 0))}) {
      const vec3 was = before->environment.radiance(wi), is = after->environment.radiance({-wi.x, wi.y, -wi.z});
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(is[c], was[c], 1e-3f * was[c]) << has_own_sun;
    }
  }
}

TEST(MakeLights, WithoutSkyOnlyTheScenesOwnLightsShine) {
  GltfScene scene;
  scene.lights = {directional({0, -1, 0}, 683), directional({-1, 0, 0}, 1366)};
  RenderOptions options;
  options.sky = false;
  std::vector<std::string> warnings;
  const auto lights = make_lights(scene, options, warnings);
  ASSERT_TRUE(lights);
  EXPECT_TRUE(warnings.empty());
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const EnvironmentSample sample = lights->environment.sample(rng);
    ASSERT_TRUE(sample.wi.y > 0.9999f || sample.wi.x > 0.9999f);
  }
  EXPECT_EQ(lights->environment.radiance({0, 0, 1}), vec3(0.0f));
  EXPECT_EQ(lights->environment.radiance({0, -1, 0}), vec3(0.0f));

  const auto nothing = make_lights(GltfScene(), options, warnings);
  ASSERT_TRUE(nothing);
  EXPECT_EQ(nothing->environment.sample(rng).pdf, 0.0f);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("--no-sky"), std::string::npos);
}

TEST(MakeLights, SunKeepsItsStrengthInWattsPerSquareMetre) {
  // Blender exports a sun of 4.5 W / m^2 as 3073.5 lux.
  GltfScene scene;
  scene.lights = {directional({0, -1, 0}, 3073.5f)};
  std::vector<std::string> warnings;
  const auto lights = make_lights(scene, RenderOptions(), warnings);
  Rng rng(2);
  double irradiance = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const EnvironmentSample sample = lights->environment.sample(rng);
    if (sample.wi.y > 0.9999f) irradiance += static_cast<double>(luminance(sample.radiance) * sample.wi.y / sample.pdf);
  }
  EXPECT_NEAR(irradiance / kCount, 4.5, 0.1);  // 0.02 is one sigma; seed 2
}

TEST(MakeLights, WithoutLightsThereIsTheDefaultSunAndSky) {
  std::vector<std::string> warnings;
  const auto lights = make_lights(GltfScene(), RenderOptions(), warnings);
  ASSERT_TRUE(lights);
  EXPECT_TRUE(warnings.empty());
  EXPECT_GT(luminance(lights->environment.radiance({0, 1, 0})), 0.1f);
}

TEST(MakeLights, PointAndSpotLightsAreConvertedToWatts) {
  GltfScene scene;
  GltfLight point;
  point.type = GltfLight::Type::Point;
  point.position = {1, 2, 3};
  point.intensity = 683;
  point.color = {1, 0.5f, 0};
  GltfLight spot = point;
  spot.type = GltfLight::Type::Spot;
  spot.inner_cone_rad = 0.2f;
  spot.outer_cone_rad = 0.4f;
  scene.lights = {point, spot};
  std::vector<std::string> warnings;
  const auto lights = make_lights(scene, RenderOptions(), warnings);
  ASSERT_EQ(lights->points.size(), 2u);
  EXPECT_LT(glm::length(lights->points[0].intensity - vec3(1, 0.5f, 0)), 1e-6f);
  EXPECT_EQ(spot_falloff(lights->points[0], {0, 1, 0}), 1.0f);
  const auto at = [&](float angle) { return spot_falloff(lights->points[1], {std::sin(angle), 0, -std::cos(angle)}); };
  EXPECT_EQ(at(0.1f), 1.0f);
  EXPECT_EQ(at(0.5f), 0.0f);
  EXPECT_GT(at(0.25f), at(0.35f));
}

TEST(MakeLights, EnvironmentImageReplacesTheSky) {
  const test::TemporaryFolder folder;
  Image image(2, 1, {"R", "G", "B"});
  image.values = {1, 2, 3, 1, 2, 3};
  ASSERT_TRUE(write_exr(folder.path() / "light.exr", image));
  GltfScene scene;
  scene.lights = {directional({0, -1, 0}, 100)};
  RenderOptions options;
  options.environment = folder.path() / "light.exr";
  std::vector<std::string> warnings;
  const auto lights = make_lights(scene, options, warnings);
  ASSERT_TRUE(lights);
  EXPECT_EQ(lights->environment.radiance({0, 1, 0}), vec3(1, 2, 3));
  EXPECT_EQ(warnings.size(), 1u);
  options.environment = folder.path() / "missing.exr";
  EXPECT_EQ(make_lights(scene, options, warnings).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace farfield
