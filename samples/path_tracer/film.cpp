// SPDX-License-Identifier: Apache-2.0
#include "samples/path_tracer/film.h"

#include "base/check.h"

namespace farfield {

namespace {

// A sum of many floats in double, so that the mean of a million samples is as good as that of ten.
struct Sums {
  glm::dvec4 rgba{0.0};
  glm::dvec4 lod{0.0};
  double count = 0;
  double hits = 0;

  void add(const FilmSample& sample) {
    rgba += glm::dvec4(dvec3(sample.color), sample.alpha);
    count += 1;
    if (sample.alpha <= 0) return;
    lod += glm::dvec4(sample.lod_level, sample.lod_blend, sample.footprint, sample.lod_volume);
    hits += 1;
  }
  glm::dvec4 mean_rgba() const { return count > 0 ? rgba / count : glm::dvec4(0.0); }
  glm::dvec4 mean_lod() const { return hits > 0 ? lod / hits : glm::dvec4(0.0); }
};

void store(float* to, const glm::dvec4& values) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<float>(values[i]);
}

}  // namespace

Film::Film(int width, int height, bool half_buffers)
    : image_(width, height, {"R", "G", "B", "A", "lod.level", "lod.blend", "lod.footprint", "lod.volume"}) {
  if (!half_buffers) return;
  for (Image& half : halves_) half = Image(width, height, {"R", "G", "B", "A"});
}

void Film::set_pixel(int x, int y, std::span<const FilmSample> samples) {
  FARFIELD_ASSERT(x >= 0 && x < width() && y >= 0 && y < height());
  Sums all, half_sums[2];
  for (size_t i = 0; i < samples.size(); ++i) {
    all.add(samples[i]);
    half_sums[i % 2].add(samples[i]);
  }
  store(image_.pixel(x, y), all.mean_rgba());
  store(image_.pixel(x, y) + 4, all.mean_lod());
  if (!has_half_buffers()) return;
  for (int i = 0; i < 2; ++i) store(halves_[i].pixel(x, y), half_sums[i].mean_rgba());
}

}  // namespace farfield
