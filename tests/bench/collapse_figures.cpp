// SPDX-License-Identifier: Apache-2.0
// Do macrosurface analysis and edge collapse take as long per face of 10 million as of 100 thousand, and what does
// meshoptimizer's simplifier take and reach on the same mesh, in as many faces?
//
//   build/release/bin/collapse_figures [FACES...]      (without: 100000 1000000)
//
// A bumpy sphere; faces are a sixth of the resolution wide at first. Distances are measured from points on either
// surface to the other, by no code of either simplifier. For docs/results/surfaces.md.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/process_time.h"
#include "evaluate/simplifier_comparison.h"
#include "evaluate/surface_distance.h"
#include "prefilter/macrosurface.h"
#include "prefilter/simplify.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

constexpr int kSamples = 20000;

Surface make_source(int faces) {
  const int rings = static_cast<int>(std::sqrt(faces / 4.0));
  Surface sphere = test::make_sphere(2 * rings, rings, 1.0f);
  for (vec3& p : sphere.positions) p *= 1.0f + 0.01f * std::sin(40 * p.x) * std::sin(40 * p.y) * std::sin(40 * p.z);
  return sphere;
}

template <typename Work>
double cpu_seconds(const Work& work) {
  const double before = process_cpu_seconds();
  work();
  return process_cpu_seconds() - before;
}

void print_row(const char* name, const Surface& source, const Surface& simplified, double resolution, double seconds) {
  const double faces = static_cast<double>(source.triangles.size());
  const double collapses = 0.5 * static_cast<double>(source.triangles.size() - simplified.triangles.size());
  const SurfaceDistance distance = two_sided_distance(source, simplified, kSamples);
  fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.3f} | {:.4f} |\n", name, source.triangles.size(),
             simplified.triangles.size(), 1e6 * seconds / faces, 1e6 * seconds / collapses,
             distance.farthest / resolution, distance.rms / resolution);
}

void measure(int faces) {
  const Surface source = make_source(faces);
  const double edge = std::sqrt(4 * 3.14159265 / static_cast<double>(source.triangles.size()) * 4 / std::sqrt(3.0));
  const double resolution = 6 * edge;
  const double analysis = cpu_seconds([&] { classify_macrosurface(source, static_cast<float>(resolution)); });
  fmt::print("| analysis | {} | | {:.2f} | | | |\n", source.triangles.size(),
             1e6 * analysis / static_cast<double>(source.triangles.size()));
  SimplifyResult ours;
  const double seconds = cpu_seconds([&] { ours = simplify(source, {static_cast<float>(resolution)}); });
  print_row("edge collapse", source, ours.surface, resolution, seconds);
  Surface quadrics;
  const double of_quadrics =
      cpu_seconds([&] { quadrics = simplified_by_quadrics(source, ours.surface.triangles.size()); });
  print_row("meshopt_simplify", source, quadrics, resolution, of_quadrics);
  std::fflush(stdout);
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  fmt::print(
      "| | faces | left | us per face | us per collapse | farthest, r | rms, r |\n|---|---|---|---|---|---|---|\n");
  if (argc == 1)
    for (const int faces : {100'000, 1'000'000}) farfield::measure(faces);
  for (int i = 1; i < argc; ++i) {
    const int faces = std::atoi(argv[i]);
    if (faces < 1000) {
      fmt::print(stderr, "usage: collapse_figures [FACES...], each at least 1000\n");
      return 2;
    }
    farfield::measure(faces);
  }
}
