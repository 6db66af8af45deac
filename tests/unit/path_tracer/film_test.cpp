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

TEST(Film, NoSamplesAreBlackNotNaN) {
  Film film(1, 1, true);
  film.set_pixel(0, 0, PixelSums());
  for (const float value : film.image().values) EXPECT_EQ(value, 0.0f);
  for (const float value : film.half(1).values) EXPECT_EQ(value, 0.0f);
}

TEST(Film, HalvesAreEvenAndOddSamples) {
  Film film(1, 1, true);
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
