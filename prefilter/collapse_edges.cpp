// SPDX-License-Identifier: Apache-2.0
// Edge collapse, shortest edge first [Loubet 2018, 8.1 to 8.3]. Connected parts of the surface never touch each other,
// so each is simplified on its own, with its own numbering, by one thread.
#include "prefilter/collapse_edges.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

#include "base/index.h"
#include "base/parallel.h"
#include "prefilter/collapse_limits.h"
#include "prefilter/edge_table.h"
#include "prefilter/length_queue.h"
#include "prefilter/material_filter.h"
#include "prefilter/surface_parts.h"
#include "prefilter/vertex_placement.h"
#include "prefilter/vertex_stars.h"

namespace farfield {

namespace {

constexpr double kShortEdge = 0.36;  ///< edges below this part of the resolution collapse (thesis 7.3: about eps / 2)
constexpr double kLongEdge = 1.0;    ///< and none becomes longer than this part (8.1.1)
constexpr double kPlacementTolerance = 0.01;  ///< of the resolution (8.2.3)

/// An edge seen from one of its vertices.
struct Spoke {
  uint32_t vertex;  ///< at the other end
  uint32_t faces;   ///< that share the edge: 2 where the surface is manifold, 1 at a border
};

/// A vertex by its feature edges, those with other than two faces: borders and non-manifold curves.
enum class VertexKind {
  Interior,  ///< none: may go anywhere
  Curve,     ///< two of the same kind: may move along them
  Corner,    ///< others: stays where it is
};

/// One connected part of a surface: a mesh whose edges can collapse. Faces that collapse and vertices that merge stay
/// in the arrays, marked. One thread at a time.
class CollapsibleMesh {
 public:
  std::vector<dvec3> positions;
  std::vector<uvec3> triangles;
  std::span<const uint32_t> faces;    ///< per face: its number in the whole surface
  std::span<FaceMaterial> materials;  ///< of the whole surface; no other part touches those of `faces`
  std::vector<uint32_t> merged_into;  ///< per vertex: itself while it lives, else a smaller one
  std::vector<uint8_t> is_face_alive;
  std::vector<uint8_t> is_flipped;  ///< per face: see flipped_faces()
  std::vector<uint32_t> version;    ///< per vertex: how often it changed
  std::vector<double> deviation;    ///< per vertex: bound of the distance to the input around it
  std::vector<uint8_t> is_fixed;    ///< per face: keeps its corners where they are; empty: none does
  std::vector<uint8_t> is_pinned;   ///< per vertex: stays where it is; empty: none does

  FaceMaterial& material(uint32_t face) { return materials[faces[face]]; }

  /// Call once the arrays of positions and triangles are filled.
  void build_topology() {
    merged_into.resize(positions.size());
    std::iota(merged_into.begin(), merged_into.end(), 0u);
    is_face_alive.assign(triangles.size(), 1);
    version.assign(positions.size(), 0);
    deviation.assign(positions.size(), 0.0);
    stars_ = VertexStars(positions.size(), triangles.size(), [&](uint32_t face, const auto& visit) {
      for (int c = 0; c < 3; ++c) visit(triangles[face][c]);
    });
    is_flipped = flipped_faces(triangles, build_edge_table(triangles, positions.size()));
  }

  /// The living faces around a vertex. Valid until the next merge().
  std::span<const uint32_t> star(uint32_t vertex) const { return stars_.of(vertex); }

  bool has_corner(uint32_t face, uint32_t vertex) const {
    const uvec3& t = triangles[face];
    return t.x == vertex || t.y == vertex || t.z == vertex;
  }

  /// The edges at a vertex, ascending by the other end.
  void find_spokes(uint32_t vertex, std::vector<Spoke>& spokes) const {
    spokes.clear();
    for (const uint32_t face : star(vertex)) {
      for (int c = 0; c < 3; ++c) {
        if (triangles[face][c] != vertex) spokes.push_back({triangles[face][c], 1});
      }
    }
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.vertex < b.vertex; });
    size_t count = 0;
    for (const Spoke& spoke : spokes) {
      if (count > 0 && spokes[count - 1].vertex == spoke.vertex) {
        ++spokes[count - 1].faces;
      } else {
        spokes[count++] = spoke;
      }
    }
    spokes.resize(count);
  }

