// SPDX-License-Identifier: Apache-2.0
// The geometry's moments are summed up per cell of one resolution. Cells whose 3^3 neighbourhood is a thin layer are
// looked at by rays along its normal. Lengths are in resolutions but where rays are cast.
#include "prefilter/walls.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/split_mix.h"
#include "prefilter/disjoint_sets.h"
#include "prefilter/grid_cells.h"
#include "prefilter/layers.h"
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
constexpr double kLeastCovered = 0.8;              ///< share of them that a closed wall must stop
constexpr double kLeastAlignment = 0.85;           ///< mean cosine between what stops them and the layer's normal
constexpr double kLeastSheetCovered = 0.1;         ///< the same of walls that are half open
constexpr double kLeastSheetAlignment = 0.6;       ///< round wires have 0.79, chain links as little as leaves, 0.67
constexpr size_t kLeastSheetCells = 32;            ///< that such a wall reaches through
constexpr double kSmallDisc = 0.5;                 ///< radius of one that gaps between pieces should not be as wide as
constexpr double kLeastInSmallDisc = 0.5;          ///< what it covers against the median
constexpr double kLeastEven = 0.9, kEven = 0.125;  ///< share of its cells that cover what its median does, so near
constexpr double kSameNormal = 0.9, kSamePlane = 0.35;  ///< cosine, distance: of neighbours in one wall
constexpr double kMostTransmission = 0.02;              ///< mean albedo of what stops them
constexpr double kNearPlane = 0.75, kNearMiddle = 2.0;  ///< what a layer's middle answers for
constexpr int kNearCells = 3;                           ///< cells around it that reach so far
// Of a layer's core. Pieces that fill a layer evenly reach 1.7 standard deviations of their heights.
constexpr double kInsideLayer = 1.3;  ///< of these, above its plane
constexpr double kFlat = 0.02;        ///< beside that, for pieces without thickness
constexpr double kLeastCore = 0.5;    ///< share of the disc's rays that it stops
constexpr double kAtLayer = 0.5;      ///< what is of the same surface and no higher goes with it

/// Whether a layer's middle answers for a point no higher above its plane than this.
bool answers_for(const Layer& layer, const dvec3& point, double highest) {
  const dvec3 offset = point - layer.middle;
  const double height = layer.height(point);
  return std::abs(height) <= highest && glm::dot(offset, offset) - height * height <= kNearMiddle * kNearMiddle;
}

struct ThinLayer : Layer {
  double spread;  ///< standard deviation of heights
};

/// The layer that these moments are of, if they are of a thin one.
std::optional<ThinLayer> thin_layer(const Moments& moments) {
  if (!(moments.area > 0)) return {};
  const glm::dmat3 m = moments.covariance();
  const dvec3 variance = eigenvalues_of(m);
  if (!(variance.y >= kLeastExtent2 && variance.z <= kMostThickness2)) return {};
  const auto normal = eigenvector(m, variance.z);
  if (!normal) return {};
  return ThinLayer{{moments.middle(), *normal}, std::sqrt(std::max(variance.z, 0.0))};
}

struct LayerCell {
  ivec3 cell;
  ThinLayer layer;
};

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

  /// The cells that lie in thin layers, in order of first use.
  std::vector<LayerCell> find_layers() const {
    std::vector<std::optional<ThinLayer>> layers(cells_.size());
    parallel_for(cells_.size(), 256, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) layers[i] = thin_layer(around(cells_[i].coordinate));
    });
    std::vector<LayerCell> result;
    for (size_t i = 0; i < layers.size(); ++i) {
      if (layers[i]) result.push_back({cells_[i].coordinate, *layers[i]});
    }
    return result;
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

/// What rays along the layer's normal, from either side, see of it.
struct LayerSeen {
  double covered = 0;         ///< share of the rays that is stopped
  double alignment = 0;       ///< mean cosine between what stops them and the normal
  double transmission = 0;    ///< mean albedo
  double covered_nearby = 0;  ///< of parts of sheets: within kSmallDisc

  bool is_closed() const { return covered >= kLeastCovered && alignment >= kLeastAlignment && is_opaque(); }
  bool is_part_of_sheet() const {
    return covered >= kLeastSheetCovered && alignment >= kLeastSheetAlignment && is_opaque();
  }
  bool is_opaque() const { return transmission <= kMostTransmission; }
};

