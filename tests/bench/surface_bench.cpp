// SPDX-License-Identifier: Apache-2.0
// How long do the steps of a bake take that grow with the faces: macrosurface analysis, simplification by edges and by
// face loops, marking voxels? Does the work per face stay bounded when the source is much finer than the resolution, or
// much coarser? And how near is voxelisation to what Embree alone needs for as many rays? Run:
// build/release/bin/surface_bench (thesis: 15 us per face, 170 us per collapse).
#include <benchmark/benchmark.h>

#include "base/random.h"
#include "prefilter/collapse_loops.h"
#include "prefilter/keep_apart.h"
#include "prefilter/macrosurface.h"
#include "prefilter/simplify.h"
#include "prefilter/voxel_marks.h"
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

/// What walls close behind each other add: the same sphere twice, one in the other.
void keep_walls_apart(benchmark::State& state) {
  const Surface outer = make_source(static_cast<int>(state.range(0)) / 2);
  Surface inner = outer;
  for (vec3& p : inner.positions) p *= 0.999f;
  const Surface source = test::join(outer, inner);
  const float resolution = 2.0f / static_cast<float>(state.range(1));
  const SimplifyResult simplified = simplify(source, {.resolution = resolution});
  for (auto _ : state) {
    SimplifyResult apart = simplified;
    benchmark::DoNotOptimize(keep_apart(source, resolution, apart));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(source.triangles.size()));
}

/// Faces: halves of quads.
void collapse_face_loops(benchmark::State& state) {
  const int across = static_cast<int>(std::sqrt(static_cast<double>(state.range(0)) / 6.0));
  Surface torus = test::make_torus(3 * across, across, 0.35f);
  test::pair_into_quads(torus);
  const double resolution = 2.7 / static_cast<double>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(collapse_loops(torus, resolution));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(torus.triangles.size()));
}

/// Straight hairs across a cube of side 1, two triangles each.
Surface make_hair(int hairs) {
  Surface surface;
  Rng rng(1);
  const vec3 width(0.0005f, 0.0f, 0.0005f);
  for (int i = 0; i < hairs; ++i) {
    const vec3 root(rng.next(), 0.0f, rng.next()), tip(rng.next(), 1.0f, rng.next());
    const auto first = static_cast<uint32_t>(surface.positions.size());
    surface.positions.insert(surface.positions.end(), {root, root + width, tip + width, tip});
    surface.triangles.insert(surface.triangles.end(), {uvec3(0, 1, 2) + first, uvec3(0, 2, 3) + first});
  }
  surface.materials.resize(surface.triangles.size());
  return surface;
}

/// Arguments: hairs; voxels along one.
void mark_hair(benchmark::State& state) {
  const Surface hair = make_hair(static_cast<int>(state.range(0)));
  const VoxelLattice lattice{dvec3(0.0), 1.0 / static_cast<double>(state.range(1))};
  for (auto _ : state) benchmark::DoNotOptimize(mark_voxels(hair, lattice));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(hair.triangles.size()));
}

BENCHMARK(classify)
    ->ArgNames({"faces", "grid"})
    ->Args({200'000, 512})
    ->Args({200'000, 64})
    ->Args({200'000, 8})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(keep_walls_apart)
    ->ArgNames({"faces", "grid"})
    ->Args({200'000, 128})
    ->Args({200'000, 8})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(mark_hair)
    ->ArgNames({"hairs", "grid"})
    ->Args({100'000, 64})
    ->Args({100'000, 512})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(collapse_face_loops)
    ->ArgNames({"faces", "grid"})
    ->Args({20'000, 64})
    ->Args({20'000, 8})
    ->Args({200'000, 128})
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
