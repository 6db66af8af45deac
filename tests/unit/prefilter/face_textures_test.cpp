// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_textures.h"

#include <gtest/gtest.h>

#include <random>

namespace farfield {
namespace {

std::shared_ptr<const Texture> image(int width, int height, const std::vector<vec4>& texels) {
  return std::make_shared<const Texture>(width, height, texels);
}

/// Random texels; alpha too if asked.
std::shared_ptr<const Texture> noise_image(int width, int height, bool with_alpha) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<float> any(0, 1);
  std::vector<vec4> texels;
  for (int i = 0; i < width * height; ++i) texels.emplace_back(any(rng), any(rng), any(rng), with_alpha ? any(rng) : 1);
  return image(width, height, texels);
}

SourceMaterial textured(std::shared_ptr<const Texture> base) {
  SourceMaterial m;
  m.base_color = vec3(1.0f);
  m.base_color_map.image = std::move(base);
  return m;
}

double uv_area(const UvTriangle& t) {
  const vec2 u = t[1] - t[0], v = t[2] - t[0];
  return 0.5 * std::abs(u.x * v.y - u.y * v.x);
}

void expect_close(const vec3& a, const vec3& b, float tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance);
}

TEST(FaceTextures, AverageIsTheIntegralOverTheTexels) {
  // Against brute force: very many points of the triangle, nearest texel.
  const auto noise = noise_image(16, 8, false);
  const SourceMaterial m = textured(noise);
  std::mt19937 rng(8);
  std::uniform_real_distribution<float> any(-1.5f, 2.5f);
  for (int run = 0; run < 20; ++run) {
    const UvTriangle t = {vec2(any(rng), any(rng)), vec2(any(rng), any(rng)), vec2(any(rng), any(rng))};
    const int n = 1500;
    dvec3 sum(0.0);
    double count = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        const float s = (static_cast<float>(i) + 1.0f / 3) / n, r = (static_cast<float>(j) + 1.0f / 3) / n;
        const vec2 uv = t[0] + s * (t[1] - t[0]) + r * (t[2] - t[0]);
        const int x = static_cast<int>(std::floor(uv.x * 16)) & 15, y = static_cast<int>(std::floor(uv.y * 8)) & 7;
        sum += dvec3(noise->texel(noise->level(0), x, y));
        ++count;
      }
    }
    expect_close(average_textures(m, t).dielectric, vec3(sum / count), 3e-3f);
  }
}

TEST(FaceTextures, PartsAverageToTheWhole) {
  // With alpha as weight the parts count by the alpha that they hold.
  for (const bool with_alpha : {false, true}) {
    SourceMaterial m = textured(noise_image(32, 32, with_alpha));
    const auto alpha_of = [&](const UvTriangle& t) {
      SourceMaterial as_color = textured(image(32, 32, [&] {
        std::vector<vec4> texels;
        const Texture& im = *m.base_color_map.image;
        for (int i = 0; i < 32 * 32; ++i) texels.emplace_back(vec3(im.texel(im.level(0), i % 32, i / 32).w), 1.0f);
        return texels;
      }()));
      return average_textures(as_color, t).dielectric.x;
    };
    const UvTriangle whole = {vec2(0.1f, 0.05f), vec2(0.93f, 0.3f), vec2(0.4f, 0.88f)};
    const vec2 centre = 0.2f * whole[0] + 0.5f * whole[1] + 0.3f * whole[2];
    vec3 sum(0.0f);
    float weights = 0;
    for (size_t k = 0; k < 3; ++k) {
      const UvTriangle part = {whole[k], whole[(k + 1) % 3], centre};
      const float weight = static_cast<float>(uv_area(part)) * (with_alpha ? alpha_of(part) : 1.0f);
      sum += weight * average_textures(m, part).dielectric;
      weights += weight;
    }
    expect_close(sum / weights, average_textures(m, whole).dielectric, 2e-4f);
  }
}

TEST(FaceTextures, WholeImageAveragesToItsMeanHoweverOftenItRepeats) {
  const SourceMaterial m = textured(noise_image(37, 21, false));
  const vec3 mean(m.base_color_map.image->mean());
  for (const float repeat : {1.0f, 3.0f, 200.0f, 1e5f}) {
    const UvTriangle a = {vec2(0, 0), vec2(repeat, 0), vec2(repeat, repeat)};
    const UvTriangle b = {vec2(0, 0), vec2(repeat, repeat), vec2(0, repeat)};
    const vec3 both = 0.5f * (average_textures(m, a).dielectric + average_textures(m, b).dielectric);
    expect_close(both, mean, 1e-3f);
  }
}

