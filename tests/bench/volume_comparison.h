// SPDX-License-Identifier: Apache-2.0
// Which rays a volume stops against which its source stops: transmittances are computed, not sampled.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/split_mix.h"
#include "evaluate/views.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/line_scene.h"
#include "prefilter/ray_scene.h"
#include "prefilter/voxel_walk.h"

namespace farfield {

/// A level: its voxels, and its surface if there is one; and the source.
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
    walk_octant_depths(volume, grid, ray, [&](const OctantStretch& at, double depth) {
      visit(at.enter * size, depth);
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

/// Sums whose result does not depend on the order of what is added.
struct Total {
  static constexpr double kScale = 0x1p30;

  std::atomic<int64_t> source{0}, level{0};
  void add(double s, double l) {
    source += std::llround(s * kScale);
    level += std::llround(l * kScale);
  }
  double error() const { return source > 0 ? 100 * (static_cast<double>(level) / static_cast<double>(source) - 1) : 0; }
};

/// The same lines in every comparison.
inline VoxelRay line_through(const Box3& bounds, size_t i) {
  return isotropic_line({dvec3(bounds.lower), dvec3(bounds.upper)}, even_coordinates(i, 77));
}

inline void compare_lines(const Comparison& c, const Box3& bounds, size_t count) {
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
inline Coverage cover(const Comparison& c, const OrthoView& view, const glm::dvec2& shift, double samples,
                      uint64_t seed) {
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

/// Over views that lie in no plane of the lattice, whose pixels lie anywhere: also how many pixels are touched.
inline void compare_any_views(const Comparison& c, const Box3& bounds, float resolution) {
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

}  // namespace farfield
