// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/film.h"

#include <algorithm>

#include "base/check.h"

namespace farfield {

namespace {

void store_mean(float* to, const glm::dvec4& sum, double count) {
  const glm::dvec4 mean = sum / std::max(count, 1.0);
  for (int i = 0; i < 4; ++i) to[i] = static_cast<float>(mean[i]);
}

}  // namespace

void PixelSums::add(const FilmSample& sample) {
  Part& half = halves_[static_cast<uint64_t>(halves_[0].count + halves_[1].count) % 2];
  half.rgba += glm::dvec4(dvec3(sample.color), sample.alpha);
  half.count += 1;
  if (sample.alpha <= 0) return;
  lod_ += glm::dvec4(sample.lod_level, sample.lod_blend, sample.footprint, sample.lod_volume);
  hits_ += 1;
}

Film::Film(int width, int height, bool half_buffers)
    : image_(width, height, {"R", "G", "B", "A", "lod.level", "lod.blend", "lod.footprint", "lod.volume"}) {
  if (!half_buffers) return;
  for (Image& half : halves_) half = Image(width, height, {"R", "G", "B", "A"});
}

void Film::set_pixel(int x, int y, const PixelSums& sums) {
  FARFIELD_ASSERT(x >= 0 && x < width() && y >= 0 && y < height());
  const auto& [even, odd] = sums.halves_;
  store_mean(image_.pixel(x, y), even.rgba + odd.rgba, even.count + odd.count);
  store_mean(image_.pixel(x, y) + 4, sums.lod_, sums.hits_);
  if (!has_half_buffers()) return;
  store_mean(halves_[0].pixel(x, y), even.rgba, even.count);
  store_mean(halves_[1].pixel(x, y), odd.rgba, odd.count);
}

}  // namespace farfield
