// SPDX-License-Identifier: Apache-2.0
// [Loubet 2018, chapter 7 and appendix A]. The surface is explored from a face outwards through edges that touch the
// ball. Where it leaves the ball, a triangle cuts the sphere in arcs; their ends lie on edges, and neighbouring
// triangles share them. So the curve's topology is that of a graph whose nodes are (edge, end) pairs, and whether a
// node exists is decided once per vertex and edge: neighbours can not disagree, however the numbers round.
#include "prefilter/macrosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/index.h"
#include "base/index_map.h"
#include "base/parallel.h"
#include "prefilter/edge_table.h"
#include "prefilter/gentle_slopes.h"
#include "prefilter/surface_patches.h"

namespace farfield {

namespace {

/// Faces that one exploration may visit. Patches keep it far below that on all but crumpled surfaces, which are
/// sub-resolution anyway.
constexpr size_t kMaxExploredFaces = size_t{1} << 18;

/// One answer serves the faces around a point within this fraction of the resolution.
constexpr double kPatchRadius = 0.125;

/// Explorations cross blocks of this fraction of the resolution in one step: the ball is wide against them, and they
/// are wide against many faces.
constexpr double kBlockRadius = 0.0625;

/// Counts the connected components of a graph while nodes and links arrive.
class ComponentCounter {
 public:
  void clear() {
    nodes_.clear();
    parent_.clear();
    components_ = 0;
  }
  void link(uint32_t key_a, uint32_t key_b) {
    const uint32_t a = root(node(key_a)), b = root(node(key_b));
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --components_;
  }
  int components() const { return components_; }

 private:
  uint32_t node(uint32_t key) {
    const auto [index, is_new] = nodes_.insert(key);
    if (is_new) {
      parent_.push_back(index);
      ++components_;
    }
    return index;
  }
  uint32_t root(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  IndexMap nodes_;
  std::vector<uint32_t> parent_;
  int components_ = 0;
};

/// Evaluates the criterion of 7.1.2. Keeps its scratch memory between calls; one thread at a time.
class BallExplorer {
 public:
  BallExplorer(const Surface& surface, const EdgeTable& edges, const Blocks& blocks, double radius)
      : surface_(surface),
        edges_(edges),
        blocks_(blocks),
        radius_(radius),
        round_of_face_(surface.triangles.size(), 0),
        round_of_block_(blocks.center.size(), 0) {}

  bool is_on_macrosurface(uint32_t face) {
    center_ = evaluation_point(surface_, face);
    if (!touches_edges(face)) return true;  // the curve is a circle within the face
    ++round_;
    reached_ = 0;
    curve_.clear();
    front_.clear();
    block_front_.clear();
    reach(face);
    while (reached_ <= kMaxExploredFaces) {
      if (!front_.empty()) {
        explore(pop(front_));
      } else if (!block_front_.empty()) {
        for (const uint32_t outside : blocks_.outside_of(pop(block_front_))) reach(outside);
      } else {
        return curve_.components() == 1;
      }
    }
    return false;
  }

 private:
  /// Where an edge meets the ball, seen from its smaller to its larger vertex.
  struct EdgeCut {
    bool touches = false;  ///< some of it lies inside
    bool enters = false;   ///< the sphere is crossed from outside to inside: node 2 * edge
    bool leaves = false;   ///< and from inside to outside: node 2 * edge + 1
  };

  static uint32_t pop(std::vector<uint32_t>& stack) {
    const uint32_t last = stack.back();
    stack.pop_back();
    return last;
  }

  /// Notes a face that is connected to the first one: to be explored, or with all of its block, which the sphere does
  /// not meet and of which each edge touches the ball.
  void reach(uint32_t face) {
    const uint32_t block = blocks_.block_of_face[face];
    if (is_inside_ball(block)) {
      if (std::exchange(round_of_block_[block], round_) == round_) return;
      reached_ += blocks_.face_count[block];
      block_front_.push_back(block);
    } else {
      if (std::exchange(round_of_face_[face], round_) == round_) return;
      ++reached_;
      front_.push_back(face);
    }
  }

  bool is_inside_ball(uint32_t block) const {
    constexpr double kRounding = 1e-9;  // against what vertices on the sphere are taken for
    const double room = (1 - kRounding) * radius_ - blocks_.radius[block];
    const dvec3 offset = blocks_.center[block] - center_;
    return room > 0 && glm::dot(offset, offset) < room * room;
  }

  bool is_inside(uint32_t vertex) const {
    const dvec3 offset = dvec3(surface_.positions[vertex]) - center_;
    return glm::dot(offset, offset) <= radius_ * radius_;
  }

  EdgeCut cut(uint32_t edge) const {
    return cut(edge, is_inside(edges_.smaller_vertex[edge]), is_inside(edges_.larger_vertex[edge]));
  }

