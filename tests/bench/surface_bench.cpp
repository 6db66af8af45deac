// SPDX-License-Identifier: Apache-2.0
// How long do macrosurface analysis and simplification take, and does the work per face stay bounded when the source is
// much finer than the resolution? Run: build/release/bin/surface_bench (thesis: 15 us per face, 170 us per collapse).
#include <benchmark/benchmark.h>

#include "prefilter/macrosurface.h"
#include "prefilter/simplify.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

/// A bumpy sphere of about `faces` triangles.
Surface make_source(int faces) {
  const int rings = static_cast<int>(std::sqrt(faces / 4.0));
  Surface sphere = test::make_sphere(2 * rings, rings, 1.0f);
  for (vec3& p : sphere.positions) p *= 1.0f + 0.01f * std::sin(40 * p.x) * std::sin(40 * p.y) * std::sin(40 * p.z);
  return sphere;
}

/// Arguments: faces of the source; the resolution as a part of the diameter, 1 / grid.
void classify(benchmark::State& state) {
  const Surface source = make_source(static_cast<int>(state.range(0)));
  const float resolution = 2.0f / static_cast<float>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(classify_macrosurface(source, resolution));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(source.triangles.size()));
}

void simplify_surface(benchmark::State& state) {
  const Surface source = make_source(static_cast<int>(state.range(0)));
  const SimplifyOptions options{.resolution = 2.0f / static_cast<float>(state.range(1))};
  size_t collapses = 0;
  for (auto _ : state) collapses += source.positions.size() - simplify(source, options).surface.positions.size();
  state.SetItemsProcessed(static_cast<int64_t>(collapses));  // items: collapses
}

BENCHMARK(classify)
    ->ArgNames({"faces", "grid"})
    ->Args({200'000, 512})
    ->Args({200'000, 64})
    ->Args({200'000, 8})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(simplify_surface)
    ->ArgNames({"faces", "grid"})
    ->Args({200'000, 128})
    ->Args({200'000, 8})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace farfield

BENCHMARK_MAIN();
