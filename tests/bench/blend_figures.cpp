// SPDX-License-Identifier: Apache-2.0
// Dissolve and morph between each pair of neighbouring stored levels: what the picture does through the window, its
// noise, its time and what it takes.
//
//   build/release/bin/blend_figures ASSET.farfield
//
// One view at one pixel per r of the coarser level, sun and sky. Coverage and brightness at t = 1/4, 1/2, 3/4 against
// the straight line between the two levels, in percent of that. Noise: standard deviation of a pixel, times against the
// finer level alone: medians of interleaved repeats, CPU.
#include <fmt/format.h>

#include <array>

#include "tests/bench/blend_pictures.h"

namespace farfield {
namespace {

constexpr int kRepeats = 5;
constexpr std::array<float, 3> kBlends = {0.25f, 0.5f, 0.75f};

struct Means {
  double coverage = 0, brightness = 0, deviation = 0;
};

Result<void> print_pair(const char* folder, const LevelInfo& fine, const LevelInfo& coarse) {
  const auto coarser = static_cast<float>(coarse.level);
  std::vector<Renderer> renderers;
  renderers.emplace_back(folder, static_cast<float>(fine.level), Blend::Dissolve, coarse.resolution);
  renderers.emplace_back(folder, coarser, Blend::Dissolve, coarse.resolution);
  for (const Blend blend : {Blend::Dissolve, Blend::Morph}) {
    for (const float t : kBlends) renderers.emplace_back(folder, coarser - 1 + t, blend, coarse.resolution);
  }
  std::vector<Means> means(renderers.size());
  for (int repeat = 0; repeat <= kRepeats; ++repeat) {
    for (size_t i = 0; i < renderers.size(); ++i) {
      FARFIELD_TRY_LET(const Picture picture, renderers[i].render());
      means[i].coverage += picture.coverage;
      means[i].brightness += picture.brightness;
      means[i].deviation += picture.deviation;
    }
  }
  const auto off = [&](size_t i, double Means::*value) {
    const double t = kBlends[(i - 2) % 3], line = (1 - t) * (means[0].*value) + t * (means[1].*value);
    return 100 * (means[i].*value / line - 1);
  };
  const auto at_half = [&](size_t i) {
    return fmt::format("{:.2f} | {:.2f} | {:.0f}", means[i].deviation / means[0].deviation,
                       renderers[i].median_seconds() / renderers[0].median_seconds(),
                       static_cast<double>(renderers[i].bytes()) / 1024);
  };
  for (const size_t first : {2, 5}) {
    fmt::print("| {} to {} | {} | {:+.1f} / {:+.1f} / {:+.1f} | {:+.1f} / {:+.1f} / {:+.1f} | {} |\n", fine.level,
               coarse.level, first == 2 ? "dissolve" : "morph", off(first, &Means::coverage),
               off(first + 1, &Means::coverage), off(first + 2, &Means::coverage), off(first, &Means::brightness),
               off(first + 1, &Means::brightness), off(first + 2, &Means::brightness), at_half(first + 1));
  }
  return {};
}

Result<void> print_all(const char* folder) {
  FARFIELD_TRY_LET(const auto asset, AssetView::open(folder, 0));
  fmt::print("| levels | blend | coverage off, % | brightness off, % | noise | CPU time | KiB taken |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  const std::vector<LevelInfo>& levels = asset->levels();
  for (size_t i = 1; i < levels.size(); ++i) FARFIELD_TRY(print_pair(folder, levels[i - 1], levels[i]));
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: blend_figures ASSET.farfield\n");
    return 2;
  }
  if (auto done = farfield::print_all(argv[1]); !done) {
    fmt::print(stderr, "blend_figures: {}\n", done.error().message);
    return 1;
  }
  return 0;
}