  EdgeCut cut(uint32_t edge, bool a_inside, bool b_inside) const {
    const uint32_t a = edges_.smaller_vertex[edge], b = edges_.larger_vertex[edge];
    if (a_inside || b_inside) return {true, !a_inside, !b_inside};
    const dvec3 origin = dvec3(surface_.positions[a]) - center_;
    const dvec3 direction = dvec3(surface_.positions[b]) - dvec3(surface_.positions[a]);
    const double length2 = glm::dot(direction, direction);
    const double along = -glm::dot(origin, direction);
    if (!(along > 0 && along < length2)) return {};
    const dvec3 nearest = origin + direction * (along / length2);
    const bool is_cut = glm::dot(nearest, nearest) < radius_ * radius_;
    return {is_cut, is_cut, is_cut};
  }

  bool touches_edges(uint32_t face) const {
    const uvec3& e = edges_.face_edges[face];
    return cut(e.x).touches || cut(e.y).touches || cut(e.z).touches;
  }

  /// Adds the face's arcs to the curve, and its neighbours through edges that touch the ball to the exploration.
  void explore(uint32_t face) {
    // The part of a triangle inside a ball is convex. So along the triangle's boundary, where it leaves the ball an arc
    // begins, and that arc ends where the boundary next enters again.
    struct Crossing {
      uint32_t node;
      bool enters;
    };
    const uvec3& corners = surface_.triangles[face];
    const std::array<bool, 3> inside = {is_inside(corners.x), is_inside(corners.y), is_inside(corners.z)};
    std::array<Crossing, 6> crossings;
    size_t count = 0;
    for (int c = 0; c < 3; ++c) {
      const uint32_t edge = edges_.face_edges[face][c];
      const bool forward = corners[c] == edges_.smaller_vertex[edge];
      const bool starts_inside = inside[static_cast<size_t>(c)];
      const bool ends_inside = inside[static_cast<size_t>(next_corner(c))];
      const EdgeCut edge_cut = forward ? cut(edge, starts_inside, ends_inside) : cut(edge, ends_inside, starts_inside);
      if (!edge_cut.touches) continue;
      for (const uint32_t neighbour : edges_.faces_of(edge)) {
        if (neighbour != face) reach(neighbour);
      }
      const Crossing at_enter{2 * edge, forward}, at_leave{2 * edge + 1, !forward};
      if (forward && edge_cut.enters) crossings[count++] = at_enter;
      if (edge_cut.leaves) crossings[count++] = at_leave;
      if (!forward && edge_cut.enters) crossings[count++] = at_enter;
    }
    for (size_t i = 0; i < count; ++i) {
      if (!crossings[i].enters) curve_.link(crossings[i].node, crossings[(i + 1) % count].node);
    }
  }