  /// Vertex b becomes a; `kept` are the faces around both that do not collapse, `collapsing` the others.
  void merge(uint32_t a, uint32_t b, std::span<const uint32_t> kept, std::span<const uint32_t> collapsing) {
    for (const uint32_t face : collapsing) {
      is_face_alive[face] = 0;
      for (int c = 0; c < 3; ++c) {
        if (triangles[face][c] != a && triangles[face][c] != b) stars_.remove(triangles[face][c], face);
      }
    }
    for (const uint32_t face : kept) {
      for (int c = 0; c < 3; ++c) {
        if (triangles[face][c] == b) triangles[face][c] = a;
      }
    }
    if (!is_pinned.empty()) is_pinned[a] |= is_pinned[b];
    merged_into[b] = a;
    stars_.clear(b);
    stars_.replace(a, kept);
    ++version[a];
    ++version[b];
  }

 private:
  VertexStars stars_;
};

/// Collapses the edges of one mesh.
class Simplifier {
 public:
  Simplifier(CollapsibleMesh& mesh, const EdgeCollapseOptions& options, const Job& job)
      : mesh_(mesh),
        resolution_(options.resolution),
        placement_(options.placement),
        job_(job),
        queue_(kShortEdge * kShortEdge * resolution_ * resolution_, 3 * mesh.triangles.size() / 2) {}

  void run() {
    for (uint32_t v = 0; v < mesh_.positions.size(); ++v) {
      mesh_.find_spokes(v, spokes_a_);
      for (const Spoke& spoke : spokes_a_) {
        if (v < spoke.vertex) push(v, spoke.vertex);
      }
    }
    Candidate candidate;
    while (!job_.is_cancelled() && queue_.pop(candidate)) {
      if (!is_current(candidate) || !try_collapse(candidate.a, candidate.b)) continue;
      for (const uint32_t neighbour : neighbours_) push(candidate.a, neighbour);
    }
  }

 private:
  struct Candidate {
    double length2 = 0;
    uint32_t a = 0, b = 0;  ///< a < b
    uint32_t version_a = 0, version_b = 0;

    /// For a queue whose top is the shortest edge; equally long ones in the order of their vertices.
    friend bool operator<(const Candidate& l, const Candidate& r) {
      if (l.length2 != r.length2) return l.length2 > r.length2;
      return l.a != r.a ? l.a > r.a : l.b > r.b;
    }
  };

  void push(uint32_t v, uint32_t w) {
    const double length2 = squared_length(mesh_.positions[w] - mesh_.positions[v]);
    const double limit = kShortEdge * resolution_;
    if (!(length2 < limit * limit)) return;
    const auto [a, b] = std::minmax(v, w);
    queue_.push({length2, a, b, mesh_.version[a], mesh_.version[b]});
  }

  bool is_current(const Candidate& candidate) const {
    return mesh_.version[candidate.a] == candidate.version_a && mesh_.version[candidate.b] == candidate.version_b;
  }

  bool try_collapse(uint32_t a, uint32_t b) {
    if (mesh_.star(a).size() + mesh_.star(b).size() > kMaxStarFaces) return false;
    gather_faces(a, b);
    if (has_fixed_face()) return false;
    mesh_.find_spokes(a, spokes_a_);
    mesh_.find_spokes(b, spokes_b_);
    if (kept_.empty() || !keeps_topology(a, b)) return false;
    fill_ring(a, b);
    const std::optional<dvec3> x = find_place(a, b);
    if (!x || !keeps_edges_short(a, b, *x) || !keeps_faces(*x)) return false;
    const double deviation = deviation_at(ring_, *x) + std::max(mesh_.deviation[a], mesh_.deviation[b]);
    if (!(deviation <= kMaxDeviation * resolution_)) return false;
    commit(a, b, *x, deviation);
    return true;
  }

  /// kept_, then collapsing_: the faces around both vertices.
  void gather_faces(uint32_t a, uint32_t b) {
    kept_.clear();
    collapsing_.clear();
    for (const uint32_t face : mesh_.star(a)) (mesh_.has_corner(face, b) ? collapsing_ : kept_).push_back(face);
    kept_of_a_ = kept_.size();
    for (const uint32_t face : mesh_.star(b)) {
      if (!mesh_.has_corner(face, a)) kept_.push_back(face);
    }
  }

  bool has_fixed_face() const {
    if (mesh_.is_fixed.empty()) return false;
    const auto is_fixed = [&](uint32_t face) { return mesh_.is_fixed[face] != 0; };
    return std::ranges::any_of(kept_, is_fixed) || std::ranges::any_of(collapsing_, is_fixed);
  }