TEST(FaceTextures, CoarserLevelsAgreeWithTheFullImage) {
  // A smooth image, large enough that its whole area is averaged from a smaller level.
  const int n = 512;
  std::vector<vec4> texels;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) texels.emplace_back((float(x) + 0.5f) / n, (float(y) + 0.5f) / n, 0.5f, 1.0f);
  }
  const SourceMaterial m = textured(image(n, n, texels));
  const UvTriangle t = {vec2(0.05f, 0.1f), vec2(0.9f, 0.2f), vec2(0.3f, 0.95f)};
  const vec2 centre = (t[0] + t[1] + t[2]) / 3.0f;  // the mean of a linear function
  expect_close(average_textures(m, t).dielectric, vec3(centre, 0.5f), 2e-3f);
}

TEST(FaceTextures, ColourUnderTransparentTexelsDoesNotBleedIn) {
  SourceMaterial m = textured(image(2, 1, {vec4(1, 0, 0, 1), vec4(0, 1, 0, 0)}));
  m.alpha_mode = AlphaMode::Mask;
  const UvTriangle t = {vec2(0, 0), vec2(1, 0), vec2(1, 1)};
  expect_close(average_textures(m, t).dielectric, vec3(1, 0, 0), 1e-4f);
}

TEST(FaceTextures, UnusableAndFlatCoordinatesGiveSomethingSensible) {
  const SourceMaterial m = textured(image(2, 1, {vec4(1, 0, 0, 1), vec4(0, 0, 1, 1)}));
  const float nan = std::nanf("");
  for (const vec2 bad : {vec2(nan, 0), vec2(1e9f, 0), vec2(0, -INFINITY)}) {
    expect_close(average_textures(m, {vec2(0, 0), bad, vec2(1, 1)}).dielectric, vec3(0.5f, 0, 0.5f), 1e-3f);
  }
  // All corners in one texel, as palette textures are used
  expect_close(average_textures(m, {vec2(0.25f, 0.5f), vec2(0.25f, 0.5f), vec2(0.25f, 0.5f)}).dielectric, vec3(1, 0, 0),
               1e-4f);
  // A line across both texels
  expect_close(average_textures(m, {vec2(0, 0.5f), vec2(1, 0.5f), vec2(0.5f, 0.5f)}).dielectric, vec3(0.5f, 0, 0.5f),
               0.02f);
}

TEST(FaceTextures, MetalTexelsTakeTheirColourIntoTheHighlight) {
  // Left half red dielectric, right half green metal: channels average as if the face were cut in two.
  SourceMaterial m = textured(image(2, 1, {vec4(1, 0, 0, 1), vec4(0, 1, 0, 1)}));
  m.metallic_roughness_map.image = image(2, 1, {vec4(0, 0.5f, 0, 1), vec4(0, 1, 1, 1)});
  m.metallic = 1;
  m.dielectric_f0 = vec3(0.04f);
  const UvTriangle halves[2] = {{vec2(0, 0), vec2(0.25f, 0), vec2(0.25f, 1)}, {vec2(0.75f, 0), vec2(1, 0), vec2(1, 1)}};
  const MaterialSample left = material_sample(m, average_textures(m, halves[0]), vec3(1.0f));
  const MaterialSample right = material_sample(m, average_textures(m, halves[1]), vec3(1.0f));
  expect_close(left.diffuse, vec3(1, 0, 0), 1e-3f);
  expect_close(left.specular, vec3(0.04f), 1e-3f);
  EXPECT_NEAR(left.roughness, 0.5, 1e-3);
  expect_close(right.diffuse, vec3(0.0f), 1e-3f);
  expect_close(right.specular, vec3(0, 1, 0), 1e-3f);
  EXPECT_NEAR(right.roughness, 1, 1e-3);
}

TEST(FaceTextures, NoChannelEverReflectsMoreThanItGets) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<float> any(0, 1);
  for (int run = 0; run < 1000; ++run) {
    SourceMaterial m;
    m.base_color = vec3(any(rng), any(rng), 1);
    m.metallic = any(rng);
    m.dielectric_f0 = vec3(any(rng), 1, 0.04f);
    m.diffuse_transmission = any(rng);
    m.roughness = any(rng);
    const MaterialSample f = material_sample(m, average_textures(m, {}), vec3(2.0f, 1, 1));
    for (int c = 0; c < 3; ++c) {
      EXPECT_LE(f.specular[c], 1);
      EXPECT_LE(f.diffuse[c] + f.transmission[c], 1 + 1e-6f);  // of what the highlight leaves
      EXPECT_GE(std::min({f.diffuse[c], f.specular[c], f.transmission[c]}), 0.0f);
    }
  }
}

TEST(FaceTextures, ImageLevelsKeepTheMeanOfOddSizes) {
  const auto noise = noise_image(37, 21, true);
  vec4 mean(0.0f);
  for (int i = 0; i < 37 * 21; ++i) mean += noise->texel(noise->level(0), i % 37, i / 37) / (37.0f * 21.0f);
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(noise->mean()[c], mean[c], 2e-4);
}

}  // namespace
}  // namespace farfield
