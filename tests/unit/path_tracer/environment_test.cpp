// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/environment.h"

#include <gtest/gtest.h>

#include <array>

#include "path_tracer/preetham_sky.h"
#include "tests/support/files.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

struct NamedEnvironment {
  std::string name;
  Environment environment;
};

Image gradient_image() {
  Image image(12, 6, {"R", "G", "B"});
  Rng rng(5);
  for (float& value : image.values) value = rng.next() < 0.2f ? 0.0f : 4 * rng.next();
  return image;
}

std::vector<NamedEnvironment> sample_environments() {
  std::vector<NamedEnvironment> all = {{"constant", Environment::constant({0.2f, 0.4f, 0.9f})},
                                       {"image", *Environment::from_image(gradient_image(), 3.0f)}};
  for (const float height : {1.0f, 0.3f, 0.01f, -0.5f}) {
    SunSkyOptions options;
    options.sun_direction = {0.5f, height, -0.2f};
    options.sun_angle_rad = 0.2f;  // wide enough for the chi-square test's cells and for quadrature
    all.push_back({"sun and sky at height " + std::to_string(height), Environment::sun_sky(options)});
  }
  const DistantLight lights[] = {{{0, 1, 0}, {1, 2, 3}, 0.2f}, {{0.6f, 0, 0.8f}, {3, 2, 1}, 0.4f}};
  all.push_back({"two lights and an image", Environment::from_image(gradient_image())->with(lights)});
  all.push_back({"two lights and nothing else", Environment::constant(vec3(0.0f)).with(lights)});
  return all;
}

// Integral over the sphere of a function with a disc: plain Monte Carlo, uniform directions. Returns mean and error.
struct Estimate {
  dvec3 mean{0.0}, error{0.0};
};
template <typename Draw>
Estimate estimate(int count, Draw&& draw) {
  dvec3 sum(0.0), squares(0.0);
  for (int i = 0; i < count; ++i) {
    const dvec3 value(draw());
    sum += value;
    squares += value * value;
  }
  const dvec3 mean = sum / double(count);
  return {mean, glm::sqrt(glm::max(squares / double(count) - mean * mean, dvec3(0.0)) / double(count))};
}

// 4.9 sigma two-sided is 1e-6; there are some tens of comparisons here.
constexpr double kSigmas = 4.9;

void expect_agree(const Estimate& a, const Estimate& b, const std::string& name) {
  for (int c = 0; c < 3; ++c)
    EXPECT_LE(std::abs(a.mean[c] - b.mean[c]), kSigmas * std::hypot(a.error[c], b.error[c]) + 1e-6 * b.mean[c])
        << name << ": " << a.mean[c] << " +- " << a.error[c] << " and " << b.mean[c] << " +- " << b.error[c];
}

TEST(Environment, SamplesFollowThePdf) {
  for (const auto& [name, environment] : sample_environments()) {
    test::ChiSquareOptions options;
    // Densities here have steps: cells, horizon, disc. The quadrature's error stays below the noise of few samples.
    options.nodes_per_bin = 64;
    options.samples = 20000;
    options.axis = {0, 1, 0};
    const Environment& drawn = environment;
    const double p =
        test::chi_square_p_value([&](Rng& rng) { return dvec3(drawn.sample(rng).wi); },
                                 [&](const dvec3& wi) { return static_cast<double>(drawn.pdf(vec3(wi))); }, options);
    EXPECT_GT(p, test::kSignificance) << name;
  }
}

