// SPDX-License-Identifier: Apache-2.0
// Every environment is a table of cells that directions are drawn from, plus discs that are drawn apart: suns are far
// smaller than a cell and carry about half of the light. The density is the mixture of all.
#include "path_tracer/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "base/result.h"
#include "base/texture_module.h"
#include "path_tracer/lat_long.h"
#include "path_tracer/preetham_sky.h"

namespace farfield {

namespace {

constexpr LatLongGrid kSkyGrid{128, 64};
constexpr int kSkySubsamples = 4;  ///< per side of a cell, for its mean

// A cone of constant radiance. Inside and outside are told by the chord, which a float resolves where 1 - cos does not.
struct SunDisc {
  vec3 direction{0.0f, 1.0f, 0.0f};
  float chord2 = 0;       ///< squared distance on the unit sphere from the centre to the edge
  float solid_angle = 0;  ///< steradian
  vec3 radiance{0.0f};
  float probability = 0;  ///< share of the samples that it gets

  double power() const { return static_cast<double>(luminance(radiance) * solid_angle); }
  bool contains(const vec3& wi) const {
    const vec3 offset = wi - direction;
    return glm::dot(offset, offset) < chord2;
  }
  vec3 sample(Rng& rng) const {
    const float one_minus_cos = 0.5f * chord2 * rng.next();
    const float sin_theta = std::sqrt(one_minus_cos * (2 - one_minus_cos));
    const float phi = 2 * kPi * rng.next();
    return glm::normalize(
        Frame(direction).to_world(vec3(sin_theta * std::cos(phi), sin_theta * std::sin(phi), 1 - one_minus_cos)));
  }
};

SunDisc make_disc(const DistantLight& light) {
  const float angle_rad = std::clamp(light.angle_rad, 1e-3f, 1.0f);
  SunDisc disc;
  disc.direction = light.direction;
  const float half_chord = std::sin(0.25f * angle_rad);  // the edge is angle / 2 from the centre
  disc.chord2 = 4 * half_chord * half_chord;
  disc.solid_angle = kPi * disc.chord2;
  // A surface that faces a cone of half angle a receives pi sin^2(a) times its radiance.
  const float sin_edge = std::sin(0.5f * angle_rad);
  disc.radiance = light.irradiance / (kPi * sin_edge * sin_edge);
  return disc;
}

// How much haze lies below the eye: between it and an endless ground that is seen at angle a below the horizon there is
// 1 / sin(a) of it. 2 degrees down half of the light is the ground's.
constexpr float kHazeBelowEye = 0.025f;

// The sky above, and below the horizon the ground that it lights, which fades into the haze of the sky behind it.
struct Sky {
  PreethamSky model;
  float scale;  ///< of the model's kcd / m^2
  vec3 ground{0.0f};

  vec3 radiance(const vec3& wi) const {
    if (wi.y >= 0) return scale * model.radiance(wi);
    const vec3 horizon(wi.x, 0.0f, wi.z);
    const float distance = glm::length(horizon);
    if (!(distance > 0)) return ground;  // straight down
    return glm::mix(scale * model.radiance(horizon / distance), ground, std::exp(kHazeBelowEye / wi.y));
  }
  // On a horizontal surface.
  vec3 irradiance() const {
    dvec3 sum(0.0);
    for (int row = 0; row < kSkyGrid.height / 2; ++row) {
      for (int column = 0; column < kSkyGrid.width; ++column) {
        const vec3 wi = kSkyGrid.direction(float(column) + 0.5f, float(row) + 0.5f);
        sum += kSkyGrid.solid_angle(row) * dvec3(radiance(wi) * wi.y);
      }
    }
    return vec3(sum);
  }
};

std::vector<float> cell_luminances(const Sky& sky) {
  std::vector<float> means;
  means.reserve(kSkyGrid.cell_count());
  constexpr float kStep = 1.0f / kSkySubsamples;
  for (int row = 0; row < kSkyGrid.height; ++row) {
    for (int column = 0; column < kSkyGrid.width; ++column) {
      float sum = 0;
      for (int i = 0; i < kSkySubsamples; ++i)
        for (int j = 0; j < kSkySubsamples; ++j)
          sum += luminance(sky.radiance(
              kSkyGrid.direction(float(column) + (float(i) + 0.5f) * kStep, float(row) + (float(j) + 0.5f) * kStep)));
      means.push_back(sum * kStep * kStep);
    }
  }
  return means;
}

float cleaned(float texel) { return texel > 0 && std::isfinite(texel) ? texel : 0.0f; }

}  // namespace

SunSkyOptions default_sun_sky() {
  SunSkyOptions options;
  options.sun_direction = glm::normalize(vec3(0.6f, 0.72f, 0.6f));
  return options;
}

struct Environment::Impl {
  LatLongGrid grid;
  LatLongDistribution cells;
  std::vector<vec3> texels;  ///< one per cell; empty for a sky
  std::optional<Sky> sky;
  std::vector<SunDisc> discs;
  float cell_probability = 1;  ///< share of the samples that the cells get; with the discs' 1

