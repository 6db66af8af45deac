// SPDX-License-Identifier: Apache-2.0
// Do the levels of a baked asset stop the rays that their source stops?
//
//   build/release/bin/density_figures SOURCE ASSET.farfield [LEVEL...]
//
// Transmittances of levels are computed along rays, not sampled, so that figures are exact to about 0.1 % in seconds.
// For each stored level, with opacities alone (no light):
// * lines: share of isotropic lines through the bounds that are stopped, level against source;
// * views: the same over the pictures of `farfield evaluate` (12 views, one pixel per voxel), the rms over all pixels,
//   and the worst view;
// * inside: the same for rays in all directions from free points near the geometry, as shadow rays and bounces are;
// * depth: half the sum of |difference| of the distribution of their first-hit distances, in bins of a voxel.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>

#include "base/parallel.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "evaluate/views.h"
#include "prefilter/condition.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/ray_scene.h"
#include "prefilter/resolve.h"
#include "prefilter/voxel_walk.h"

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
  return surface;
}

struct Comparison {
  const OpacityScene& source;
  const OpacityScene* macrosurface;  ///< or null
  const VoxelGrid& grid;
  const SparseVolume& volume;

  /// The voxels' depths along a ray in scene units, up to where the level's surface stops it: calls visit(distance of
  /// the middle, depth); returns where that is, or infinity.
  template <typename Visit>
  float walk(const vec3& origin, const vec3& direction, float far, SplitMix& random, Visit&& visit) const {
    const double size = volume.lattice.voxel_size;
    float wall = std::numeric_limits<float>::infinity();
    if (macrosurface) {
      if (const auto hit = macrosurface->first_stop(origin, direction, far, random)) far = wall = hit->distance;
    }
    VoxelRay ray{(dvec3(origin) - volume.lattice.origin) / size, dvec3(direction), 0, far / size};
    grid.walk(ray, [&](uint32_t v, double enter, double leave) {
      const Voxel& voxel = volume.voxels[v];
      visit(enter * size,
            (leave - enter) * size * voxel.density * std::sqrt(std::max(0.0f, voxel.sggx.quadratic(direction))));
      return true;
    });
    return wall;
  }

  double opacity(const vec3& origin, const vec3& direction, float far, SplitMix& random) const {
    double depth = 0;
    const float wall = walk(origin, direction, far, random, [&](double, double d) { depth += d; });
    return std::isinf(wall) ? -std::expm1(-depth) : 1;
  }
};

constexpr double kScale = 0x1p30;

struct Total {
  std::atomic<int64_t> source{0}, level{0};
  void add(double s, double l) {
    source += std::llround(s * kScale);
    level += std::llround(l * kScale);
  }
  double error() const { return source > 0 ? 100 * (static_cast<double>(level) / static_cast<double>(source) - 1) : 0; }
};

/// The same lines in every comparison.
VoxelRay line_through(const Box3& bounds, size_t i) {
  return isotropic_line({dvec3(bounds.lower), dvec3(bounds.upper)}, even_coordinates(i, 77));
}

void compare_lines(const Comparison& c, const Box3& bounds, size_t count) {
  Total total;
  parallel_for(count, 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      SplitMix random(mix64(77, i));
      const VoxelRay line = line_through(bounds, i);
      const vec3 origin(line.origin), direction(line.direction);
      const auto far = static_cast<float>(line.far);
      total.add(c.source.first_stop(origin, direction, far, random) ? 1 : 0, c.opacity(origin, direction, far, random));
    }
  });
  fmt::print("  lines {:+6.2f} %", total.error());
}

void compare_views(const Comparison& c, const Box3& bounds, float resolution) {
  Total total;
  double squares = 0, pixels = 0, worst = 0;
  std::vector<double> errors;
  for (const vec3& direction : view_directions(12)) {
    const OrthoView view = frame_view(bounds, direction, resolution);
    const auto count = static_cast<size_t>(view.width_px * view.height_px);
    const int spp = static_cast<int>(std::clamp<double>(3e6 / 12 / static_cast<double>(count), 4, 1024));
    Total of_view;
    std::vector<double> square(count);
    const float back = glm::length(bounds.size());
    parallel_for(count, 64, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p) {
        SplitMix random(mix64(mix64(static_cast<uint64_t>(pixels)), p));
        double source = 0, level = 0;
        for (int s = 0; s < spp; ++s) {
          const double x =
              static_cast<double>(p % static_cast<size_t>(view.width_px)) + random.next_unit() - 0.5 * view.width_px;
          const double y =
              static_cast<double>(p / static_cast<size_t>(view.width_px)) + random.next_unit() - 0.5 * view.height_px;
          const vec3 origin = view.center +
                              resolution * (static_cast<float>(x) * view.right() - static_cast<float>(y) * view.up) -
                              back * view.direction;
          source += c.source.first_stop(origin, view.direction, 2 * back, random) ? 1 : 0;
          level += c.opacity(origin, view.direction, 2 * back, random);
        }
        source /= spp, level /= spp;
        of_view.add(source, level), total.add(source, level);
        square[p] = (level - source) * (level - source) - source * (1 - source) / (spp - 1);
      }
    });
    for (const double s : square) squares += s;
    pixels += static_cast<double>(count);
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
    compare_inside(comparison, bounds, entry.resolution, 1'000'000);
    fmt::print("\n");
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