/// By rays at a disc around the layer's middle, from so high on either side to as far below.
LayerSeen look_at(const OpacityScene& scene, const Layer& layer, double resolution, double disc, double height,
                  SplitMix& random) {
  const BasicFrame<double> frame(layer.normal);
  double stopped = 0, cosines = 0, transmission = 0;
  for (uint32_t i = 0; i < kRays; ++i) {
    const double radius = disc * std::sqrt(random.next_unit()), turn = 2 * M_PI * random.next_unit();
    const double side = i % 2 == 0 ? 1 : -1;
    const dvec3 start =
        layer.middle + frame.to_world({radius * std::cos(turn), radius * std::sin(turn), height * side});
    const auto hit = scene.first_stop(vec3(start * resolution), vec3(-side * layer.normal),
                                      static_cast<float>(2 * height * resolution), random);
    if (!hit) continue;
    const dvec3 normal(hit->normal);
    const double length = glm::length(normal);
    ++stopped;
    if (length > 0) cosines += std::abs(glm::dot(normal, layer.normal)) / length;
    transmission += component_sum(scene.surface().materials[hit->triangle].transmission) / 3;
  }
  if (!(stopped > 0)) return {};
  return {stopped / kRays, cosines / stopped, transmission / stopped};
}

LayerSeen look_at(const OpacityScene& scene, const Layer& layer, double resolution, uint64_t seed) {
  SplitMix random(seed);
  LayerSeen seen = look_at(scene, layer, resolution, kDisc, 1, random);
  if (seen.is_part_of_sheet()) {
    seen.covered_nearby = look_at(scene, layer, resolution, kSmallDisc, 1, random).covered;
  }
  return seen;
}

/// Per layer that is_wall: whether it has a core, an opaque part of this surface that runs along inside it.
Result<std::vector<uint8_t>> find_cores(const std::vector<LayerCell>& cells, const std::vector<uint8_t>& is_wall,
                                        const Surface& macrosurface, double resolution) {
  std::vector<uint8_t> has_core(cells.size(), 0);
  if (macrosurface.triangles.empty() || std::ranges::count(is_wall, 1) == 0) return has_core;
  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(macrosurface));
  parallel_for(cells.size(), 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (!is_wall[i]) continue;
      SplitMix random(mix64(i));
      const double height = kInsideLayer * cells[i].layer.spread + kFlat;
      const LayerSeen seen = look_at(scene, cells[i].layer, resolution, kDisc, height, random);
      has_core[i] = seen.covered >= kLeastCore && seen.alignment >= kLeastAlignment && seen.is_opaque();
    }
  });
  return has_core;
}

/// Layers that go on from cell to cell. What is no part of a sheet is alone.
DisjointSets connect(const std::vector<LayerCell>& cells, const std::vector<LayerSeen>& seen) {
  DisjointSets connected(cells.size());
  std::unordered_map<uint64_t, uint32_t> number;
  for (uint32_t i = 0; i < cells.size(); ++i) {
    if (seen[i].is_part_of_sheet()) number[cell_key(cells[i].cell)] = i;
  }
  for (uint32_t i = 0; i < cells.size(); ++i) {
    if (!seen[i].is_part_of_sheet()) continue;
    const Layer& a = cells[i].layer;
    for_each_cell_around(cells[i].cell, 1, [&](const ivec3& cell) {
      const auto found = number.find(cell_key(cell));
      if (found == number.end()) return;
      const Layer& b = cells[found->second].layer;
      const bool goes_on = std::abs(glm::dot(a.normal, b.normal)) >= kSameNormal &&
                           std::abs(a.height(b.middle)) <= kSamePlane && std::abs(b.height(a.middle)) <= kSamePlane;
      if (goes_on) connected.join(i, found->second);
    });
  }
  return connected;
}

