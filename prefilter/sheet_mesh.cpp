// SPDX-License-Identifier: Apache-2.0
// Surface nets [Gibson 1998] between the two sides of a plane that is fitted around each place (moving least squares):
// a cell of the lattice has a vertex in its plane, and four cells around an edge whose ends are on different sides have
// a face. Sides are of planes, which have no front: an edge's ends agree on one, so that no orientation is needed.
// Lengths are in cells.
#include "prefilter/sheet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "base/parallel.h"
#include "prefilter/edge_table.h"
#include "prefilter/grid_cells.h"
#include "prefilter/layers.h"
#include "prefilter/triangle_pieces.h"
#include "prefilter/wall_pieces.h"

namespace farfield {
namespace {

constexpr double kCell = 0.5;      ///< of the resolution
constexpr double kShift = 0.37;    ///< keeps the lattice off planes that sources like
constexpr int kFitReach = 4;       ///< cells: of what a plane is fitted to
constexpr double kFlatness = 0.5;  ///< variance along the normal against that of the shorter axis across: most
constexpr double kLeastArea = 1e-4;

/// Planes through the middle of the geometry around a place.
class PlaneField {
 public:
  explicit PlaneField(const Surface& pieces, const dvec3& origin, double cell_size) {
    for (size_t face = 0; face < pieces.triangles.size(); ++face) {
      for_each_piece(in_cells(corners_of(pieces, face), origin, cell_size), 1, [&](const TrianglePiece& piece) {
        cells_[cell_key(ivec3(glm::floor(middle_of(piece))))].add(piece);
      });
    }
  }

  std::optional<Layer> at(const dvec3& place) const {
    Moments sum;
    for_each_cell_around(ivec3(glm::floor(place)), kFitReach, [&](const ivec3& cell) {
      const auto found = cells_.find(cell_key(cell));
      if (found == cells_.end()) return;
      const dvec3 offset = found->second.middle() - place;
      const double near = 1 - glm::dot(offset, offset) / (kFitReach * kFitReach);
      if (near > 0) sum.add(found->second, near * near);
    });
    if (!(sum.area > 0)) return {};
    const glm::dmat3 covariance = sum.covariance();
    const dvec3 variance = eigenvalues_of(covariance);
    if (!(variance.z <= kFlatness * variance.y)) return {};
    const auto normal = eigenvector(covariance, variance.z);
    if (!normal) return {};
    return Layer{sum.middle(), *normal};
  }

  /// Cells that geometry lies in, and their neighbours, in order of their keys.
  std::vector<ivec3> cells_nearby() const {
    std::unordered_set<uint64_t> keys;
    for (const auto& [key, moments] : cells_) {
      for_each_cell_around(cell_of_key(key), 1, [&](const ivec3& cell) { keys.insert(cell_key(cell)); });
    }
    std::vector<uint64_t> sorted(keys.begin(), keys.end());
    std::ranges::sort(sorted);
    std::vector<ivec3> cells;
    for (const uint64_t key : sorted) cells.push_back(cell_of_key(key));
    return cells;
  }

 private:
  std::unordered_map<uint64_t, Moments> cells_;
};

/// The net, in cells.
class SurfaceNet {
 public:
  SurfaceNet(const PlaneField& planes, const std::vector<ivec3>& cells) {
    // A cell's lower corner is its node: of the nodes above the last cells, no edge has four cells.
    std::vector<std::optional<Layer>> at_node(cells.size()), at_middle(cells.size());
    parallel_for(cells.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        at_node[i] = planes.at(dvec3(cells[i]));
        at_middle[i] = planes.at(dvec3(cells[i]) + 0.5);
      }
    });
    for (size_t i = 0; i < cells.size(); ++i) {
      if (at_node[i]) nodes_[cell_key(cells[i])] = {at_node[i]->height(dvec3(cells[i])), at_node[i]->normal};
      if (at_middle[i]) middles_[cell_key(cells[i])] = *at_middle[i];
    }
    for (const ivec3& cell : cells) {
      for (int axis = 0; axis < 3; ++axis) add_face(cell, axis);
    }
  }

