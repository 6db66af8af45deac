// SPDX-License-Identifier: Apache-2.0
// Every environment is a table of cells that directions are drawn from, plus, for the sky, a disc that is drawn apart:
// it is far smaller than a cell and carries about half of the light. The density is the mixture of the two.
#include "path_tracer/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/result.h"
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

SunDisc make_disc(const vec3& direction, float angle_rad, const vec3& irradiance) {
  SunDisc disc;
  disc.direction = direction;
  const float half_chord = std::sin(0.25f * angle_rad);  // the edge is angle / 2 from the centre
  disc.chord2 = 4 * half_chord * half_chord;
  disc.solid_angle = kPi * disc.chord2;
  // A surface that faces a cone of half angle a receives pi sin^2(a) times its radiance.
  const float sin_edge = std::sin(0.5f * angle_rad);
  disc.radiance = irradiance / (kPi * sin_edge * sin_edge);
  return disc;
}

// The sky above, and below the horizon the ground that it lights.
struct Sky {
  PreethamSky model;
  float scale;  ///< of the model's kcd / m^2
  vec3 ground{0.0f};

  vec3 radiance(const vec3& wi) const { return wi.y < 0 ? ground : scale * model.radiance(wi); }
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
  std::optional<SunDisc> disc;
  float disc_probability = 0;  ///< share of the samples that the disc gets

  vec3 background(const vec3& wi) const { return sky ? sky->radiance(wi) : texels[grid.cell(wi)]; }
  float cell_pdf(const vec3& wi) const { return cells.integral() > 0 ? cells.pdf(wi) : 0.0f; }
};

Environment Environment::constant(const vec3& radiance) {
  const LatLongGrid grid{1, 1};
  const float weight[] = {luminance(radiance)};
  return Environment(std::make_shared<Impl>(Impl{grid, LatLongDistribution(grid, weight), {radiance}, {}, {}, 0.0f}));
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

  std::optional<SunDisc> disc;
  vec3 ground_irradiance = sky.irradiance();
  if (sun_is_up && options.sun_irradiance > 0) {
    vec3 color = options.sun_color.value_or(model.sun_irradiance());
    color /= std::max(luminance(color), 1e-20f);
    const vec3 irradiance = options.sun_irradiance * color;
    disc = make_disc(towards_sun, std::clamp(options.sun_angle_rad, 1e-3f, 1.0f), irradiance);
    ground_irradiance += irradiance * towards_sun.y;
  }
  sky.ground = options.ground_albedo * kInvPi * ground_irradiance;

  LatLongDistribution cells(kSkyGrid, cell_luminances(sky));
  float disc_probability = 0;
  if (disc) {
    const double disc_power = static_cast<double>(luminance(disc->radiance) * disc->solid_angle);
    disc_probability = static_cast<float>(disc_power / (disc_power + cells.integral()));
  }
  return Environment(std::make_shared<Impl>(Impl{kSkyGrid, std::move(cells), {}, sky, disc, disc_probability}));
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
  return Environment(std::make_shared<Impl>(Impl{grid, std::move(cells), std::move(texels), {}, {}, 0.0f}));
}

Result<Environment> Environment::from_exr(const std::filesystem::path& path, float scale) {
  FARFIELD_TRY_LET(const auto file, read_exr(path));
  auto environment = from_image(file.image, scale);
  if (!environment)
    return make_error(environment.error().code, fmt::format("{}: {}", path.string(), environment.error().message));
  return environment;
}

vec3 Environment::radiance(const vec3& wi) const {
  const bool in_disc = impl_->disc && impl_->disc->contains(wi);
  return impl_->background(wi) + (in_disc ? impl_->disc->radiance : vec3(0.0f));
}

EnvironmentSample Environment::sample(float choice, Rng& rng) const {
  EnvironmentSample sample;
  if (choice < impl_->disc_probability) {
    sample.wi = impl_->disc->sample(rng);
  } else {
    if (!(impl_->cells.integral() > 0)) return sample;
    sample.wi = impl_->cells.sample(rng);
  }
  sample.radiance = radiance(sample.wi);
  sample.pdf = pdf(sample.wi);
  return sample;
}

float Environment::pdf(const vec3& wi) const {
  float density = (1 - impl_->disc_probability) * impl_->cell_pdf(wi);
  if (impl_->disc && impl_->disc->contains(wi)) density += impl_->disc_probability / impl_->disc->solid_angle;
  return density;
}

}  // namespace farfield
