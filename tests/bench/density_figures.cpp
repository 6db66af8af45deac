// SPDX-License-Identifier: Apache-2.0
// Do the levels of a baked asset stop the rays that their source stops?
//
//   build/release/bin/density_figures SOURCE ASSET.farfield [LEVEL...]
//
// Transmittances of levels are computed along rays, not sampled, so that figures are exact to about 0.1 % in seconds;
// but gaps of walls are decided hit by hit, not path by path: what has two sides stops too much here.
// For each stored level, with opacities alone (no light):
// * lines: share of isotropic lines through the bounds that are stopped, level against source;
// * views: the same over the pictures of `farfield evaluate` (12 views, one pixel per voxel), the rms over all pixels,
//   and the worst view;
// * any: the same over 32 views in no plane of the lattice, whose pixels lie anywhere: the rms over touched pixels, and
//   how many more pixels the level touches than its source;
// * inside: the same for rays in all directions from free points near the geometry, as shadow rays and bounces are;
// * depth: half the sum of |difference| of the distribution of their first-hit distances, in bins of a voxel.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>

#include "cache/level_file.h"
#include "cache/manifest.h"
#include "prefilter/condition.h"
#include "prefilter/resolve.h"
#include "tests/bench/volume_comparison.h"

namespace farfield {
namespace {

/// A level's volume back as voxels, and its surface back as triangles.
SparseVolume volume_of(const LevelView& level) {
  SparseVolume volume;
  volume.lattice = {dvec3(level.header.volume_origin), level.header.resolution};
  for (size_t cell = 0; cell < level.brick_table.size(); ++cell) {
    if (level.brick_table[cell] == kNoBrick) continue;
    const Brick& brick = level.bricks[level.brick_table[cell]];
    volume.bricks.push_back({brick_coordinates(level.header, cell), brick.mask, volume.voxels.size()});
    for (int i = 0; i < kBrickVoxels; ++i) {
      const uint8_t density = brick.density[static_cast<size_t>(i)];
      if (density == 0) continue;
      Voxel voxel;
      voxel.density = static_cast<float>(density) / 255.0f * brick.density_scale;
      voxel.sggx = level.voxel_sggx.empty() ? SymMat3::identity() : unpack(level.voxel_sggx[brick.payload_index(i)]);
      if (!level.voxel_octants.empty()) voxel.octants = level.voxel_octants[brick.payload_index(i)];
      volume.voxels.push_back(voxel);
    }
  }
  return volume;
}

Surface surface_of(const LevelView& level) {
  Surface surface;
  surface.positions.assign(level.positions.begin(), level.positions.end());
  for (const Quad& quad : level.quads) {
    surface.triangles.push_back(quad.face(0));
    if (quad.is_pair()) surface.triangles.push_back(quad.face(1));
  }
  surface.materials.resize(surface.triangles.size());
  for (size_t f = 0; f < level.face_gap.size(); ++f) surface.materials[f].gap = unpack_unorm8(level.face_gap[f]);
  return surface;
}

void compare_views(const Comparison& c, const Box3& bounds, float resolution) {
  constexpr int kViews = 12;
  Total total;
  double squares = 0, pixels = 0, worst = 0;
  for (const vec3& direction : view_directions(kViews)) {
    const OrthoView view = frame_view(bounds, direction, resolution);
    const Coverage cover_of = cover(c, view, glm::dvec2(0), 3e6 / kViews, mix64(static_cast<uint64_t>(pixels)));
    Total of_view;
    for (size_t p = 0; p < cover_of.size(); ++p) {
      of_view.add(cover_of.source[p], cover_of.level[p]), total.add(cover_of.source[p], cover_of.level[p]);
      squares += cover_of.squared_error(p);
    }
    pixels += static_cast<double>(cover_of.size());
    worst = std::abs(of_view.error()) > std::abs(worst) ? of_view.error() : worst;
  }
  fmt::print("  views {:+6.2f} % rms {:5.2f} % worst {:+6.2f} %", total.error(),
             100 * std::sqrt(std::max(0.0, squares / pixels)), worst);
}

/// From points where the source's first hits are seen to come from: a little in front of them, on both sides.
void compare_inside(const Comparison& c, const Box3& bounds, double resolution, size_t count) {
  constexpr size_t kBins = 32;
  std::array<Total, kBins + 1> bins;  // the last: further, or nothing
  Total total;
  parallel_for(count, 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      SplitMix random(mix64(78, i));
      const VoxelRay line = line_through(bounds, i);
      const vec3 from(line.origin), along(line.direction);
      const auto hit = c.source.first_stop(from, along, static_cast<float>(line.far), random);
      if (!hit) continue;
      const vec3 origin = from + (hit->distance - 0.001f * static_cast<float>(resolution)) * along;
      vec3 n = glm::normalize(hit->normal);
      if (glm::dot(n, along) > 0) n = -n;
      const double u = random.next_unit(), a = 2 * M_PI * random.next_unit();
      const Frame frame(n);
      const vec3 direction =
          frame.to_world(vec3(std::sqrt(u) * std::cos(a), std::sqrt(u) * std::sin(a), std::sqrt(1 - u)));
      const float far = 2 * glm::length(bounds.size());
      const auto next = c.source.first_stop(origin, direction, far, random);
      const auto bin = [&](double t) { return static_cast<size_t>(std::min<double>(t / resolution, kBins)); };
      double passing = 1;
      const float wall = c.walk(origin, direction, far, random, [&](double t, double depth) {
        const double stopped = -passing * std::expm1(-depth);
        bins[bin(t)].add(0, stopped);
        passing -= stopped;
      });
      const bool is_free = std::isinf(wall);
      if (!is_free)
        bins[bin(wall)].add(0, passing);
      else
        bins[kBins].add(0, passing);
      bins[next ? bin(next->distance) : kBins].add(1, 0);
      total.add(next ? 1 : 0, is_free ? 1 - passing : 1);
    }
  });
  double difference = 0, sum = 0;
  for (const Total& bin : bins) {
    difference += 0.5 * std::abs(static_cast<double>(bin.level - bin.source));
    sum += static_cast<double>(bin.source);
  }
  fmt::print("  inside {:+6.2f} % depth {:5.2f} %", total.error(), 100 * difference / sum);
}

