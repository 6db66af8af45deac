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

/// How much of each pixel of a picture is covered, by the source and by the level.
struct Coverage {
  std::vector<double> source, level;
  int samples = 0;  ///< per pixel

  size_t size() const { return source.size(); }
  /// Without what noise of the source adds.
  double squared_error(size_t p) const {
    return (level[p] - source[p]) * (level[p] - source[p]) - source[p] * (1 - source[p]) / (samples - 1);
  }
};

/// `shift`: of the picture's upper left corner, in pixels.
Coverage cover(const Comparison& c, const OrthoView& view, const glm::dvec2& shift, double samples, uint64_t seed) {
  const auto count = static_cast<size_t>(view.width_px * view.height_px);
  Coverage result{std::vector<double>(count), std::vector<double>(count)};
  result.samples = static_cast<int>(std::clamp<double>(samples / static_cast<double>(count), 4, 1024));
  const float back = view.width() + view.pixel_size * static_cast<float>(view.height_px);  // more than a diagonal
  const glm::dvec2 corner = shift - 0.5 * glm::dvec2(view.width_px, view.height_px);
  parallel_for(count, 64, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      SplitMix random(mix64(seed, p));
      const glm::dvec2 pixel =
          corner + glm::dvec2(p % static_cast<size_t>(view.width_px), p / static_cast<size_t>(view.width_px));
      for (int s = 0; s < result.samples; ++s) {
        const double x = pixel.x + random.next_unit(), y = pixel.y + random.next_unit();
        const vec3 origin = view.center +
                            view.pixel_size * (static_cast<float>(x) * view.right() - static_cast<float>(y) * view.up) -
                            back * view.direction;
        result.source[p] += c.source.first_stop(origin, view.direction, 2 * back, random) ? 1 : 0;
        result.level[p] += c.opacity(origin, view.direction, 2 * back, random);
      }
      result.source[p] /= result.samples, result.level[p] /= result.samples;
    }
  });
  return result;
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

/// Over views that lie in no plane of the lattice, whose pixels lie anywhere: also how many pixels are touched.
void compare_any_views(const Comparison& c, const Box3& bounds, float resolution) {
  constexpr int kViews = 32;
  constexpr double kSeen = 1.0 / 256;  // less is not seen
  Total total;
  double squares = 0, source_touched = 0, level_touched = 0, touched = 0;
  uint64_t seed = 79;
  for (const vec3& direction : view_directions(kViews)) {
    SplitMix random(++seed);
    OrthoView view = frame_view(bounds, direction, resolution);
    ++view.width_px, ++view.height_px;  // contains the bounds wherever it is shifted
    const glm::dvec2 shift(random.next_unit() - 0.5, random.next_unit() - 0.5);
    const Coverage cover_of = cover(c, view, shift, 1e7 / kViews, seed);
    for (size_t p = 0; p < cover_of.size(); ++p) {
      const bool by_source = cover_of.source[p] > kSeen, by_level = cover_of.level[p] > kSeen;
      total.add(cover_of.source[p], cover_of.level[p]);
      squares += cover_of.squared_error(p);
      source_touched += by_source, level_touched += by_level, touched += by_source || by_level;
    }
  }
  fmt::print("  any {:+6.2f} % rms of touched {:5.2f} % touches {:+5.1f} %", total.error(),
             100 * std::sqrt(std::max(0.0, squares / touched)), 100 * (level_touched / source_touched - 1));
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