  static VertexKind kind_of(const std::vector<Spoke>& spokes) {
    uint32_t feature_count = 0;
    std::array<uint32_t, 2> faces{};
    for (const Spoke& spoke : spokes) {
      if (spoke.faces == 2) continue;
      if (feature_count < 2) faces[feature_count] = spoke.faces;
      ++feature_count;
    }
    if (feature_count == 0) return VertexKind::Interior;
    return feature_count == 2 && faces[0] == faces[1] ? VertexKind::Curve : VertexKind::Corner;
  }

  /// The link condition [Dey et al. 1999] for surfaces with borders and non-manifold curves, which collapse only along
  /// themselves.
  bool keeps_topology(uint32_t a, uint32_t b) {
    kind_a_ = kind_of(spokes_a_);
    kind_b_ = kind_of(spokes_b_);
    const bool is_feature_edge = collapsing_.size() != 2;
    if (kind_a_ != VertexKind::Interior && kind_b_ != VertexKind::Interior) {
      if (!is_feature_edge || (kind_a_ == VertexKind::Corner && kind_b_ == VertexKind::Corner)) return false;
    }

    // Every common neighbour is the tip of a collapsing face. Its two edges become one: if both were features, that
    // would be a different one (or, at the last face of a strip, none).
    common_.clear();
    for (size_t i = 0, j = 0; i < spokes_a_.size() && j < spokes_b_.size();) {
      if (spokes_a_[i].vertex == spokes_b_[j].vertex) {
        if (spokes_a_[i].faces != 2 && spokes_b_[j].faces != 2) return false;
        common_.push_back(spokes_a_[i].vertex);
        ++i, ++j;
      } else if (spokes_a_[i].vertex < spokes_b_[j].vertex) {
        ++i;
      } else {
        ++j;
      }
    }
    if (common_.size() != collapsing_.size()) return false;

    // Two faces on the same three vertices must not come into being: the last step of a closed surface.
    const auto joins_common = [&](uint32_t face, uint32_t vertex) {
      for (int c = 0; c < 3; ++c) {
        const uint32_t corner = mesh_.triangles[face][c];
        if (corner != vertex && !std::binary_search(common_.begin(), common_.end(), corner)) return false;
      }
      return true;
    };
    const auto faces_of_b = kept_.begin() + static_cast<std::ptrdiff_t>(kept_of_a_);
    return std::none_of(kept_.begin(), faces_of_b, [&](uint32_t face) { return joins_common(face, a); }) ||
           std::none_of(faces_of_b, kept_.end(), [&](uint32_t face) { return joins_common(face, b); });
  }

  void fill_ring(uint32_t a, uint32_t b) {
    const auto position = [&](uint32_t v) { return mesh_.positions[v]; };
    ring_.clear();
    for (const auto* faces : {&kept_, &collapsing_}) {
      for (const uint32_t face : *faces) {
        uvec3 t = mesh_.triangles[face];
        if (mesh_.is_flipped[face]) std::swap(t.y, t.z);
        ring_.before.push_back({position(t.x), position(t.y), position(t.z)});
      }
    }
    for (const uint32_t face : kept_) {
      const uvec3& t = mesh_.triangles[face];
      const int c = t.x == a || t.x == b ? 0 : (t.y == a || t.y == b ? 1 : 2);
      uint32_t q = t[(c + 1) % 3], s = t[(c + 2) % 3];
      if (mesh_.is_flipped[face]) std::swap(q, s);
      ring_.after.push_back({position(q), position(s)});
    }
    ring_.samples_before = {position(a), position(b), 0.5 * (position(a) + position(b))};
    // Topology is kept, so every vertex next to a or b has a face that stays, and is next to the merged vertex.
    double longest2 = 0;
    neighbours_.clear();
    const auto add_spokes = [&](uint32_t vertex, const std::vector<Spoke>& spokes, uint32_t excluded) {
      for (const Spoke& spoke : spokes) {
        if (spoke.vertex == excluded) continue;
        longest2 = std::max(longest2, squared_length(position(spoke.vertex) - position(vertex)));
        ring_.samples_before.push_back(0.5 * (position(vertex) + position(spoke.vertex)));
        const bool is_seen = vertex == b && std::binary_search(common_.begin(), common_.end(), spoke.vertex);
        if (!is_seen) neighbours_.push_back(spoke.vertex);
      }
    };
    add_spokes(a, spokes_a_, b);
    add_spokes(b, spokes_b_, a);
    longest_spoke_ = std::sqrt(longest2);
    for (const uint32_t neighbour : neighbours_) ring_.neighbours_after.push_back(position(neighbour));
  }