TEST(Environment, ImportanceSamplingAndUniformSamplingSeeTheSameLight) {
  constexpr int kCount = 400000;
  for (const auto& [name, environment] : sample_environments()) {
    const Environment& light = environment;
    Rng rng(17);
    // Irradiance on two opposite surfaces, so that position matters, not only power.
    for (const vec3& normal : {vec3(0.6f, 0.8f, 0.0f), vec3(-0.6f, -0.8f, 0.0f)}) {
      const auto cosine = [&](const vec3& wi) { return std::max(glm::dot(wi, normal), 0.0f); };
      const Estimate uniform = estimate(kCount, [&] {
        const vec3 wi(test::random_direction(rng));
        return light.radiance(wi) * (4 * kPi * cosine(wi));
      });
      const Estimate importance = estimate(kCount, [&] {
        const EnvironmentSample sample = light.sample(rng);
        return sample.pdf > 0 ? sample.radiance * (cosine(sample.wi) / sample.pdf) : vec3(0.0f);
      });
      expect_agree(importance, uniform, name);
      if (normal.y > 0 && name != "constant") {
        EXPECT_LE(importance.error.y, 1.05 * uniform.error.y) << name;
      }
    }
  }
}

TEST(Environment, PdfAndRadianceOfSamplesAreThoseOfTheirDirections) {
  for (const auto& [name, environment] : sample_environments()) {
    Rng rng(23);
    for (int i = 0; i < 2000; ++i) {
      const EnvironmentSample sample = environment.sample(rng);
      ASSERT_NEAR(glm::length(sample.wi), 1.0f, 1e-5f) << name;
      ASSERT_GT(sample.pdf, 0.0f) << name;
      ASSERT_EQ(sample.pdf, environment.pdf(sample.wi)) << name;
      ASSERT_EQ(sample.radiance, environment.radiance(sample.wi)) << name;
    }
  }
}

TEST(Environment, BlackGivesNoSamples) {
  Rng rng(1);
  for (const Environment& black :
       {Environment::constant(vec3(0.0f)), *Environment::from_image(Image(4, 2, {"R", "G", "B"}))}) {
    EXPECT_EQ(black.sample(rng).pdf, 0.0f);
    EXPECT_EQ(black.pdf({0, 1, 0}), 0.0f);
    EXPECT_EQ(black.radiance({0, 1, 0}), vec3(0.0f));
  }
}

TEST(Environment, SunGivesTheIrradianceThatWasAskedForWhateverItsSize) {
  for (const float angle : {0.0093f, 0.001f, 0.3f}) {
    SunSkyOptions options;
    options.sun_direction = {0.3f, 0.8f, 0.1f};
    options.sun_angle_rad = angle;
    options.sun_color = vec3(1.0f, 0.5f, 0.25f);
    const vec3 towards_sun = glm::normalize(options.sun_direction);
    const Environment environment = Environment::sun_sky(options);
    // The sky just beside the disc is what the disc stands on.
    const vec3 side = glm::normalize(glm::cross(towards_sun, vec3(0, 0, 1)));
    const vec3 sky = environment.radiance(glm::normalize(towards_sun + 0.52f * angle * side));
    const vec3 disc = environment.radiance(towards_sun) - sky;
    const float sin_edge = std::sin(0.5f * angle);
    const vec3 irradiance = disc * (kPi * sin_edge * sin_edge);
    EXPECT_NEAR(luminance(irradiance), options.sun_irradiance, 0.01f * options.sun_irradiance) << angle;
    EXPECT_NEAR(irradiance.y / irradiance.x, 0.5f, 0.01f) << angle;
  }
}

TEST(Environment, DrawsTheRealSunAboutAsOftenAsItsShareOfTheLight) {
  SunSkyOptions options;
  options.sun_direction = {0.3f, 0.7f, 0.4f};
  const Environment environment = Environment::sun_sky(options);
  const vec3 sun = glm::normalize(options.sun_direction);
  Rng rng(4);
  int in_disc = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) in_disc += glm::length(environment.sample(rng).wi - sun) < 0.00466f;
  EXPECT_GT(in_disc, kCount / 5);
  EXPECT_LT(in_disc, kCount * 4 / 5);
}