/// Whether these cells are a half-open wall. Planks, wires and holes are as open everywhere; scales, feathers and
/// leaves that happen to lie in a layer are not, nor are ropes that are farther from one another than a resolution
/// (docs/decisions/0031).
bool is_half_open(const std::vector<const LayerSeen*>& cells) {
  if (cells.size() < kLeastSheetCells) return false;
  std::vector<double> covered;
  for (const LayerSeen* cell : cells) covered.push_back(cell->covered);
  const auto middle = covered.begin() + static_cast<ptrdiff_t>(covered.size() / 2);
  std::ranges::nth_element(covered, middle);
  const auto count = static_cast<double>(covered.size());
  const double median = *middle, mean = std::accumulate(covered.begin(), covered.end(), 0.0) / count;
  const auto even = std::ranges::count_if(cells, [&](const LayerSeen* cell) {
    return std::abs(cell->covered - median) <= kEven && cell->covered_nearby >= kLeastInSmallDisc * median;
  });
  return mean < kLeastCovered && static_cast<double>(even) >= kLeastEven * count;
}

/// Per layer: whether it belongs to a half-open wall.
std::vector<uint8_t> find_sheets(const std::vector<LayerCell>& cells, const std::vector<LayerSeen>& seen) {
  DisjointSets connected = connect(cells, seen);
  std::vector<std::vector<const LayerSeen*>> parts(cells.size());
  for (uint32_t i = 0; i < cells.size(); ++i) parts[connected.least_of(i)].push_back(&seen[i]);
  std::vector<uint8_t> is_sheet(cells.size(), 0);
  for (uint32_t i = 0; i < cells.size(); ++i) {
    const uint32_t first = connected.least_of(i);
    is_sheet[i] = first == i ? is_half_open(parts[i]) : is_sheet[first];
  }
  return is_sheet;
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

  bool owns(const dvec3& point, double highest) const {
    const auto found = near_.find(cell_key(ivec3(glm::floor(point))));
    if (found == near_.end()) return false;
    for (const uint32_t i : found->second) {
      if (answers_for(layers_[i], point, highest)) return true;
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

/// Per face: 1 where these layers answer for most of its area, no higher than this above their planes.
std::vector<uint8_t> faces_owned(const Surface& geometry, double resolution, std::vector<Layer> layers,
                                 double highest) {
  const LayerGrid grid(std::move(layers));
  return faces_mostly_in(geometry, resolution, [&](const dvec3& point) { return grid.owns(point, highest); });
}

}  // namespace

Result<Walls> find_walls(const Surface& geometry, const Surface& macrosurface, double resolution) {
  Walls walls{std::vector<WallKind>(geometry.triangles.size(), WallKind::None),
              std::vector<uint8_t>(macrosurface.triangles.size(), 0)};
  const std::vector<LayerCell> cells = MomentGrid(geometry, resolution).find_layers();
  if (cells.empty()) return walls;

  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(geometry));
  std::vector<LayerSeen> seen(cells.size());
  parallel_for(cells.size(), 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) seen[i] = look_at(scene, cells[i].layer, resolution, mix64(i));
  });
  const std::vector<uint8_t> is_sheet = find_sheets(cells, seen);
  std::vector<uint8_t> is_wall(cells.size());
  for (size_t i = 0; i < cells.size(); ++i) is_wall[i] = is_sheet[i] || seen[i].is_closed();
  FARFIELD_TRY_LET(const auto has_core, find_cores(cells, is_wall, macrosurface, resolution));
  std::vector<Layer> closed, sheets, with_core;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (!is_wall[i]) continue;
    (is_sheet[i] && !has_core[i] ? sheets : closed).push_back(cells[i].layer);
    if (has_core[i]) with_core.push_back(cells[i].layer);
  }
  const auto mark = [&](std::vector<Layer> layers, WallKind kind) {
    if (layers.empty()) return;
    const auto is_owned = faces_owned(geometry, resolution, std::move(layers), kNearPlane);
    for (size_t f = 0; f < is_owned.size(); ++f) {
      if (is_owned[f]) walls.kinds[f] = kind;
    }
  };
  mark(std::move(sheets), WallKind::HalfOpen);
  mark(std::move(closed), WallKind::Closed);  // has the last say
  if (!with_core.empty()) {
    walls.is_core = faces_owned(macrosurface, resolution, std::move(with_core), kAtLayer);
  }
  return walls;
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