  /// Where the merged vertex goes, or nothing if it has no place.
  std::optional<dvec3> find_place(uint32_t a, uint32_t b) const {
    const dvec3 pa = mesh_.positions[a], pb = mesh_.positions[b];
    const double tolerance = kPlacementTolerance * resolution_;
    if (is_pinned(a) || is_pinned(b)) {
      return may_merge_into_pinned(a, b) ? std::optional(is_pinned(a) ? pa : pb) : std::nullopt;
    }
    const auto optimum = [&] { return closest_position(ring_, 0.5 * (pa + pb), tolerance); };
    if (kind_a_ == VertexKind::Interior && kind_b_ == VertexKind::Interior) {
      const dvec3 x = optimum();
      return chosen_between(x, with_same_volume(ring_, x));
    }
    if (kind_a_ == VertexKind::Curve && kind_b_ == VertexKind::Curve) {
      const dvec3 x = optimum();
      const dvec3 p = mesh_.positions[curve_neighbour(spokes_a_, b)],
                  q = mesh_.positions[curve_neighbour(spokes_b_, a)];
      const auto limit = with_same_border_area(p, pa, pb, q, x);
      return limit ? std::optional(chosen_between(x, *limit)) : std::nullopt;
    }
    const bool stays_at_a = kind_b_ == VertexKind::Interior || kind_a_ == VertexKind::Corner;
    return stays_at_a ? pa : pb;
  }

  bool is_pinned(uint32_t vertex) const { return !mesh_.is_pinned.empty() && mesh_.is_pinned[vertex] != 0; }

  /// Whether the one that is not pinned may go to where the other is: not if it leaves a border or a corner by that.
  bool may_merge_into_pinned(uint32_t a, uint32_t b) const {
    if (is_pinned(a) && is_pinned(b)) return false;
    const VertexKind stays = is_pinned(a) ? kind_a_ : kind_b_, goes = is_pinned(a) ? kind_b_ : kind_a_;
    return goes == VertexKind::Interior || (goes == VertexKind::Curve && stays != VertexKind::Interior);
  }

  dvec3 chosen_between(const dvec3& closest, const dvec3& same_volume) const {
    switch (placement_) {
      case VertexPlacement::EqualArea:
        return restore_area(ring_, closest, same_volume);
      case VertexPlacement::EqualVolume:
        return same_volume;
      case VertexPlacement::ClosestPoints:
        return closest;
    }
    return closest;
  }

  /// The other end of the feature edge at a curve vertex that does not lead to `excluded`.
  static uint32_t curve_neighbour(const std::vector<Spoke>& spokes, uint32_t excluded) {
    for (const Spoke& spoke : spokes) {
      if (spoke.faces != 2 && spoke.vertex != excluded) return spoke.vertex;
    }
    return kNoIndex;
  }

  /// Where the source is coarser than the limit, edges may grow a little: a tube's ring could not merge otherwise.
  bool keeps_edges_short(uint32_t a, uint32_t b, const dvec3& x) const {
    const double edge = glm::length(mesh_.positions[b] - mesh_.positions[a]);
    const double limit = kLongEdge * resolution_;
    const double longest = longest_spoke_ > limit ? longest_spoke_ + 0.5 * edge : limit;
    return std::ranges::none_of(ring_.neighbours_after, [&](const dvec3& neighbour) {
      return squared_length(neighbour - x) > longest * longest;
    });
  }

  bool keeps_faces(const dvec3& x) const {
    for (size_t i = 0; i < kept_.size(); ++i) {
      const auto& [q, s] = ring_.after[i];
      if (!keeps_face(ring_.before[i].corners, {x, q, s})) return false;  // corners in the same order, up to a rotation
    }
    return true;
  }

  void commit(uint32_t a, uint32_t b, const dvec3& x, double deviation) {
    filter_ring_materials(x);
    mesh_.deviation[a] = deviation;
    mesh_.positions[a] = x;
    mesh_.merge(a, b, kept_, collapsing_);
  }