Result<void> run(const char* source_file, const char* folder, const std::set<uint32_t>& levels) {
  FARFIELD_TRY_LET(const auto manifest, read_manifest(folder));
  FARFIELD_TRY_LET(const auto asset, import_asset(source_file));
  FARFIELD_TRY_LET(const auto resolved, resolve(asset.source, static_cast<float>(manifest.base_resolution)));
  FARFIELD_TRY_LET(const auto source, OpacityScene::build(resolved.surface));
  const Box3 source_bounds = resolved.surface.bounds();
  for (const LevelEntry& entry : manifest.levels) {
    if (entry.level == 0 || (!levels.empty() && !levels.contains(entry.grid))) continue;
    FARFIELD_TRY_LET(const auto file, LevelFile::open(std::filesystem::path(folder) / entry.file, LevelCheck::Full));
    const SparseVolume volume = volume_of(file->view());
    const VoxelGrid grid(volume);
    const Surface surface = surface_of(file->view());
    std::optional<OpacityScene> macrosurface;
    if (!surface.triangles.empty()) {
      FARFIELD_TRY_LET(macrosurface, OpacityScene::build(surface));
    }
    const Comparison comparison{source, macrosurface ? &*macrosurface : nullptr, grid, volume};
    // The same pixels whatever voxels the level has at its border.
    const Box3 bounds{source_bounds.lower - 1.5f * static_cast<float>(entry.resolution),
                      source_bounds.upper + 1.5f * static_cast<float>(entry.resolution)};
    fmt::print("{:4}^3 {:7} triangles {:7} voxels", entry.grid, entry.triangles, entry.voxels);
    compare_lines(comparison, bounds, 2'000'000);
    compare_views(comparison, bounds, static_cast<float>(entry.resolution));
    compare_any_views(comparison, bounds, static_cast<float>(entry.resolution));
    compare_inside(comparison, bounds, entry.resolution, 1'000'000);
    fmt::print("  {:.1f} KiB\n", static_cast<double>(entry.resident_bytes) / 1024);
    std::fflush(stdout);
  }
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc < 3) return fmt::print("usage: density_figures SOURCE ASSET.farfield [GRID...]\n"), 2;
  std::set<uint32_t> grids;
  for (int i = 3; i < argc; ++i) grids.insert(static_cast<uint32_t>(std::atoi(argv[i])));
  if (const auto done = farfield::run(argv[1], argv[2], grids); !done) {
    fmt::print("{}\n", done.error().message);
    return 1;
  }
}
