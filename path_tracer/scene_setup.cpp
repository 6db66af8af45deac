// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/scene_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/result.h"

namespace farfield {

namespace {

Camera camera_around(const Box3& bounds, int width, int height) {
  constexpr float kFovY = 0.7f;
  const float radius = std::max(0.5f * glm::length(bounds.size()), 1e-6f);
  const vec3 center = bounds.is_empty() ? vec3(0.0f) : bounds.center();
  const vec3 forward = glm::normalize(vec3(-0.4f, -0.35f, -1.0f));
  // The bounding sphere fits into the narrower of the two angles.
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const float half_angle = std::atan(std::tan(0.5f * kFovY) * std::min(aspect, 1.0f));
  return Camera::perspective(center - forward * (radius / std::sin(half_angle)), forward, vec3(0.0f, 1.0f, 0.0f), kFovY,
                             width, height);
}

PointLight make_point_light(const GltfLight& light) {
  PointLight point;
  point.position = light.position;
  point.intensity = light.color * (light.intensity / kLumensPerWatt);
  if (light.type != GltfLight::Type::Spot) return point;
  point.direction = light.direction;
  point.cos_inner = std::cos(light.inner_cone_rad);
  point.cos_outer = std::cos(light.outer_cone_rad);
  return point;
}

float strength(const GltfLight& light) { return light.intensity * luminance(light.color); }

DistantLight make_distant_light(const GltfLight& light) {
  DistantLight distant;
  distant.direction = -light.direction;
  distant.irradiance = light.color * (light.intensity / kLumensPerWatt);
  return distant;
}

// What stood in front of a direction stands behind it.
vec3 turn_half_about_y(const vec3& v) { return {-v.x, v.y, -v.z}; }

// The sky of the brightest directional light, which is its sun; the others shine beside it.
Environment make_sky(std::vector<GltfLight> directional, bool turn_default_sun) {
  SunSkyOptions sky = default_sun_sky();
  if (turn_default_sun) sky.sun_direction = turn_half_about_y(sky.sun_direction);
  std::stable_sort(directional.begin(), directional.end(),
                   [](const GltfLight& a, const GltfLight& b) { return strength(a) > strength(b); });
  std::vector<DistantLight> others;
  for (const GltfLight& light : directional) others.push_back(make_distant_light(light));
  if (!directional.empty() && strength(directional[0]) > 0) {
    sky.sun_direction = -directional[0].direction;
    sky.sun_irradiance = strength(directional[0]) / kLumensPerWatt;
    sky.sun_color = directional[0].color;
    others.erase(others.begin());
  }
  return Environment::sun_sky(sky).with(others);
}

Environment make_darkness(const std::vector<GltfLight>& directional) {
  std::vector<DistantLight> lights;
  for (const GltfLight& light : directional) lights.push_back(make_distant_light(light));
  return Environment::constant(vec3(0.0f)).with(lights);
}

}  // namespace

Result<size_t> find_camera(const GltfScene& scene, const std::string& name) {
  if (name.empty()) return size_t{0};
  const auto& cameras = scene.cameras;
  const auto named = std::find_if(cameras.begin(), cameras.end(), [&](const GltfCamera& c) { return c.name == name; });
  if (named != cameras.end()) return static_cast<size_t>(named - cameras.begin());
  size_t index = 0;
  const char* const end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data(), end, index);
  if (error == std::errc() && rest == end && index < cameras.size()) return index;

  std::string list;
  for (size_t i = 0; i < cameras.size(); ++i)
    list += fmt::format("{}{} \"{}\"", i == 0 ? "" : ", ", i, cameras[i].name);
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("there is no camera \"{}\"; the scene has {}", name, list.empty() ? "none" : list));
}

Camera make_camera(const GltfScene& scene, size_t index, double seconds, int width, int height) {
  if (scene.cameras.empty()) return camera_around(scene.bounds_world(), width, height);
  const GltfCamera camera = scene.camera_at(index, seconds);
  if (!camera.is_orthographic)
    return Camera::perspective(camera.position, camera.forward, camera.up, camera.yfov_rad, width, height);
  const float width_world = 2 * camera.half_height * static_cast<float>(width) / static_cast<float>(height);
  return Camera::orthographic(camera.position, camera.forward, camera.up, width_world, width, height);
}

Result<Lights> make_lights(const GltfScene& scene, const RenderOptions& options, std::vector<std::string>& warnings) {
  Lights lights;
  std::vector<GltfLight> directional;
  for (const GltfLight& light : scene.lights) {
    if (light.type == GltfLight::Type::Directional)
      directional.push_back(light);
    else
      lights.points.push_back(make_point_light(light));
  }
  if (options.turn_sun)
    for (GltfLight& light : directional) light.direction = turn_half_about_y(light.direction);

  if (!options.environment.empty()) {
    FARFIELD_TRY_LET(auto environment, Environment::from_file(options.environment));
    lights.environment = environment;
    if (!directional.empty()) warnings.push_back("the environment image replaces the scene's directional lights");
    if (options.turn_sun) warnings.push_back("the environment image is not turned with the sun");
  } else if (options.sky) {
    lights.environment = make_sky(directional, options.turn_sun);
  } else {
    lights.environment = make_darkness(directional);
    if (scene.lights.empty())
      warnings.push_back("neither sky nor lights: only what glows by itself is seen; leave out --no-sky for daylight");
  }
  return lights;
}

}  // namespace farfield
