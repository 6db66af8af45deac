// SPDX-License-Identifier: Apache-2.0
// What do face loops make of a quad mesh, beside edges? For each level of a cascade: faces, how many of them are halves
// of quads, and how far the level and the source are from each other. Surfaces alone: nothing is voxelised.
//
//   build/release/bin/loop_figures SOURCE [FINEST_GRID [COARSEST_GRID]]
//
// Distances are measured from kSamples points on either surface to the other, found in a grid: no code of
// the simplifier's is used. For docs/results/surfaces.md.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "bake/pack_level.h"
#include "base/index.h"
#include "base/process_time.h"
#include "evaluate/surface_distance.h"
#include "prefilter/quad_part.h"
#include "prefilter/simplify.h"
#include "tests/support/imported_surface.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

constexpr int kSamples = 20000;

size_t count_quads(const Surface& surface) {
  const std::vector<uint32_t> other = find_other_halves(surface.quad);
  return static_cast<size_t>(std::ranges::count_if(other, [](uint32_t half) { return half != kNoIndex; })) / 2;
}

void print_cascade(const Surface& source, SimplifyMethod method, int finest, int coarsest) {
  const Box3 bounds = source.bounds();
  const double side = std::max({bounds.size().x, bounds.size().y, bounds.size().z});
  Surface surface = source;
  for (int grid = finest; grid >= coarsest; grid /= 2) {
    const double r = side / grid, before = process_cpu_seconds();
    const size_t faces = surface.triangles.size();
    surface = simplify(surface, {static_cast<float>(r), method}).surface;
    const double seconds = process_cpu_seconds() - before;
    const SurfaceDistance distance = two_sided_distance(source, surface, kSamples);
    fmt::print("| {} | {}^3 | {} | {} | {} | {:.3f} | {:.4f} | {:+.2f} % | {:.1f} |\n", name_of(method), grid,
               surface.triangles.size(), count_quads(surface), order_surface(surface).quads.size(),
               distance.farthest / r, distance.rms / r,
               100 * (test::total_area(surface) / test::total_area(source) - 1),
               1e6 * seconds / static_cast<double>(faces));
  }
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  using namespace farfield;
  if (argc < 2 || argc > 4) {
    fmt::print("usage: loop_figures SOURCE [FINEST_GRID [COARSEST_GRID]]\n");
    return 2;
  }
  const auto source = test::import_surface(argv[1]);
  if (!source) {
    fmt::print(stderr, "{}\n", source.error().message);
    return 1;
  }
  const int finest = argc > 2 ? std::atoi(argv[2]) : 128, coarsest = argc > 3 ? std::atoi(argv[3]) : 8;
  fmt::print("{} triangles, {} quads\n\n", source->surface.triangles.size(), count_quads(source->surface));
  fmt::print(
      "| method | level | triangles | quads | stored quads | farthest, r | rms, r | area | us per face before |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const auto method : {SimplifyMethod::Edges, SimplifyMethod::Loops, SimplifyMethod::Auto}) {
    print_cascade(source->surface, method, finest, coarsest);
  }
}
