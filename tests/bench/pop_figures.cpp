// SPDX-License-Identifier: Apache-2.0
// How far does the picture of a baked asset jump where lambda passes a level, and over the levels around it?
//
//   build/release/bin/pop_figures ASSET.farfield [morph]
//
// For each stored level k: the same view with the same random numbers at lambda k - 1e-3 and k + 1e-3 (the pop of
// docs/error_metric.md, before two seeds are taken off), the same at k - 1e-3 with another seed, and how the mean
// changes over [k - 1/2, k + 1/2].
#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "evaluate/views.h"
#include "path_tracer/asset_view.h"

namespace farfield {
namespace {

constexpr int kSamplesPerPixel = 256;
constexpr float kBeside = 1e-3f;

Blend blend = Blend::Dissolve;

struct Picture {
  Image image;
  double mean = 0;
};

Result<Picture> render(const char* folder, float lambda, double pixel_size, uint64_t seed) {
  auto asset = AssetView::open(folder, lambda, uint64_t{1} << 36, blend);
  if (!asset) return tl::unexpected(asset.error());
  const OrthoView view =
      frame_view((*asset)->bounds(), glm::normalize(vec3(-1.0f, -0.3f, -0.6f)), static_cast<float>(pixel_size));
  ViewOptions options;
  options.center = view.center, options.direction = view.direction, options.up = view.up;
  options.width_world = view.width(), options.width = view.width_px, options.height = view.height_px;
  options.trace.samples_per_pixel = kSamplesPerPixel;
  options.trace.seed = seed;
  Lights lights;
  lights.environment = Environment::sun_sky(default_sun_sky());
  auto images = (*asset)->render(options, lights);
  if (!images) return tl::unexpected(images.error());
  Picture picture{std::move(images->mean), 0};
  for (const float value : picture.image.values) picture.mean += value;
  return picture;
}

/// Relative L1.
double difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (size_t i = 0; i < a.image.values.size(); ++i) sum += std::abs(a.image.values[i] - b.image.values[i]);
  return sum / a.mean;
}

Result<void> print_level(const char* folder, const LevelInfo& level) {
  const auto at = [&](float offset, uint64_t seed) {
    return render(folder, static_cast<float>(level.level) + offset, level.resolution, seed);
  };
  auto below = at(-kBeside, 1), above = at(kBeside, 1), other = at(-kBeside, 2), finer = at(-0.5f, 3),
       coarser = at(0.5f, 3);
  for (const auto* picture : {&below, &above, &other, &finer, &coarser}) {
    if (!*picture) return tl::unexpected(picture->error());
  }
  fmt::print("| {} | {:.2f} % | {:.2f} % | {:+.2f} % | {:+.2f} % |\n", level.level, 100 * difference(*below, *above),
             100 * difference(*below, *other), 100 * (below->mean / finer->mean - 1),
             100 * (coarser->mean / above->mean - 1));
  return {};
}

Result<void> print_all(const char* folder) {
  auto asset = AssetView::open(folder, 0);
  if (!asset) return tl::unexpected(asset.error());
  fmt::print(
      "| level | below and above | two seeds | mean, from half a level finer | mean, to half a level coarser |\n");
  fmt::print("|---|---|---|---|---|\n");
  for (const LevelInfo& level : (*asset)->levels()) {
    if (level.level == 0) continue;
    if (auto printed = print_level(folder, level); !printed) return printed;
  }
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  const bool morphs = argc == 3 && std::string_view(argv[2]) == "morph";
  if (argc != 2 && !morphs) {
    fmt::print(stderr, "usage: pop_figures ASSET.farfield [morph]\n");
    return 2;
  }
  if (morphs) farfield::blend = farfield::Blend::Morph;
  if (auto done = farfield::print_all(argv[1]); !done) {
    fmt::print(stderr, "pop_figures: {}\n", done.error().message);
    return 1;
  }
  return 0;
}
