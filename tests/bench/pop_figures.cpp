// SPDX-License-Identifier: Apache-2.0
// How far does the picture of a baked asset jump where lambda passes a level, and over the levels around it?
//
//   build/release/bin/pop_figures ASSET.farfield [morph]
//
// For each stored level k: the same view with the same random numbers at lambda k - 1e-3 and k + 1e-3 (the pop of
// docs/error_metric.md, before two seeds are taken off), the same at k - 1e-3 with another seed, and how the mean
// changes over [k - 1/2, k + 1/2]. Of what camera rays decide, shadow rays, and bounced ones.
#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "evaluate/views.h"
#include "path_tracer/asset_view.h"

namespace farfield {
namespace {

constexpr int kSamplesPerPixel = 256;
constexpr float kBeside = 1e-3f;

Blend blend = Blend::Dissolve;

/// What camera rays alone decide (coverage), what shadow rays add (direct light), and what bounced ones do (all light).
struct Picture {
  std::vector<float> coverage, direct, light;
};

Result<Image> render(const AssetView& asset, ViewOptions view, uint64_t seed, int max_depth) {
  view.trace.samples_per_pixel = kSamplesPerPixel;
  view.trace.seed = seed;
  view.trace.max_depth = max_depth;
  Lights lights;
  lights.environment = Environment::sun_sky(default_sun_sky());
  FARFIELD_TRY_LET(auto images, asset.render(view, lights));
  return std::move(images.mean);
}

Result<Picture> render(const char* folder, float lambda, double pixel_size, uint64_t seed) {
  FARFIELD_TRY_LET(const auto asset, AssetView::open(folder, lambda, uint64_t{1} << 36, blend));
  const OrthoView frame =
      frame_view(asset->bounds(), glm::normalize(vec3(-1.0f, -0.3f, -0.6f)), static_cast<float>(pixel_size));
  ViewOptions view;
  view.center = frame.center, view.direction = frame.direction, view.up = frame.up;
  view.width_world = frame.width(), view.width = frame.width_px, view.height = frame.height_px;
  FARFIELD_TRY_LET(const Image direct, render(*asset, view, seed, 1));
  FARFIELD_TRY_LET(const Image all, render(*asset, view, seed, TraceOptions().max_depth));
  Picture picture;
  for (size_t i = 0; i < all.values.size(); ++i) {
    if (i % 4 == 3) {
      picture.coverage.push_back(all.values[i]);
    } else {
      picture.direct.push_back(direct.values[i]);
      picture.light.push_back(all.values[i]);
    }
  }
  return picture;
}

double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// Relative L1, in percent.
double difference(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0;
  for (size_t i = 0; i < a.size(); ++i) difference += std::abs(a[i] - b[i]);
  return 100 * difference / sum(a);
}

Result<void> print_level(const char* folder, const LevelInfo& level) {
  const auto at = [&](float offset, uint64_t seed) {
    return render(folder, static_cast<float>(level.level) + offset, level.resolution, seed);
  };
  FARFIELD_TRY_LET(const Picture below, at(-kBeside, 1));
  FARFIELD_TRY_LET(const Picture above, at(kBeside, 1));
  FARFIELD_TRY_LET(const Picture other, at(-kBeside, 2));
  FARFIELD_TRY_LET(const Picture finer, at(-0.5f, 3));
  FARFIELD_TRY_LET(const Picture coarser, at(0.5f, 3));
  fmt::print("| {} |", level.level);
  for (const auto values : {&Picture::coverage, &Picture::direct, &Picture::light})
    fmt::print(" {:.2f} / {:.2f} % |", difference(below.*values, above.*values),
               difference(below.*values, other.*values));
  fmt::print(" {:+.2f} % | {:+.2f} % |\n", 100 * (sum(below.light) / sum(finer.light) - 1),
             100 * (sum(coarser.light) / sum(above.light) - 1));
  return {};
}

Result<void> print_all(const char* folder) {
  auto asset = AssetView::open(folder, 0);
  if (!asset) return tl::unexpected(asset.error());
  fmt::print(
      "| level | coverage: jump / two seeds | direct light | all light | mean light, from half a level finer | to half "
      "a "
      "level coarser |\n");
  fmt::print("|---|---|---|---|---|---|\n");
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