TEST(Environment, OddSunsGiveFiniteSkies) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const vec3& direction :
       {vec3(0.0f), vec3(nan), vec3(0, -1, 0), vec3(1, 0, 0), vec3(0, 1e-30f, 0), vec3(0, 1, 0)}) {
    for (const float turbidity : {-3.0f, 1.7f, 10.0f, 1000.0f}) {
      SunSkyOptions options;
      options.sun_direction = direction;
      options.turbidity = turbidity;
      const Environment environment = Environment::sun_sky(options);
      Rng rng(9);
      for (int i = 0; i < 200; ++i) {
        const vec3 radiance = environment.radiance(vec3(test::random_direction(rng)));
        ASSERT_TRUE(is_finite(radiance) && min_component(radiance) >= 0);
        ASSERT_GT(environment.sample(rng).pdf, 0.0f);
      }
    }
  }
}

TEST(Environment, ImagesNeedTexelsAndThreeChannels) {
  EXPECT_EQ(Environment::from_image(Image()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(Environment::from_image(Image(4, 2, {"R", "G"})).error().code, ErrorCode::InvalidArgument);
}

TEST(Environment, BadTexelsCountAsBlack) {
  Image image(2, 1, {"R", "G", "B"});
  image.values = {std::numeric_limits<float>::quiet_NaN(), -1.0f, 2.0f, std::numeric_limits<float>::infinity(), 1, 1};
  const auto environment = Environment::from_image(image);
  EXPECT_EQ(environment->radiance({-1, 0, 0}), vec3(0, 0, 2));
  EXPECT_EQ(environment->radiance({1, 0, 0}), vec3(0, 1, 1));
}

TEST(Environment, ReadsLatLongExrFiles) {
  const test::TemporaryFolder folder;
  Image image(4, 2, {"R", "G", "B"});
  image.pixel(3, 0)[1] = 5.0f;  // upper half, from +x to behind
  ASSERT_TRUE(write_exr(folder.path() / "light.exr", image));
  const auto environment = Environment::from_file(folder.path() / "light.exr", 2.0f);
  ASSERT_TRUE(environment);
  EXPECT_EQ(environment->radiance(glm::normalize(vec3(1, 1, 1))), vec3(0, 10, 0));
  EXPECT_EQ(environment->radiance(glm::normalize(vec3(1, 1, -1))), vec3(0.0f));
  const auto missing = Environment::from_file(folder.path() / "none.exr");
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_NE(missing.error().message.find("none.exr"), std::string::npos);
}

// A picture in Radiance's format without run lengths: a row of width pixels of three mantissas and an exponent.
std::string hdr_file(const std::vector<std::array<uint8_t, 4>>& pixels) {
  std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X " + std::to_string(pixels.size()) + "\n";
  for (const auto& pixel : pixels) file.append(reinterpret_cast<const char*>(pixel.data()), 4);
  return file;
}

TEST(Environment, ReadsRadianceHdrFiles) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "light.hdr";
  test::write_text(path, hdr_file({{128, 64, 0, 130}, {128, 128, 128, 129}}));  // mantissa / 256 * 2^(exponent - 128)
  const auto environment = Environment::from_file(path);
  ASSERT_TRUE(environment) << environment.error().message;
  const vec3 left = environment->radiance({-1, 0, 0}), right = environment->radiance({1, 0, 0});
  EXPECT_LT(glm::length(left - vec3(2, 1, 0)), 0.02f);
  EXPECT_LT(glm::length(right - vec3(1, 1, 1)), 0.02f);

  EXPECT_EQ(Environment::from_file(folder.path() / "none.hdr").error().code, ErrorCode::NotFound);
  for (const std::string& bad : {std::string("#?RADIANCE\n"), std::string(), std::string("P6 1 1 255 abc")}) {
    test::write_text(path, bad);
    const auto refused = Environment::from_file(path);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("light.hdr"), std::string::npos) << refused.error().message;
  }
}

