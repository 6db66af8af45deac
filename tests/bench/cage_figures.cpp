// SPDX-License-Identifier: Apache-2.0
// How many faces does a cage take for a given error, cut by its error or uniformly, and how long does that take? For
// docs/results/surfaces.md.
//
//   build/release/bin/cage_figures CAGE.obj [GRID]
//
// For several errors (in voxels of a grid of GRID along the longest side, without it 1024): faces, CPU seconds, and the
// farthest and root mean square distance of points of the limit surface (the vertices of a tessellation eight times as
// exact) from the faces; then the same for faces of one size everywhere, the largest whose farthest distance is no
// more. Of a cage with displacement maps the root mean square: where heights jump, at seams, what lies between depends
// on the size of faces, and the farthest distance is that of the jump.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <unordered_map>

#include "base/hash.h"
#include "evaluate/triangle_distance.h"
#include "import/read_source.h"
#include "prefilter/subdivide.h"

namespace farfield {
namespace {

struct Tessellation {
  SourceMesh mesh;
  double cpu_seconds = 0;
};

struct Distance {
  double farthest = 0, rms = 0;
};

/// Triangles by the cells that they reach, `reach` around them included.
class TriangleCells {
 public:
  TriangleCells(const SourceMesh& mesh, double reach) : mesh_(mesh), reach_(reach) {
    for (uint32_t face = 0; face < mesh.face_count(); ++face) {
      for (uint32_t i = mesh.face_begin[face] + 1; i + 1 < mesh.face_begin[face + 1]; ++i) add(face, i);
    }
  }

  /// At most `reach`.
  double distance(const dvec3& p) const {
    double least = reach_;
    const auto found = cells_.find(key(cell_of(p)));
    if (found == cells_.end()) return least;
    for (const auto& [face, i] : found->second) {
      least = std::min(least, distance_to_triangle(p, corner(mesh_.face_begin[face]), corner(i), corner(i + 1)));
    }
    return least;
  }

 private:
  using Cell = glm::i64vec3;

  const dvec3& corner(uint32_t i) const { return mesh_.positions[mesh_.corner_position[i]]; }
  Cell cell_of(const dvec3& p) const { return Cell(glm::floor(p / (2 * reach_))); }
  static uint64_t key(const Cell& c) {
    return mix64(mix64(static_cast<uint64_t>(c.x), static_cast<uint64_t>(c.y)), static_cast<uint64_t>(c.z));
  }
  void add(uint32_t face, uint32_t i) {
    const dvec3 &a = corner(mesh_.face_begin[face]), &b = corner(i), &c = corner(i + 1);
    const Cell lower = cell_of(glm::min(a, glm::min(b, c)) - reach_),
               upper = cell_of(glm::max(a, glm::max(b, c)) + reach_);
    for (int64_t z = lower.z; z <= upper.z; ++z) {
      for (int64_t y = lower.y; y <= upper.y; ++y) {
        for (int64_t x = lower.x; x <= upper.x; ++x) cells_[key({x, y, z})].emplace_back(face, i);
      }
    }
  }

  const SourceMesh& mesh_;
  double reach_;
  std::unordered_map<uint64_t, std::vector<std::pair<uint32_t, uint32_t>>> cells_;
};

class Figures {
 public:
  Figures(SourceMesh cage, uint32_t grid) : cage_(std::move(cage)) {
    options_.scheme = SubdivisionScheme::CatmullClark;
    options_.grid = grid;
    dvec3 lower(INFINITY), upper(-INFINITY);
    for (const uint32_t v : cage_.corner_position) {
      lower = glm::min(lower, cage_.positions[v]);
      upper = glm::max(upper, cage_.positions[v]);
    }
    const dvec3 size = upper - lower;
    voxel_ = std::max(size.x, std::max(size.y, size.z)) / grid;
  }

  void print(double error) {
    limit_ = cut(error / 8, 0).mesh;
    const Tessellation by_error = cut(error, 0);
    const Distance distance = distance_of(by_error.mesh, error);
    print_row("by error", error, by_error, distance);
    // The largest faces of one size that are as near.
    const auto is_as_near = [&](const Distance& other) {
      return is_displaced() ? other.rms <= distance.rms : other.farthest <= distance.farthest;
    };
    double small = is_displaced() ? 0.5 : 1, large = is_displaced() ? 8 : 64;
    while (large / small > 1.1) {
      const double middle = std::sqrt(small * large);
      (is_as_near(distance_of(cut(1e9, middle).mesh, error)) ? small : large) = middle;
    }
    const Tessellation uniform = cut(1e9, small);
    print_row("one size", small, uniform, distance_of(uniform.mesh, error));
  }

 private:
  bool is_displaced() const { return !cage_.heights.empty(); }

  Tessellation cut(double error, double edge) const {
    SubdivisionOptions options = options_;
    options.error = error;
    options.edge = edge;
    const std::clock_t begin = std::clock();
    auto mesh = subdivide(cage_, options, "cage");
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (!mesh) {
      fmt::print(stderr, "{}\n", mesh.error().message);
      std::exit(1);
    }
    return {std::move(*mesh), seconds};
  }

  /// In voxels, of at most a quarter of a million points; what is farther than one and a half times the error
  /// (displaced: three times) is not told apart.
  Distance distance_of(const SourceMesh& mesh, double error) const {
    const TriangleCells cells(mesh, (is_displaced() ? 3 : 1.5) * error * voxel_);
    const size_t step = limit_.positions.size() / 250000 + 1;
    size_t count = 0;
    Distance distance;
    double sum = 0;
    for (size_t i = 0; i < limit_.positions.size(); i += step, ++count) {
      const double d = cells.distance(limit_.positions[i]) / voxel_;
      distance.farthest = std::max(distance.farthest, d);
      sum += d * d;
    }
    distance.rms = std::sqrt(sum / static_cast<double>(count));
    return distance;
  }

  static void print_row(const char* how, double setting, const Tessellation& cut, const Distance& distance) {
    fmt::print("| {} | {:.4g} | {} | {:.2f} | {:.4f} | {:.4f} |\n", how, setting, cut.mesh.face_count(),
               cut.cpu_seconds, distance.farthest, distance.rms);
  }

  SourceMesh cage_, limit_;
  SubdivisionOptions options_;
  double voxel_ = 1;
};

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: cage_figures CAGE.obj [GRID]\n");
    return 2;
  }
  auto cage = farfield::read_source(argv[1]);
  if (!cage) {
    fmt::print(stderr, "{}\n", cage.error().message);
    return 1;
  }
  const int grid = argc > 2 ? std::atoi(argv[2]) : 1024;
  farfield::Figures figures(std::move(*cage), grid > 0 ? static_cast<uint32_t>(grid) : 1024u);
  fmt::print(
      "| cut | error or edge, voxels | faces | CPU s | farthest, voxels | rms, voxels |\n|---|---|---|---|---|---|\n");
  for (const double error : {1.0, 0.5, 0.125}) figures.print(error);
  return 0;
}
