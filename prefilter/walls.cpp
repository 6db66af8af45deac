// SPDX-License-Identifier: Apache-2.0
// The geometry's moments are summed up per cell of one resolution. Cells whose 3^3 neighbourhood is a thin layer are
// looked at by rays along its normal. Lengths are in resolutions but where rays are cast.
#include "prefilter/walls.h"

#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/split_mix.h"
#include "prefilter/grid_cells.h"
#include "prefilter/ray_scene.h"
#include "prefilter/triangle_pieces.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

// A plane through a neighbourhood has a variance of 0 along its normal and of 0.75 along both other axes.
constexpr double kMostThickness2 = 0.0625;  ///< along the normal of what counts as a layer
constexpr double kLeastExtent2 = 0.3;       ///< along both other axes of what is no ribbon and no rim
constexpr double kDisc = 1.2;               ///< radius of the disc that rays look at
constexpr uint32_t kRays = 64;
constexpr double kLeastCovered = 0.8;                   ///< share of them that must be stopped
constexpr double kLeastAlignment = 0.85;                ///< mean cosine between what stops them and the layer's normal
constexpr double kMostTransmission = 0.02;              ///< mean albedo of what stops them
constexpr double kNearPlane = 0.75, kNearMiddle = 2.0;  ///< what a layer's middle answers for
constexpr int kNearCells = 3;                           ///< cells around it that reach so far

/// Integrals over faces.
struct Moments {
  double area = 0;
  dvec3 first{0.0};
  glm::dmat3 second{0.0};

  void add(const TrianglePiece& t) {
    const double piece_area = 0.5 * glm::length(area_vector_of(t));
    const dvec3 middle = middle_of(t);
    area += piece_area;
    first += piece_area * middle;
    second += piece_area * 0.75 * glm::outerProduct(middle, middle);
    for (const dvec3& p : t) second += piece_area / 12 * glm::outerProduct(p, p);
  }
  void add(const Moments& other) {
    area += other.area;
    first += other.first;
    second += other.second;
  }
  dvec3 middle() const { return first / area; }
  glm::dmat3 covariance() const { return second / area - glm::outerProduct(middle(), middle()); }
};

/// A place in the middle of a layer.
struct Layer {
  dvec3 middle, normal;

  bool owns(const dvec3& point) const {
    const dvec3 offset = point - middle;
    const double height = glm::dot(offset, normal);
    return std::abs(height) <= kNearPlane && glm::dot(offset, offset) - height * height <= kNearMiddle * kNearMiddle;
  }
};

/// The unit eigenvector of an eigenvalue that no other is near.
std::optional<dvec3> eigenvector(const glm::dmat3& m, double eigenvalue) {
  const glm::dmat3 rest = m - glm::dmat3(eigenvalue);
  dvec3 longest(0.0);
  for (int i = 0; i < 3; ++i) {
    const dvec3 candidate = glm::cross(rest[i], rest[(i + 1) % 3]);
    if (glm::dot(candidate, candidate) > glm::dot(longest, longest)) longest = candidate;
  }
  const double length = glm::length(longest);
  if (!(length > 0)) return {};
  return longest / length;
}

/// The layer that these moments are of, if they are of one.
std::optional<Layer> thin_layer(const Moments& moments) {
  if (!(moments.area > 0)) return {};
  const glm::dmat3 m = moments.covariance();
  const dvec3 variance = eigenvalues(SymEntries{m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]});
  if (!(variance.y >= kLeastExtent2 && variance.z <= kMostThickness2)) return {};
  const auto normal = eigenvector(m, variance.z);
  if (!normal) return {};
  return Layer{moments.middle(), *normal};
}

/// Moments of the geometry per cell.
class MomentGrid {
 public:
  MomentGrid(const Surface& geometry, double resolution) {
    for (size_t face = 0; face < geometry.triangles.size(); ++face) {
      for_each_piece(in_cells(corners_of(geometry, face), dvec3(0.0), resolution), 1, [&](const TrianglePiece& piece) {
        const ivec3 cell(glm::floor(middle_of(piece)));
        const auto [place, is_new] = cell_of_.try_emplace(cell_key(cell), static_cast<uint32_t>(cells_.size()));
        if (is_new) cells_.push_back({cell, {}});
        cells_[place->second].moments.add(piece);
      });
    }
  }

  /// Cells in order of first use that lie in thin layers: these layers, and for the others nothing.
  std::vector<std::optional<Layer>> find_layers() const {
    std::vector<std::optional<Layer>> layers(cells_.size());
    parallel_for(cells_.size(), 256, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) layers[i] = thin_layer(around(cells_[i].coordinate));
    });
    return layers;
  }

 private:
  struct Cell {
    ivec3 coordinate;
    Moments moments;
  };

  Moments around(const ivec3& cell) const {
    Moments sum;
    for_each_cell_around(cell, 1, [&](const ivec3& neighbour) {
      const auto found = cell_of_.find(cell_key(neighbour));
      if (found != cell_of_.end()) sum.add(cells_[found->second].moments);
    });
    return sum;
  }

  std::vector<Cell> cells_;
  std::unordered_map<uint64_t, uint32_t> cell_of_;
};