TEST(Environment, PicturesOfLightHoldAllOfIt) {
  // A sun of half a degree in pixels of three: seen from the picture, surfaces get the same light.
  for (const auto& [name, environment] : sample_environments()) {
    const auto picture = Environment::from_image(environment.to_image(128));
    ASSERT_TRUE(picture);
    for (const vec3& normal : {vec3(0, 1, 0), vec3(0.6f, 0.48f, 0.64f), vec3(0, -1, 0)}) {
      const auto irradiance = [&](const Environment& light) {
        Rng rng(8);
        return estimate(100000, [&] {
          const EnvironmentSample sample = light.sample(rng);
          return sample.pdf > 0 ? sample.radiance * (std::max(glm::dot(sample.wi, normal), 0.0f) / sample.pdf)
                                : vec3(0.0f);
        });
      };
      const Estimate ours = irradiance(environment), theirs = irradiance(*picture);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(theirs.mean[c], ours.mean[c],
                    0.01 * ours.mean[c] + kSigmas * std::hypot(ours.error[c], theirs.error[c]))
            << name;
    }
  }
}

TEST(Environment, SkyAndGroundMeetWithoutAnEdge) {
  const Environment environment = Environment::sun_sky(default_sun_sky());
  for (int i = 0; i < 16; ++i) {
    const float azimuth = 2 * kPi * (static_cast<float>(i) + 0.5f) / 16;
    const auto at = [&](float degrees) {
      const float height = degrees * kPi / 180;
      return environment.radiance(
          {std::cos(height) * std::sin(azimuth), std::sin(height), -std::cos(height) * std::cos(azimuth)});
    };
    for (float degrees = -5; degrees < 5; degrees += 0.05f)
      EXPECT_LT(glm::length(at(degrees + 0.05f) - at(degrees)), 0.03f * glm::length(at(degrees))) << degrees;
  }
}

TEST(PreethamSky, IsBlueOverheadAndBrighterTowardsTheSun) {
  const vec3 sun = glm::normalize(vec3(1.0f, 0.8f, 0.0f));
  const PreethamSky sky(sun, 3.0f);
  const vec3 zenith = sky.radiance({0, 1, 0});
  EXPECT_GT(zenith.z, 1.5f * zenith.x);
  const vec3 near_sun = glm::normalize(vec3(1.0f, 0.9f, 0.0f)), opposite = glm::normalize(vec3(-1.0f, 0.9f, 0.0f));
  EXPECT_GT(luminance(sky.radiance(near_sun)), 2 * luminance(sky.radiance(opposite)));
}

TEST(PreethamSky, HasTheBrightnessOfRealSkies) {
  // Clear skies: some 10 to 20 klx of sky light on the ground and 60 to 110 klx of sun on a surface that faces it.
  // At turbidity 3 the model's skies are half as bright again.
  for (const float height : {0.5f, 1.0f, 2.0f}) {
    const PreethamSky sky(glm::normalize(vec3(1.0f, height, 0.0f)), 3.0f);
    const double irradiance = test::integrate_sphere(
        [&](const dvec3& wi) { return wi.y > 0 ? wi.y * static_cast<double>(luminance(sky.radiance(vec3(wi)))) : 0.0; },
        64, {0, 1, 0});
    EXPECT_GT(irradiance, 7) << height;
    EXPECT_LT(irradiance, 35) << height;
    EXPECT_GT(luminance(sky.sun_irradiance()), 50) << height;
    EXPECT_LT(luminance(sky.sun_irradiance()), 110) << height;
  }
}

TEST(PreethamSky, SunReddensTowardsTheHorizon) {
  float last = 0;
  for (const float height : {5.0f, 1.0f, 0.3f, 0.05f}) {
    const vec3 sun = PreethamSky(glm::normalize(vec3(1.0f, height, 0.0f)), 3.0f).sun_irradiance();
    EXPECT_GT(sun.x / sun.z, last);
    last = sun.x / sun.z;
  }
}

}  // namespace
}  // namespace farfield