  vec3 background(const vec3& wi) const { return sky ? sky->radiance(wi) : texels[grid.cell(wi)]; }
  float cell_pdf(const vec3& wi) const { return cells.integral() > 0 ? cells.pdf(wi) : 0.0f; }
  void share_samples();
};

// In proportion to what each sends.
void Environment::Impl::share_samples() {
  double total = cells.integral();
  for (const SunDisc& disc : discs) total += disc.power();
  if (!(total > 0)) return;
  for (SunDisc& disc : discs) disc.probability = static_cast<float>(disc.power() / total);
  cell_probability = static_cast<float>(cells.integral() / total);
}

Environment Environment::constant(const vec3& radiance) {
  const LatLongGrid grid{1, 1};
  const float weight[] = {luminance(radiance)};
  return Environment(std::make_shared<Impl>(Impl{grid, LatLongDistribution(grid, weight), {radiance}, {}, {}, 1.0f}));
}

Environment Environment::sun_sky(const SunSkyOptions& options) {
  const float length = glm::length(options.sun_direction);
  const vec3 towards_sun =
      length > 0 && std::isfinite(length) ? options.sun_direction / length : vec3(0.0f, 1.0f, 0.0f);
  const bool sun_is_up = towards_sun.y > 0;
  vec3 sky_sun = towards_sun;  // what the model sees: never below the horizon
  if (!sun_is_up) {
    const vec3 level(towards_sun.x, 0.0f, towards_sun.z);
    sky_sun = glm::length(level) > 0 ? glm::normalize(level) : vec3(1.0f, 0.0f, 0.0f);
  }
  const PreethamSky model(sky_sun, std::clamp(options.turbidity, 1.7f, 10.0f));

  // The model's sun at the horizon is so dim that the sky would outshine any picture: below 10 klx the ratio is held.
  constexpr float kDimmestSunKlx = 10.0f;
  const float model_sun = luminance(model.sun_irradiance());
  Sky sky{model, options.sun_irradiance / std::max(model_sun, kDimmestSunKlx)};

  DistantLight sun{towards_sun, vec3(0.0f), options.sun_angle_rad};
  vec3 ground_irradiance = sky.irradiance();
  if (sun_is_up && options.sun_irradiance > 0) {
    const vec3 color = options.sun_color.value_or(model.sun_irradiance());
    sun.irradiance = color * (options.sun_irradiance / std::max(luminance(color), 1e-20f));
    ground_irradiance += sun.irradiance * towards_sun.y;
  }
  sky.ground = options.ground_albedo * kInvPi * ground_irradiance;

  LatLongDistribution cells(kSkyGrid, cell_luminances(sky));
  return Environment(std::make_shared<Impl>(Impl{kSkyGrid, std::move(cells), {}, sky, {}, 1.0f})).with({&sun, 1});
}

Environment Environment::with(std::span<const DistantLight> lights) const {
  auto impl = std::make_shared<Impl>(*impl_);
  for (const DistantLight& light : lights)
    if (max_component(light.irradiance) > 0) impl->discs.push_back(make_disc(light));
  impl->share_samples();
  return Environment(std::move(impl));
}

Result<Environment> Environment::from_image(const Image& image, float scale) {
  if (image.values.empty() || image.channel_count() < 3)
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("an environment needs an image with R, G and B; this one has {} x {} pixels and {} "
                                  "channels",
                                  image.width, image.height, image.channel_count()));
  const LatLongGrid grid{image.width, image.height};
  std::vector<vec3> texels;
  std::vector<float> weights;
  texels.reserve(grid.cell_count());
  weights.reserve(grid.cell_count());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float* pixel = image.pixel(x, y);
      texels.push_back(scale * vec3(cleaned(pixel[0]), cleaned(pixel[1]), cleaned(pixel[2])));
      weights.push_back(luminance(texels.back()));
    }
  }
  LatLongDistribution cells(grid, weights);
  return Environment(std::make_shared<Impl>(Impl{grid, std::move(cells), std::move(texels), {}, {}, 1.0f}));
}