  const Surface& surface_;
  const EdgeTable& edges_;
  const Blocks& blocks_;
  const double radius_;
  dvec3 center_{0.0};
  uint32_t round_ = 0;                    ///< counts calls
  std::vector<uint32_t> round_of_face_;   ///< in which it was last reached
  std::vector<uint32_t> round_of_block_;  ///< in which it was last reached as a whole
  std::vector<uint32_t> front_;           ///< faces that are reached, not explored
  std::vector<uint32_t> block_front_;
  size_t reached_ = 0;  ///< faces
  ComponentCounter curve_;
};

/// A set of faces that are connected through edges and have the same class.
struct Piece {
  uint8_t is_macrosurface;
  std::vector<uint32_t> faces;
};

std::vector<Piece> connected_pieces(const EdgeTable& edges, const std::vector<uint8_t>& is_macrosurface) {
  std::vector<Piece> pieces;
  std::vector<uint8_t> is_taken(is_macrosurface.size(), 0);
  for (uint32_t first = 0; first < is_macrosurface.size(); ++first) {
    if (is_taken[first]) continue;
    is_taken[first] = 1;
    Piece piece{is_macrosurface[first], {first}};
    for (size_t i = 0; i < piece.faces.size(); ++i) {
      const uvec3 face_edges = edges.face_edges[piece.faces[i]];
      for (int c = 0; c < 3; ++c) {
        for (const uint32_t neighbour : edges.faces_of(face_edges[c])) {
          if (is_taken[neighbour] || is_macrosurface[neighbour] != piece.is_macrosurface) continue;
          is_taken[neighbour] = 1;
          piece.faces.push_back(neighbour);
        }
      }
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

/// Whether all the faces fit into a ball of that radius. Walks towards the smallest ball [Badoiu and Clarkson 2003]:
/// the answer is exact but for sizes within about 2 % of the radius.
bool fits_into_ball(const Surface& surface, const std::vector<uint32_t>& faces, double radius) {
  constexpr int kSteps = 64;
  Box3 box;
  for (const uint32_t face : faces) {
    for (int c = 0; c < 3; ++c) box.extend(surface.positions[surface.triangles[face][c]]);
  }
  const dvec3 size(box.size());
  if (!(0.5 * std::max(size.x, std::max(size.y, size.z)) <= radius)) return false;
  if (0.5 * glm::length(size) <= radius) return true;
  dvec3 center(box.center());
  for (int step = 0; step < kSteps; ++step) {
    dvec3 farthest = center;
    double farthest2 = 0;
    for (const uint32_t face : faces) {
      for (int c = 0; c < 3; ++c) {
        const dvec3 p = corner_position(surface, face, c);
        const double distance2 = glm::dot(p - center, p - center);
        if (distance2 > farthest2) farthest2 = distance2, farthest = p;
      }
    }
    if (farthest2 <= radius * radius) return true;
    center += (farthest - center) / (step + 2.0);
  }
  return false;
}

/// How much of the piece's outline borders on the other class rather than on nothing, in [0, 1]; 0 without outline.
double surrounded_part(const Surface& surface, const EdgeTable& edges, const std::vector<uint8_t>& is_macrosurface,
                       const Piece& piece) {
  double outline = 0, surrounded = 0;
  for (const uint32_t face : piece.faces) {
    for (int c = 0; c < 3; ++c) {
      const auto neighbours = edges.faces_of(edges.face_edges[face][c]);
      const bool meets_other = std::any_of(neighbours.begin(), neighbours.end(), [&](uint32_t neighbour) {
        return is_macrosurface[neighbour] != piece.is_macrosurface;
      });
      if (!meets_other && neighbours.size() != 1) continue;
      const double length =
          glm::length(corner_position(surface, face, next_corner(c)) - corner_position(surface, face, c));
      outline += length;
      if (meets_other) surrounded += length;
    }
  }
  return outline > 0 ? surrounded / outline : 0.0;
}

/// Pieces of macrosurface that do not cover a pixel become sub-resolution (7.2.2).
void drop_small_pieces(const Surface& surface, const EdgeTable& edges, double resolution,
                       std::vector<uint8_t>& is_macrosurface) {
  for (const Piece& piece : connected_pieces(edges, is_macrosurface)) {
    if (!piece.is_macrosurface || !fits_into_ball(surface, piece.faces, resolution)) continue;
    for (const uint32_t face : piece.faces) is_macrosurface[face] = 0;
  }
}

/// Small sub-resolution islands in macrosurfaces join them (7.3): seams cost more than they bring.
void fill_small_islands(const Surface& surface, const EdgeTable& edges, double resolution,
                        std::vector<uint8_t>& is_macrosurface) {
  constexpr double kMostly = 0.3;  // the corner of a square, the tip of a leaf
  const std::vector<uint8_t> before = is_macrosurface;
  for (const Piece& piece : connected_pieces(edges, before)) {
    if (piece.is_macrosurface || surrounded_part(surface, edges, before, piece) < kMostly) continue;
    if (!fits_into_ball(surface, piece.faces, resolution)) continue;
    for (const uint32_t face : piece.faces) is_macrosurface[face] = 1;
  }
}

}  // namespace

std::vector<uint8_t> classify_macrosurface(const Surface& surface, float resolution, const Job& job) {
  if (!(resolution > 0)) return std::vector<uint8_t>(surface.triangles.size(), 1);
  const EdgeTable edges = build_edge_table(surface.triangles, surface.positions.size());
  const Patches patches = make_patches(surface, edges, kPatchRadius * resolution);
  const Blocks blocks = make_blocks(surface, edges, kBlockRadius * resolution);
  const std::vector<uint8_t> is_gentle = find_gentle_faces(surface, edges, blocks, resolution, job);

  std::vector<uint8_t> patch_is_macrosurface(patches.seeds.size());
  const size_t grain = std::max<size_t>(256, patches.seeds.size() / 64);  // an explorer has room for each face
  parallel_for(patches.seeds.size(), grain, [&](size_t begin, size_t end) {
    BallExplorer explorer(surface, edges, blocks, resolution);
    for (size_t i = begin; i < end && !job.is_cancelled(); ++i) {
      const uint32_t seed = patches.seeds[i];
      patch_is_macrosurface[i] = is_gentle[seed] || explorer.is_on_macrosurface(seed);
    }
  });

  std::vector<uint8_t> is_macrosurface(surface.triangles.size());
  for (size_t face = 0; face < is_macrosurface.size(); ++face) {
    is_macrosurface[face] = patch_is_macrosurface[patches.patch_of_face[face]];
  }
  if (job.is_cancelled()) return is_macrosurface;
  drop_small_pieces(surface, edges, resolution, is_macrosurface);
  fill_small_islands(surface, edges, resolution, is_macrosurface);
  return is_macrosurface;
}

}  // namespace farfield
