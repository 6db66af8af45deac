// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/film.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

FilmSample hit(float value) {
  FilmSample sample;
  sample.color = vec3(value, 2 * value, 3 * value);
  sample.alpha = 1;
  sample.lod_level = value;
  sample.lod_blend = 0.25f;
  sample.footprint = 10 * value;
  sample.lod_volume = 1;
  return sample;
}

TEST(Film, PixelIsTheMeanOfItsSamples) {
  Film film(3, 2);
  PixelSums sums;
  for (const float value : {1.0f, 2.0f, 6.0f}) sums.add(hit(value));
  film.set_pixel(2, 1, sums);
  const float* pixel = film.image().pixel(2, 1);
  const std::vector<float> expected = {3, 6, 9, 1, 3, 0.25f, 30, 1};
  EXPECT_EQ(std::vector<float>(pixel, pixel + 8), expected);
  EXPECT_EQ(film.image().pixel(1, 1)[0], 0.0f);
}

TEST(Film, LodChannelsAreMeansOverHitsOnly) {
  Film film(1, 1);
  PixelSums sums;
  FilmSample miss;
  miss.color = vec3(4.0f);
  sums.add(hit(2));
  sums.add(miss);
  film.set_pixel(0, 0, sums);
  const float* pixel = film.image().pixel(0, 0);
  EXPECT_EQ(pixel[0], 3.0f);
  EXPECT_EQ(pixel[3], 0.5f);
  EXPECT_EQ(pixel[4], 2.0f);
  EXPECT_EQ(pixel[6], 20.0f);
}

TEST(Film, GuidesArePremultipliedAndDepthIsTheNearest) {
  Film film(1, 1);
  PixelSums sums;
  FilmSample near = hit(1), far = hit(1);
  near.albedo = {0.2f, 0.4f, 0.8f}, far.albedo = {0.4f, 0.4f, 0.0f};
  near.normal = {0, 0, 1}, far.normal = {0, 1, 0};
  near.depth = 3, far.depth = 70;
  for (const FilmSample& sample : {far, near, FilmSample(), FilmSample()}) sums.add(sample);
  film.set_pixel(0, 0, sums);
  const auto value = [&](const char* name) { return film.image().pixel(0, 0)[film.image().find_channel(name)]; };
  EXPECT_FLOAT_EQ(value("albedo.R"), 0.15f);
  EXPECT_FLOAT_EQ(value("albedo.B"), 0.2f);
  EXPECT_FLOAT_EQ(value("N.Y"), 0.25f);
  EXPECT_FLOAT_EQ(value("N.Z"), 0.25f);
  EXPECT_EQ(value("Z"), 3.0f);
}

TEST(Film, IdsComeWithTheirCoverage) {
  Film film(1, 1, {.ids = true});
  PixelSums sums(film.has_ids());
  FilmSample sample = hit(1), miss;
  sample.ids = {0x3f800000u, 0x40000000u};
  miss.ids[0] = 5;  // of nothing that was hit
  sums.add(sample), sums.add(miss);
  film.set_pixel(0, 0, sums);
  const auto value = [&](const char* name) { return film.image().pixel(0, 0)[film.image().find_channel(name)]; };
  EXPECT_EQ(value("CryptoObject00.R"), 1.0f);
  EXPECT_EQ(value("CryptoObject00.G"), 0.5f);
  EXPECT_EQ(value("CryptoObject00.A"), 0.0f);
  EXPECT_EQ(value("CryptoMaterial00.R"), 2.0f);
  EXPECT_EQ(value("CryptoMaterial00.G"), 0.5f);
}

TEST(Film, NoSamplesAreBlackAndFarNotNaN) {
  Film film(1, 1, {.half_buffers = true, .ids = true});
  film.set_pixel(0, 0, PixelSums());
  for (size_t c = 0; c < film.image().channel_count(); ++c)
    EXPECT_EQ(film.image().values[c], film.image().channels[c] == "Z" ? kNoDepth : 0.0f);
  for (const float value : film.half(1).values) EXPECT_EQ(value, 0.0f);
}

TEST(Film, HalvesAreEvenAndOddSamples) {
  Film film(1, 1, {.half_buffers = true});
  PixelSums sums;
  for (const float value : {1.0f, 10.0f, 3.0f, 30.0f, 5.0f}) sums.add(hit(value));
  film.set_pixel(0, 0, sums);
  EXPECT_EQ(film.half(0).pixel(0, 0)[0], 3.0f);
  EXPECT_EQ(film.half(1).pixel(0, 0)[0], 20.0f);
  EXPECT_FLOAT_EQ(film.image().pixel(0, 0)[0], 49.0f / 5);
}

TEST(Film, AMillionSamplesLoseNoPrecision) {
  Film film(1, 1);
  PixelSums sums;
  for (int i = 0; i < 1000000; ++i) sums.add(hit(0.1f));
  film.set_pixel(0, 0, sums);
  EXPECT_FLOAT_EQ(film.image().pixel(0, 0)[0], 0.1f);
}

}  // namespace
}  // namespace farfield