namespace {

// Radiance's .hdr, which OpenImageIO reads.
Result<Image> read_hdr(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    return make_error(ErrorCode::NotFound, fmt::format("{}: no such file", path.string()));
  FARFIELD_TRY_LET(const auto module, texture_module());
  FARFIELD_TRY_LET(auto decoded, module->read_file(path.string()));
  if (!decoded.is_float || decoded.channels != 3)
    return make_error(ErrorCode::BadFile, fmt::format("{}: not a picture of light (Radiance HDR)", path.string()));
  Image image(decoded.width, decoded.height, {"R", "G", "B"});
  image.values = std::move(decoded.values);
  return image;
}

Result<Image> read_light(const std::filesystem::path& path) {
  if (path.extension() == ".hdr" || path.extension() == ".HDR") return read_hdr(path);
  FARFIELD_TRY_LET(auto file, read_exr(path));
  return std::move(file.image);
}

}  // namespace

Result<Environment> Environment::from_file(const std::filesystem::path& path, float scale) {
  FARFIELD_TRY_LET(const auto image, read_light(path));
  auto environment = from_image(image, scale);
  if (!environment)
    return make_error(environment.error().code, fmt::format("{}: {}", path.string(), environment.error().message));
  return environment;
}

namespace {

// Of what fills the sphere: each pixel the mean over a lattice of directions.
Image background_image(const LatLongGrid& grid, const std::function<vec3(const vec3&)>& radiance) {
  Image image(grid.width, grid.height, {"R", "G", "B"});
  constexpr float kStep = 1.0f / kSkySubsamples;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      vec3 sum(0.0f);
      for (int j = 0; j < kSkySubsamples; ++j)
        for (int i = 0; i < kSkySubsamples; ++i)
          sum += radiance(grid.direction(float(x) + (float(i) + 0.5f) * kStep, float(y) + (float(j) + 0.5f) * kStep));
      sum *= kStep * kStep;
      std::copy_n(&sum.x, 3, image.pixel(x, y));
    }
  }
  return image;
}

// Spreads a disc's light over the pixels that it meets, as points: none of it is lost, however small it is.
void add_disc(const SunDisc& disc, const LatLongGrid& grid, Image& image) {
  constexpr int kPoints = 1 << 14;
  Rng rng(0);
  for (int i = 0; i < kPoints; ++i) {
    const size_t cell = grid.cell(disc.sample(rng));
    const auto solid_angle = static_cast<float>(grid.solid_angle(static_cast<int>(cell) / grid.width));
    const vec3 share = disc.radiance * (disc.solid_angle / (kPoints * solid_angle));
    for (size_t c = 0; c < 3; ++c) image.values[3 * cell + c] += share[static_cast<int>(c)];
  }
}

}  // namespace

Image Environment::to_image(int width) const {
  const LatLongGrid grid{std::max(width, 2), std::max(width, 2) / 2};
  Image image = background_image(grid, [this](const vec3& wi) { return impl_->background(wi); });
  for (const SunDisc& disc : impl_->discs) add_disc(disc, grid, image);
  return image;
}

vec3 Environment::radiance(const vec3& wi) const {
  vec3 sum = impl_->background(wi);
  for (const SunDisc& disc : impl_->discs)
    if (disc.contains(wi)) sum += disc.radiance;
  return sum;
}

EnvironmentSample Environment::sample(float choice, Rng& rng) const {
  const auto from = [&](const vec3& wi) { return EnvironmentSample{wi, radiance(wi), pdf(wi)}; };
  for (const SunDisc& disc : impl_->discs) {
    if (choice < disc.probability) return from(disc.sample(rng));
    choice -= disc.probability;
  }
  return impl_->cells.integral() > 0 ? from(impl_->cells.sample(rng)) : EnvironmentSample();
}

float Environment::pdf(const vec3& wi) const {
  float density = impl_->cell_probability * impl_->cell_pdf(wi);
  for (const SunDisc& disc : impl_->discs)
    if (disc.contains(wi)) density += disc.probability / disc.solid_angle;
  return density;
}

}  // namespace farfield