  void filter_ring_materials(const dvec3& x) {
    area_before_.clear();
    area_after_.assign(ring_.before.size(), 0.0);
    ring_materials_.clear();
    for (const BoundedTriangle& t : ring_.before) area_before_.push_back(0.5 * glm::length(area_vector(t.corners)));
    for (size_t i = 0; i < kept_.size(); ++i) {
      area_after_[i] = 0.5 * glm::length(area_vector({x, ring_.after[i][0], ring_.after[i][1]}));
    }
    for (const auto* faces : {&kept_, &collapsing_}) {
      for (const uint32_t face : *faces) ring_materials_.push_back(mesh_.material(face));
    }
    filter_materials(area_before_, area_after_, ring_materials_);
    for (size_t i = 0; i < kept_.size(); ++i) mesh_.material(kept_[i]) = ring_materials_[i];
  }

  CollapsibleMesh& mesh_;
  const double resolution_;
  const VertexPlacement placement_;
  const Job& job_;
  LengthQueue<Candidate> queue_;

  // About the edge at hand; members so that their memory is reused.
  std::vector<uint32_t> kept_, collapsing_, common_;
  size_t kept_of_a_ = 0;  ///< the first of kept_ are a's
  std::vector<Spoke> spokes_a_, spokes_b_;
  std::vector<uint32_t> neighbours_;  ///< of the merged vertex
  VertexKind kind_a_{}, kind_b_{};
  CollapseRing ring_;         ///< its `before` and `after` follow kept_, then collapsing_
  double longest_spoke_ = 0;  ///< length of the longest edge at a or b, but for ab
  std::vector<double> area_before_, area_after_;
  std::vector<FaceMaterial> ring_materials_;
};

bool is_all_fixed(const EdgeCollapseOptions& options, const SurfaceParts& parts, size_t part) {
  if (options.is_fixed.empty()) return false;
  return std::ranges::all_of(parts.faces_of(part), [&](uint32_t face) { return options.is_fixed[face] != 0; });
}

/// Its materials stay where they are, and change there.
CollapsibleMesh extract_part(Surface& surface, const EdgeCollapseOptions& options, const SurfaceParts& parts,
                             size_t part) {
  CollapsibleMesh mesh;
  const auto vertices = parts.vertices_of(part);
  mesh.faces = parts.faces_of(part);
  mesh.materials = surface.materials;
  mesh.positions.reserve(vertices.size());
  mesh.triangles.reserve(mesh.faces.size());
  for (const uint32_t vertex : vertices) mesh.positions.emplace_back(surface.positions[vertex]);
  for (const uint32_t face : mesh.faces) {
    const uvec3& t = surface.triangles[face];
    mesh.triangles.emplace_back(parts.local_vertex[t.x], parts.local_vertex[t.y], parts.local_vertex[t.z]);
  }
  mesh.build_topology();
  if (!options.deviation.empty()) {
    for (size_t v = 0; v < vertices.size(); ++v) mesh.deviation[v] = options.deviation[vertices[v]];
  }
  if (!options.is_pinned.empty()) {
    for (const uint32_t vertex : vertices) mesh.is_pinned.push_back(options.is_pinned[vertex]);
  }
  if (!options.is_fixed.empty()) {
    for (const uint32_t face : mesh.faces) mesh.is_fixed.push_back(options.is_fixed[face]);
  }
  return mesh;
}

void store_part(const CollapsibleMesh& mesh, const SurfaceParts& parts, size_t part, WorkingSurface& working) {
  const auto vertices = parts.vertices_of(part);
  const auto faces = parts.faces_of(part);
  for (uint32_t v = 0; v < vertices.size(); ++v) {
    working.merged_into[vertices[v]] = vertices[mesh.merged_into[v]];
    working.surface.positions[vertices[v]] = vec3(mesh.positions[v]);
  }
  for (size_t f = 0; f < faces.size(); ++f) {
    const uvec3& t = mesh.triangles[f];
    working.is_face_alive[faces[f]] = mesh.is_face_alive[f];
    working.surface.triangles[faces[f]] = {vertices[t.x], vertices[t.y], vertices[t.z]};
  }
}

}  // namespace

SimplifyResult collapse_edges(const Surface& surface, const EdgeCollapseOptions& options, const Job& job) {
  const SurfaceParts parts = find_parts(surface);
  WorkingSurface working = begin_work(surface);
  if (options.resolution > 0) {
    parallel_for(parts.size(), 16, [&](size_t begin, size_t end) {
      for (size_t part = begin; part < end && !job.is_cancelled(); ++part) {
        if (is_all_fixed(options, parts, part)) continue;
        CollapsibleMesh mesh = extract_part(working.surface, options, parts, part);
        Simplifier(mesh, options, job).run();
        store_part(mesh, parts, part, working);
      }
    });
  }
  return finish_work(working, parts);
}

}  // namespace farfield