  std::vector<dvec3> positions;
  std::vector<dvec3> normals;  ///< of the planes, either side
  std::vector<uvec3> triangles;

 private:
  struct Node {
    double height;
    dvec3 normal;
  };

  void add_face(const ivec3& node, int axis) {
    ivec3 step(0), u(0), v(0);
    step[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
    const auto from = nodes_.find(cell_key(node)), to = nodes_.find(cell_key(node + step));
    if (from == nodes_.end() || to == nodes_.end()) return;
    const Node &a = from->second, &b = to->second;
    const bool is_turned = glm::dot(a.normal, b.normal) < 0;
    if (((a.height < 0) != (b.height < 0)) == is_turned) return;
    const std::array<ivec3, 4> cells = {node - u - v, node - v, node, node - u};
    std::array<uint32_t, 4> corner;
    for (size_t i = 0; i < 4; ++i) {
      if (!middles_.contains(cell_key(cells[i]))) return;
    }
    for (size_t i = 0; i < 4; ++i) corner[i] = vertex(cells[i]);
    triangles.emplace_back(corner[0], corner[1], corner[2]);
    triangles.emplace_back(corner[0], corner[2], corner[3]);
  }

  uint32_t vertex(const ivec3& cell) {
    const auto [place, is_new] = vertex_of_.try_emplace(cell_key(cell), static_cast<uint32_t>(positions.size()));
    if (is_new) {
      const Layer& layer = middles_.at(cell_key(cell));
      const dvec3 middle = dvec3(cell) + 0.5;
      positions.push_back(middle - layer.height(middle) * layer.normal);
      normals.push_back(layer.normal);
    }
    return place->second;
  }

  std::unordered_map<uint64_t, Node> nodes_;
  std::unordered_map<uint64_t, Layer> middles_;
  std::unordered_map<uint64_t, uint32_t> vertex_of_;
};

/// Vertices at borders, and their neighbours: the lattice goes up to one and a half cells beyond the pieces.
std::vector<uint8_t> near_border(const SurfaceNet& net) {
  const EdgeTable edges = build_edge_table(net.triangles, net.positions.size());
  std::vector<uint8_t> is_border(net.positions.size(), 0);
  for (uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.faces_of(e).size() == 1) is_border[edges.smaller_vertex[e]] = is_border[edges.larger_vertex[e]] = 1;
  }
  std::vector<uint8_t> result = is_border;
  for (const uvec3& t : net.triangles) {
    if (is_border[t.x] || is_border[t.y] || is_border[t.z]) result[t.x] = result[t.y] = result[t.z] = 1;
  }
  return result;
}

}  // namespace

Surface make_sheet_mesh(const Surface& pieces, double resolution) {
  const double cell_size = kCell * resolution;
  const dvec3 origin = dvec3(pieces.bounds().lower) - kShift * cell_size;
  const PlaneField planes(pieces, origin, cell_size);
  SurfaceNet net(planes, planes.cells_nearby());

  const NearestPoint nearest(pieces, origin, cell_size);
  const std::vector<uint8_t> is_near_border = near_border(net);
  parallel_for(net.positions.size(), 64, [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (!is_near_border[v]) continue;
      const dvec3 way = nearest.to(net.positions[v]) - net.positions[v];
      net.positions[v] += way - glm::dot(way, net.normals[v]) * net.normals[v];
    }
  });

  Surface sheet;
  sheet.origin = pieces.origin;
  for (const dvec3& p : net.positions) sheet.positions.emplace_back(origin + p * cell_size);
  for (const uvec3& t : net.triangles) {
    const dvec3 area = glm::cross(net.positions[t.y] - net.positions[t.x], net.positions[t.z] - net.positions[t.x]);
    if (glm::length(area) > kLeastArea) sheet.triangles.push_back(t);
  }
  return sheet;
}

}  // namespace farfield