/// Whether rays along the layer's normal, from either side, see a wall.
bool looks_like_wall(const OpacityScene& scene, const Layer& layer, double resolution, uint64_t seed) {
  SplitMix random(seed);
  const BasicFrame<double> frame(layer.normal);
  double stopped = 0, cosines = 0, transmission = 0;
  for (uint32_t i = 0; i < kRays; ++i) {
    const double radius = kDisc * std::sqrt(random.next_unit()), turn = 2 * M_PI * random.next_unit();
    const double side = i % 2 == 0 ? 1 : -1;
    const dvec3 start = layer.middle + frame.to_world({radius * std::cos(turn), radius * std::sin(turn), side});
    const auto hit = scene.first_stop(vec3(start * resolution), vec3(-side * layer.normal),
                                      static_cast<float>(2 * resolution), random);
    if (!hit) continue;
    const dvec3 normal(hit->normal);
    const double length = glm::length(normal);
    ++stopped;
    if (length > 0) cosines += std::abs(glm::dot(normal, layer.normal)) / length;
    transmission += component_sum(scene.surface().materials[hit->triangle].transmission) / 3;
  }
  return stopped >= kLeastCovered * kRays && cosines >= kLeastAlignment * stopped &&
         transmission <= kMostTransmission * stopped;
}

/// Layers by the cells around them that they may answer for.
class LayerGrid {
 public:
  explicit LayerGrid(std::vector<Layer> layers) : layers_(std::move(layers)) {
    for (uint32_t i = 0; i < layers_.size(); ++i) {
      for_each_cell_around(ivec3(glm::floor(layers_[i].middle)), kNearCells,
                           [&](const ivec3& cell) { near_[cell_key(cell)].push_back(i); });
    }
  }

  bool owns(const dvec3& point) const {
    const auto found = near_.find(cell_key(ivec3(glm::floor(point))));
    if (found == near_.end()) return false;
    for (const uint32_t i : found->second) {
      if (layers_[i].owns(point)) return true;
    }
    return false;
  }

 private:
  std::vector<Layer> layers_;
  std::unordered_map<uint64_t, std::vector<uint32_t>> near_;
};

/// Per face: 1 where is_in(point, in units of `unit`) says yes for most of its area.
template <typename IsIn>
std::vector<uint8_t> faces_mostly_in(const Surface& geometry, double unit, const IsIn& is_in) {
  std::vector<uint8_t> result(geometry.triangles.size(), 0);
  parallel_for(result.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t f = begin; f < end; ++f) {
      double all = 0, inside = 0;
      for_each_piece(in_cells(corners_of(geometry, f), dvec3(0.0), unit), 1, [&](const TrianglePiece& piece) {
        const double area = glm::length(area_vector_of(piece));
        all += area;
        if (is_in(middle_of(piece))) inside += area;
      });
      result[f] = inside > 0.5 * all;
    }
  });
  return result;
}

}  // namespace

Result<std::vector<uint8_t>> find_walls(const Surface& geometry, double resolution) {
  std::vector<uint8_t> is_wall(geometry.triangles.size(), 0);
  const auto candidates = MomentGrid(geometry, resolution).find_layers();
  std::vector<Layer> layers;
  for (const auto& layer : candidates) {
    if (layer) layers.push_back(*layer);
  }
  if (layers.empty()) return is_wall;

  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(geometry));
  std::vector<uint8_t> is_seen(layers.size(), 0);
  parallel_for(layers.size(), 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) is_seen[i] = looks_like_wall(scene, layers[i], resolution, mix64(i));
  });
  std::vector<Layer> walls;
  for (size_t i = 0; i < layers.size(); ++i) {
    if (is_seen[i]) walls.push_back(layers[i]);
  }
  if (walls.empty()) return is_wall;

  const LayerGrid grid(std::move(walls));
  return faces_mostly_in(geometry, resolution, [&](const dvec3& point) { return grid.owns(point); });
}

std::vector<uint8_t> find_near(const Surface& geometry, const Surface& surface, const std::vector<uint8_t>& is_marked,
                               double distance) {
  std::unordered_set<uint64_t> near;
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    if (!is_marked[f]) continue;
    for_each_piece(in_cells(corners_of(surface, f), dvec3(0.0), distance), 1, [&](const TrianglePiece& piece) {
      for_each_cell_around(ivec3(glm::floor(middle_of(piece))), 1,
                           [&](const ivec3& cell) { near.insert(cell_key(cell)); });
    });
  }
  return faces_mostly_in(geometry, distance,
                         [&](const dvec3& point) { return near.contains(cell_key(ivec3(glm::floor(point)))); });
}

}  // namespace farfield
