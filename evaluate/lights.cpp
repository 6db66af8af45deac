// SPDX-License-Identifier: Apache-2.0
#include "evaluate/lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "path_tracer/environment.h"

namespace farfield {
namespace {

struct NamedLight {
  Light light;
  std::string_view name;
};
constexpr std::array<Light, 5> kLights = {Light::Daylight, Light::Front, Light::Behind, Light::Above, Light::Sky};
constexpr std::array<NamedLight, 5> kNames = {{{Light::Daylight, "daylight"},
                                               {Light::Front, "front"},
                                               {Light::Behind, "behind"},
                                               {Light::Above, "above"},
                                               {Light::Sky, "sky"}}};

/// How far the suns in front and behind are from the camera's axis: no camera stands in its own sun, where every
/// shadow is hidden.
constexpr float kAside = kPi / 6.0f;
/// 20 degrees from +y: along what stands upright light meets nearly nothing.
constexpr vec3 kAbove{0.23f, 0.94f, 0.25f};

/// Towards the sun, unit.
vec3 sun_direction(Light light, const OrthoView& view) {
  const vec3 aside = std::sin(kAside) * view.up;
  switch (light) {
    case Light::Front:
      return aside - std::cos(kAside) * view.direction;
    case Light::Behind:
      return aside + std::cos(kAside) * view.direction;
    default:
      return glm::normalize(kAbove);
  }
}

/// As bright as daylight's sun, but white.
DistantLight sun(Light light, const OrthoView& view) {
  const SunSkyOptions daylight = default_sun_sky();
  return {sun_direction(light, view), vec3(daylight.sun_irradiance), daylight.sun_angle_rad};
}

}  // namespace

std::span<const Light> all_lights() { return kLights; }

std::string_view name_of(Light light) {
  return std::find_if(kNames.begin(), kNames.end(), [&](const NamedLight& named) { return named.light == light; })
      ->name;
}

Result<std::vector<Light>> parse_lights(std::string_view names) {
  std::vector<Light> lights;
  while (true) {
    const size_t comma = names.find(',');
    const std::string_view name = names.substr(0, comma);
    const auto* const known =
        std::find_if(kNames.begin(), kNames.end(), [&](const NamedLight& named) { return named.name == name; });
    if (known == kNames.end())
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("\"{}\" is none of the lights daylight, front, behind, above, sky", name));
    if (std::find(lights.begin(), lights.end(), known->light) != lights.end())
      return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is named twice", name));
    lights.push_back(known->light);
    if (comma == std::string_view::npos) return lights;
    names.remove_prefix(comma + 1);
  }
}

Lights lights_for(Light light, const OrthoView& view) {
  Lights lights;
  if (light == Light::Daylight) {
    lights.environment = Environment::sun_sky(default_sun_sky());
  } else if (light == Light::Sky) {
    lights.environment = Environment::constant(vec3(1.0f));
  } else {
    const DistantLight distant = sun(light, view);
    lights.environment = Environment::constant(vec3(0.0f)).with({&distant, 1});
  }
  return lights;
}

Metadata light_metadata(Light light, const OrthoView& view) {
  Metadata metadata = {{"farfield:light", std::string(name_of(light))}};
  if (light == Light::Sky) {
    metadata["farfield:sky_radiance"] = 1.0f;
  } else if (light == Light::Daylight) {
    const SunSkyOptions daylight = default_sun_sky();
    const vec3 direction = glm::normalize(daylight.sun_direction);
    metadata["farfield:sun_direction"] = direction;
    metadata["farfield:sun_radiance"] = Environment::sun_sky(daylight).radiance(direction);
    metadata["farfield:sun_irradiance"] = daylight.sun_irradiance;
    metadata["farfield:sun_angle_rad"] = daylight.sun_angle_rad;
    metadata["farfield:sky_model"] = std::string("Preetham 1999, +y up, see environment.exr");
    metadata["farfield:sky_turbidity"] = daylight.turbidity;
    metadata["farfield:ground_albedo"] = daylight.ground_albedo;
  } else {
    const DistantLight distant = sun(light, view);
    metadata["farfield:sun_direction"] = distant.direction;
    metadata["farfield:sun_irradiance"] = distant.irradiance.x;
    metadata["farfield:sun_angle_rad"] = distant.angle_rad;
  }
  return metadata;
}

}  // namespace farfield
