// SPDX-License-Identifier: Apache-2.0
// Light from everywhere: a constant, an analytic sun and sky, or a latitude-longitude image; and distant lights in it.
//
// World up is +y. Units are radiometric W / (m^2 sr), linear RGB with Rec. 709 primaries; glTF's photometric lights
// come in divided by 683 lm / W.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "base/random.h"
#include "base/result.h"
#include "base/vec.h"
#include "path_tracer/image.h"

namespace farfield {

/// Luminance of linear RGB with Rec. 709 primaries.
inline float luminance(const vec3& rgb) { return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z; }

/// One direction drawn from where light comes from. A zero pdf is a failed sample.
struct EnvironmentSample {
  vec3 wi{0.0f};        ///< unit, towards the light
  vec3 radiance{0.0f};  ///< from there
  float pdf = 0;        ///< per steradian
};

/// A disc infinitely far away, of constant radiance.
struct DistantLight {
  vec3 direction{0.0f, 1.0f, 0.0f};  ///< towards it, unit
  vec3 irradiance{0.0f};             ///< linear RGB on a surface that faces it, W / m^2, >= 0
  float angle_rad = 0.0093f;         ///< diameter; clamped to [1e-3, 1]
};

/// A clear sky [Preetham et al. 1999] with a sun disc; below the horizon a grey ground, lit by both, that fades into
/// the haze of the horizon. How bright the sky is against the sun follows the model.
struct SunSkyOptions {
  vec3 sun_direction{0.0f, 1.0f, 0.0f};  ///< towards the sun, need not be unit
  float sun_irradiance = 4.5f;           ///< luminance of the sun's light on a surface that faces it, W / m^2, >= 0
  std::optional<vec3> sun_color;         ///< of the disc, any scale; absent: as the air tints it
  float sun_angle_rad = 0.0093f;         ///< diameter of the disc; clamped to [1e-3, 1]
  float turbidity = 3.0f;                ///< haze: 2 very clear, 10 hazy; clamped to [1.7, 10]
  float ground_albedo = 0.2f;
};

/// The light where none is given, and that evaluate uses: a sun 40 degrees above the horizon.
SunSkyOptions default_sun_sky();

/// Radiance from infinity with importance sampling. Immutable; any thread may use it. Copies share their tables.
class Environment {
 public:
  static Environment constant(const vec3& radiance);
  /// A sun below the horizon gives the sky of a sun at the horizon and no disc. A direction of length 0 or NaN counts
  /// as straight up.
  static Environment sun_sky(const SunSkyOptions& options);
  /// image: 3 or more channels R, G, B first, latitude-longitude: the upper row is +y, the centre of the image -z, and
  /// x grows from -z towards +x (a glTF camera looks at the image's centre). Texels are constant patches. Negative and
  /// NaN texels count as 0. scale multiplies the radiance. Errors: InvalidArgument (no texels, less than 3 channels).
  static Result<Environment> from_image(const Image& image, float scale = 1.0f);
  /// Reads an EXR file, or Radiance's .hdr where the name says so, and makes an environment of it. Errors: those of
  /// read_exr, of texture_module() and its reader, and of from_image.
  static Result<Environment> from_file(const std::filesystem::path& path, float scale = 1.0f);

  /// This and more light. Lights without irradiance are left out.
  Environment with(std::span<const DistantLight> lights) const;

  /// The layout that from_image() takes, width x width / 2 pixels (at least 2 wide). Each is the mean over its patch,
  /// so that a sun smaller than a pixel keeps its light.
  Image to_image(int width) const;

  /// Radiance that arrives from unit direction `wi`.
  vec3 radiance(const vec3& wi) const;
  /// Draws a direction; black environments give pdf 0. choice: uniform in [0, 1), says whether the sun's disc or the
  /// rest is drawn from; worth stratifying over a pixel's samples.
  EnvironmentSample sample(float choice, Rng& rng) const;
  EnvironmentSample sample(Rng& rng) const { return sample(rng.next(), rng); }
  /// Density with which sample() draws wi, per steradian. Integrates to 1, or is 0 everywhere for black.
  float pdf(const vec3& wi) const;

 private:
  struct Impl;
  explicit Environment(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace farfield
