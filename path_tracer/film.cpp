// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/film.h"

#include <algorithm>

#include "base/check.h"

namespace farfield {

namespace {

// Where the channels of Film::image() begin.
enum Channel : size_t { kColor = 0, kLod = 4, kAlbedo = 8, kNormal = 11, kDepth = 14, kIds = 15 };

std::vector<std::string> channel_names(bool ids) {
  std::vector<std::string> names = {
      "R",        "G",        "B",   "A",   "lod.level", "lod.blend", "lod.footprint", "lod.volume", "albedo.R",
      "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z",       "Z"};
  FARFIELD_CHECK(names.size() == kIds);
  if (!ids) return names;
  for (const char* layer : kIdLayerNames)
    for (std::string& name : cryptomatte_channels(layer)) names.push_back(std::move(name));
  return names;
}

template <typename Vector>
void store_mean(float* to, const Vector& sum, double count) {
  const Vector mean = sum / std::max(count, 1.0);
  for (int i = 0; i < Vector::length(); ++i) to[i] = static_cast<float>(mean[i]);
}

}  // namespace

void PixelSums::add(const FilmSample& sample) {
  Part& half = halves_[static_cast<uint64_t>(halves_[0].count + halves_[1].count) % 2];
  half.rgba += glm::dvec4(dvec3(sample.color), sample.alpha);
  half.count += 1;
  if (counts_ids_)
    for (size_t layer = 0; layer < ids_.size(); ++layer) ids_[layer].add(sample.alpha > 0 ? sample.ids[layer] : 0);
  if (sample.alpha <= 0) return;
  lod_ += glm::dvec4(sample.lod_level, sample.lod_blend, sample.footprint, sample.lod_volume);
  albedo_ += dvec3(sample.albedo);
  normal_ += dvec3(sample.normal);
  depth_ = std::min(depth_, sample.depth);
  hits_ += 1;
}

Film::Film(int width, int height, const FilmOptions& options)
    : has_ids_(options.ids), image_(width, height, channel_names(options.ids)) {
  if (!options.half_buffers) return;
  for (Image& half : halves_) half = Image(width, height, {"R", "G", "B", "A"});
}

void Film::set_pixel(int x, int y, const PixelSums& sums) {
  FARFIELD_ASSERT(x >= 0 && x < width() && y >= 0 && y < height());
  const auto& [even, odd] = sums.halves_;
  const double count = even.count + odd.count;
  float* pixel = image_.pixel(x, y);
  store_mean(pixel + kColor, even.rgba + odd.rgba, count);
  store_mean(pixel + kLod, sums.lod_, sums.hits_);
  store_mean(pixel + kAlbedo, sums.albedo_, count);
  store_mean(pixel + kNormal, sums.normal_, count);
  pixel[kDepth] = sums.depth_;
  if (has_ids_)
    for (size_t layer = 0; layer < sums.ids_.size(); ++layer)
      sums.ids_[layer].store_ranked(pixel + kIds + layer * 2 * kCryptomatteRanks);
  if (!has_half_buffers()) return;
  store_mean(halves_[0].pixel(x, y), even.rgba, even.count);
  store_mean(halves_[1].pixel(x, y), odd.rgba, odd.count);
}

}  // namespace farfield
