// SPDX-License-Identifier: Apache-2.0
// Edge collapse, shortest edge first [Loubet 2018, 8.1 to 8.3]. Connected parts of the surface never touch each other,
// so each is simplified on its own, with its own numbering, by one thread.
#include "prefilter/simplify.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <queue>
#include <span>

#include "base/index.h"
#include "base/parallel.h"
#include "cache/level.h"
#include "prefilter/disjoint_sets.h"
#include "prefilter/edge_table.h"
#include "prefilter/material_filter.h"
#include "prefilter/vertex_placement.h"

namespace farfield {

namespace {

constexpr double kShortEdge = 0.36;  ///< edges below this part of the resolution collapse (thesis 7.3: about eps / 2)
constexpr double kLongEdge = 1.0;    ///< and none becomes longer than this part (8.1.1)
constexpr double kMaxDeviation = 0.25;        ///< largest distance to the input, as a part of the resolution (8.1.1)
constexpr double kPlacementTolerance = 0.01;  ///< of the resolution (8.2.3)
constexpr double kMinNormalCosine = 0.2;      ///< between a face before and after a collapse
constexpr double kMinShape = 0.05;     ///< of 4 sqrt(3) area / (sum of squared edges), 1 for an equilateral triangle
constexpr size_t kMaxStarFaces = 256;  ///< keeps the work per collapse bounded

double squared(const dvec3& v) { return glm::dot(v, v); }

/// Twice the area, along the normal.
dvec3 area_vector(const dvec3& a, const dvec3& b, const dvec3& c) { return glm::cross(b - a, c - a); }

double shape(const dvec3& a, const dvec3& b, const dvec3& c) {
  const double edges2 = squared(b - a) + squared(c - b) + squared(a - c);
  return edges2 > 0 ? 2.0 * std::sqrt(3.0) * glm::length(area_vector(a, b, c)) / edges2 : 0.0;
}

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
  std::vector<FaceMaterial> materials;
  std::vector<uint32_t> merged_into;  ///< per vertex: itself while it lives, else a smaller one
  std::vector<uint8_t> is_face_alive;
  std::vector<uint8_t>
      is_flipped;                 ///< per face: wound against its neighbours; meaningless across a Moebius strip's seam
  std::vector<uint32_t> version;  ///< per vertex: how often it changed
  std::vector<double> deviation;  ///< per vertex: bound of the distance to the input around it

  /// Call once the arrays of positions, triangles and materials are filled.
  void build_topology() {
    build_stars();
    find_winding();
  }

  /// The living faces around a vertex. Valid until the next merge().
  std::span<const uint32_t> star(uint32_t vertex) const {
    return std::span(star_faces_).subspan(stars_[vertex].begin, stars_[vertex].size);
  }

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
        if (triangles[face][c] != a && triangles[face][c] != b) remove_from_star(triangles[face][c], face);
      }
    }
    for (const uint32_t face : kept) {
      for (int c = 0; c < 3; ++c) {
        if (triangles[face][c] == b) triangles[face][c] = a;
      }
    }
    merged_into[b] = a;
    stars_[b] = {};
    // The new star goes to the end; what it leaves behind is bounded by the number of collapses times a star's size.
    stars_[a] = {static_cast<uint32_t>(star_faces_.size()), static_cast<uint32_t>(kept.size())};
    star_faces_.insert(star_faces_.end(), kept.begin(), kept.end());
    ++version[a];
    ++version[b];
  }

 private:
  struct Star {
    uint32_t begin = 0, size = 0;
  };

  void build_stars() {
    merged_into.resize(positions.size());
    std::iota(merged_into.begin(), merged_into.end(), 0u);
    is_face_alive.assign(triangles.size(), 1);
    version.assign(positions.size(), 0);
    deviation.assign(positions.size(), 0.0);
    stars_.assign(positions.size(), Star{});
    for (const uvec3& t : triangles) {
      for (int c = 0; c < 3; ++c) ++stars_[t[c]].size;
    }
    uint32_t begin = 0;
    for (Star& star : stars_) {
      star.begin = begin;
      begin += star.size;
      star.size = 0;
    }
    star_faces_.resize(begin);
    for (uint32_t face = 0; face < triangles.size(); ++face) {
      for (int c = 0; c < 3; ++c) {
        Star& star = stars_[triangles[face][c]];
        star_faces_[star.begin + star.size++] = face;
      }
    }
  }

  /// Lets neighbouring faces agree on a winding, outwards from the first face of each sheet.
  void find_winding() {
    const EdgeTable edges = build_edge_table(triangles, positions.size());
    is_flipped.assign(triangles.size(), 0);
    std::vector<uint8_t> is_found(triangles.size(), 0);
    std::vector<uint32_t> front;
    const auto runs_upwards = [&](uint32_t face, uint32_t edge) {
      for (int c = 0; c < 3; ++c) {
        if (edges.face_edges[face][c] == edge) return triangles[face][c] == edges.smaller_vertex[edge];
      }
      return false;
    };
    for (uint32_t first = 0; first < triangles.size(); ++first) {
      if (is_found[first]) continue;
      is_found[first] = 1;
      front.assign(1, first);
      while (!front.empty()) {
        const uint32_t face = front.back();
        front.pop_back();
        for (int c = 0; c < 3; ++c) {
          const uint32_t edge = edges.face_edges[face][c];
          const auto faces = edges.faces_of(edge);
          if (faces.size() != 2) continue;
          const uint32_t neighbour = faces[0] == face ? faces[1] : faces[0];
          if (is_found[neighbour]) continue;
          is_found[neighbour] = 1;
          is_flipped[neighbour] = is_flipped[face] ^ (runs_upwards(face, edge) == runs_upwards(neighbour, edge));
          front.push_back(neighbour);
        }
      }
    }
  }

  void remove_from_star(uint32_t vertex, uint32_t face) {
    Star& star = stars_[vertex];
    uint32_t* const begin = star_faces_.data() + star.begin;
    star.size = static_cast<uint32_t>(std::remove(begin, begin + star.size, face) - begin);
  }

  std::vector<Star> stars_;
  std::vector<uint32_t> star_faces_;
};

/// Collapses the edges of one mesh.
class Simplifier {
 public:
  Simplifier(CollapsibleMesh& mesh, double resolution, const Job& job)
      : mesh_(mesh), resolution_(resolution), job_(job) {}

  void run() {
    for (uint32_t v = 0; v < mesh_.positions.size(); ++v) {
      mesh_.find_spokes(v, spokes_a_);
      for (const Spoke& spoke : spokes_a_) {
        if (v < spoke.vertex) push(v, spoke.vertex);
      }
    }
    while (!queue_.empty() && !job_.is_cancelled()) {
      const Candidate candidate = queue_.top();
      queue_.pop();
      if (is_current(candidate) && try_collapse(candidate.a, candidate.b)) push_edges_at(candidate.a);
    }
  }

 private:
  struct Candidate {
    double length2;
    uint32_t a, b;  ///< a < b
    uint32_t version_a, version_b;

    /// For a queue whose top is the shortest edge; equally long ones in the order of their vertices.
    friend bool operator<(const Candidate& l, const Candidate& r) {
      if (l.length2 != r.length2) return l.length2 > r.length2;
      return l.a != r.a ? l.a > r.a : l.b > r.b;
    }
  };

  void push(uint32_t v, uint32_t w) {
    const double length2 = squared(mesh_.positions[w] - mesh_.positions[v]);
    const double limit = kShortEdge * resolution_;
    if (!(length2 < limit * limit)) return;
    const auto [a, b] = std::minmax(v, w);
    queue_.push({length2, a, b, mesh_.version[a], mesh_.version[b]});
  }

  void push_edges_at(uint32_t vertex) {
    mesh_.find_spokes(vertex, spokes_a_);
    for (const Spoke& spoke : spokes_a_) push(vertex, spoke.vertex);
  }

  bool is_current(const Candidate& candidate) const {
    return mesh_.version[candidate.a] == candidate.version_a && mesh_.version[candidate.b] == candidate.version_b;
  }

  bool try_collapse(uint32_t a, uint32_t b) {
    if (mesh_.star(a).size() + mesh_.star(b).size() > kMaxStarFaces) return false;
    gather_faces(a, b);
    mesh_.find_spokes(a, spokes_a_);
    mesh_.find_spokes(b, spokes_b_);
    if (kept_.empty() || !keeps_topology(a, b)) return false;
    fill_ring(a, b);
    const std::optional<Placement> placement = find_placement(a, b);
    if (!placement) return false;
    commit(a, b, *placement);
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
    longest_spoke_ = 0;
    for (const Spoke& spoke : spokes_a_) {
      if (spoke.vertex == b) continue;
      longest_spoke_ = std::max(longest_spoke_, glm::length(position(spoke.vertex) - position(a)));
      ring_.samples_before.push_back(0.5 * (position(a) + position(spoke.vertex)));
      ring_.neighbours_after.push_back(position(spoke.vertex));
    }
    for (const Spoke& spoke : spokes_b_) {
      if (spoke.vertex == a) continue;
      longest_spoke_ = std::max(longest_spoke_, glm::length(position(spoke.vertex) - position(b)));
      ring_.samples_before.push_back(0.5 * (position(b) + position(spoke.vertex)));
      const bool is_common = std::binary_search(common_.begin(), common_.end(), spoke.vertex);
      if (!is_common) ring_.neighbours_after.push_back(position(spoke.vertex));
    }
  }

  /// Where the merged vertex goes, or nothing if no place keeps faces, edges and deviation within bounds.
  std::optional<Placement> find_placement(uint32_t a, uint32_t b) const {
    const dvec3 pa = mesh_.positions[a], pb = mesh_.positions[b];
    const double tolerance = kPlacementTolerance * resolution_;
    const auto accept = [&](const Placement& placement) -> std::optional<Placement> {
      return is_valid(a, b, placement) ? std::optional(placement) : std::nullopt;
    };
    const auto optimum = [&] { return place_vertex(ring_, 0.5 * (pa + pb), tolerance).position; };
    if (kind_a_ == VertexKind::Interior && kind_b_ == VertexKind::Interior) {
      const dvec3 x = optimum();
      return accept(keep_vertex(ring_, restore_area(ring_, x, with_same_volume(ring_, x))));
    }
    if (kind_a_ == VertexKind::Curve && kind_b_ == VertexKind::Curve) {
      const dvec3 x = optimum();
      const dvec3 p = mesh_.positions[curve_neighbour(spokes_a_, b)],
                  q = mesh_.positions[curve_neighbour(spokes_b_, a)];
      const auto limit = with_same_border_area(p, pa, pb, q, x);
      return limit ? accept(keep_vertex(ring_, restore_area(ring_, x, *limit))) : std::nullopt;
    }
    const bool stays_at_a = kind_b_ == VertexKind::Interior || kind_a_ == VertexKind::Corner;
    return accept(keep_vertex(ring_, stays_at_a ? pa : pb));
  }

  /// The other end of the feature edge at a curve vertex that does not lead to `excluded`.
  static uint32_t curve_neighbour(const std::vector<Spoke>& spokes, uint32_t excluded) {
    for (const Spoke& spoke : spokes) {
      if (spoke.faces != 2 && spoke.vertex != excluded) return spoke.vertex;
    }
    return kNoIndex;
  }

  bool is_valid(uint32_t a, uint32_t b, const Placement& placement) const {
    const double total_deviation = placement.deviation + std::max(mesh_.deviation[a], mesh_.deviation[b]);
    if (!(total_deviation <= kMaxDeviation * resolution_)) return false;

    // Where the source is coarser than that, edges may grow a little: a tube's ring could not merge otherwise.
    const double edge = glm::length(mesh_.positions[b] - mesh_.positions[a]);
    const double limit = kLongEdge * resolution_;
    const double longest = longest_spoke_ > limit ? longest_spoke_ + 0.5 * edge : limit;
    for (const dvec3& neighbour : ring_.neighbours_after) {
      if (squared(neighbour - placement.position) > longest * longest) return false;
    }
    for (size_t i = 0; i < kept_.size(); ++i) {
      if (!is_face_valid(i, placement.position)) return false;
    }
    return true;
  }

  bool is_face_valid(size_t i, const dvec3& x) const {
    const auto& [p0, p1, p2] = ring_.before[i];
    const auto& [q, s] = ring_.after[i];
    const double shape_before = shape(p0, p1, p2), shape_after = shape(x, q, s);
    if (!(shape_after > std::min(kMinShape, 0.5 * shape_before))) return false;
    if (!(shape_before > 0)) return true;
    // `after` starts at the corner that moves, in the order of the triangle: a rotation, so the normals compare.
    const dvec3 normal_before = area_vector(p0, p1, p2), normal_after = area_vector(x, q, s);
    return glm::dot(normal_before, normal_after) >
           kMinNormalCosine * glm::length(normal_before) * glm::length(normal_after);
  }

  void commit(uint32_t a, uint32_t b, const Placement& placement) {
    filter_ring_materials(placement.position);
    mesh_.deviation[a] = placement.deviation + std::max(mesh_.deviation[a], mesh_.deviation[b]);
    mesh_.positions[a] = placement.position;
    mesh_.merge(a, b, kept_, collapsing_);
  }

  void filter_ring_materials(const dvec3& x) {
    area_before_.clear();
    area_after_.assign(ring_.before.size(), 0.0);
    ring_materials_.clear();
    for (const auto& [p0, p1, p2] : ring_.before) area_before_.push_back(0.5 * glm::length(area_vector(p0, p1, p2)));
    for (size_t i = 0; i < kept_.size(); ++i) {
      area_after_[i] = 0.5 * glm::length(area_vector(x, ring_.after[i][0], ring_.after[i][1]));
    }
    for (const auto* faces : {&kept_, &collapsing_}) {
      for (const uint32_t face : *faces) ring_materials_.push_back(mesh_.materials[face]);
    }
    filter_materials(area_before_, area_after_, ring_materials_);
    for (size_t i = 0; i < kept_.size(); ++i) mesh_.materials[kept_[i]] = ring_materials_[i];
  }

  CollapsibleMesh& mesh_;
  const double resolution_;
  const Job& job_;
  std::priority_queue<Candidate> queue_;

  // About the edge at hand; members so that their memory is reused.
  std::vector<uint32_t> kept_, collapsing_, common_;
  size_t kept_of_a_ = 0;  ///< the first of kept_ are a's
  std::vector<Spoke> spokes_a_, spokes_b_;
  VertexKind kind_a_{}, kind_b_{};
  CollapseRing ring_;         ///< its `before` and `after` follow kept_, then collapsing_
  double longest_spoke_ = 0;  ///< length of the longest edge at a or b, but for ab
  std::vector<double> area_before_, area_after_;
  std::vector<FaceMaterial> ring_materials_;
};

/// The connected parts of a surface, connected through shared vertices; faces and vertices of each are ascending.
struct Parts {
  std::vector<uint32_t> first_face, faces;       ///< part i has faces[first_face[i]] to faces[first_face[i + 1]]
  std::vector<uint32_t> first_vertex, vertices;  ///< likewise
  std::vector<uint32_t> local_vertex;            ///< per vertex of the surface: its number within its part, or kNoIndex

  size_t size() const { return first_face.size() - 1; }
  std::span<const uint32_t> faces_of(size_t part) const {
    return std::span(faces).subspan(first_face[part], first_face[part + 1] - first_face[part]);
  }
  std::span<const uint32_t> vertices_of(size_t part) const {
    return std::span(vertices).subspan(first_vertex[part], first_vertex[part + 1] - first_vertex[part]);
  }
};

/// Sorts 0 .. part_of.size() - 1 by part; kNoIndex is left out.
void group_by_part(const std::vector<uint32_t>& part_of, size_t part_count, std::vector<uint32_t>& first,
                   std::vector<uint32_t>& items) {
  first.assign(part_count + 1, 0);
  for (const uint32_t part : part_of) {
    if (part != kNoIndex) ++first[part + 1];
  }
  for (size_t part = 0; part < part_count; ++part) first[part + 1] += first[part];
  items.resize(first.back());
  std::vector<uint32_t> next(first.begin(), first.end() - 1);
  for (uint32_t i = 0; i < part_of.size(); ++i) {
    if (part_of[i] != kNoIndex) items[next[part_of[i]]++] = i;
  }
}

Parts find_parts(const Surface& surface) {
  DisjointSets vertices(surface.positions.size());
  for (const uvec3& t : surface.triangles) vertices.join(t.x, t.y), vertices.join(t.x, t.z);

  std::vector<uint32_t> part_of_vertex(surface.positions.size(), kNoIndex), part_of_face(surface.triangles.size());
  uint32_t part_count = 0;
  for (size_t face = 0; face < surface.triangles.size(); ++face) {
    uint32_t& part = part_of_vertex[vertices.least_of(surface.triangles[face].x)];
    if (part == kNoIndex) part = part_count++;
    part_of_face[face] = part;
  }
  for (const uvec3& t : surface.triangles) {
    for (int c = 0; c < 3; ++c) part_of_vertex[t[c]] = part_of_vertex[vertices.least_of(t[c])];
  }
  // A root that no face uses can not exist: it is a vertex of a face or alone.
  Parts parts;
  group_by_part(part_of_face, part_count, parts.first_face, parts.faces);
  group_by_part(part_of_vertex, part_count, parts.first_vertex, parts.vertices);
  parts.local_vertex.assign(surface.positions.size(), kNoIndex);
  for (size_t part = 0; part < part_count; ++part) {
    uint32_t next = 0;
    for (const uint32_t vertex : parts.vertices_of(part)) parts.local_vertex[vertex] = next++;
  }
  return parts;
}

CollapsibleMesh extract_part(const Surface& surface, const Parts& parts, size_t part) {
  CollapsibleMesh mesh;
  for (const uint32_t vertex : parts.vertices_of(part)) mesh.positions.emplace_back(surface.positions[vertex]);
  for (const uint32_t face : parts.faces_of(part)) {
    const uvec3& t = surface.triangles[face];
    mesh.triangles.emplace_back(parts.local_vertex[t.x], parts.local_vertex[t.y], parts.local_vertex[t.z]);
    mesh.materials.push_back(surface.materials[face]);
  }
  mesh.build_topology();
  return mesh;
}

/// The surface while its parts are being simplified, in the numbering of the input.
struct WorkingSurface {
  Surface surface;
  std::vector<uint32_t> merged_into;  ///< per vertex; itself if it lives or is unused
  std::vector<uint8_t> is_face_alive;
};

void store_part(const CollapsibleMesh& mesh, const Parts& parts, size_t part, WorkingSurface& working) {
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
    working.surface.materials[faces[f]] = mesh.materials[f];
  }
}

/// Leaves out what collapsed and what no face uses.
SimplifyResult compact(const WorkingSurface& working, const Parts& parts) {
  const Surface& from = working.surface;
  SimplifyResult result;
  result.surface.origin = from.origin;
  result.vertex_map.assign(from.positions.size(), kMorphVoxelized);
  for (uint32_t v = 0; v < from.positions.size(); ++v) {
    if (parts.local_vertex[v] == kNoIndex || working.merged_into[v] != v) continue;
    result.vertex_map[v] = static_cast<uint32_t>(result.surface.positions.size());
    result.surface.positions.push_back(from.positions[v]);
  }
  // Ascending: what a vertex merged into is smaller, so where that went is known.
  for (uint32_t v = 0; v < from.positions.size(); ++v) result.vertex_map[v] = result.vertex_map[working.merged_into[v]];

  result.face_map.assign(from.triangles.size(), kMorphCollapsed);
  for (size_t f = 0; f < from.triangles.size(); ++f) {
    if (!working.is_face_alive[f]) continue;
    const uvec3& t = from.triangles[f];
    result.face_map[f] = static_cast<uint32_t>(result.surface.triangles.size());
    result.surface.triangles.emplace_back(result.vertex_map[t.x], result.vertex_map[t.y], result.vertex_map[t.z]);
    result.surface.materials.push_back(from.materials[f]);
  }
  return result;
}

}  // namespace

SimplifyResult simplify(const Surface& macrosurface, const SimplifyOptions& options, const Job& job) {
  const Parts parts = find_parts(macrosurface);
  WorkingSurface working{macrosurface, std::vector<uint32_t>(macrosurface.positions.size()),
                         std::vector<uint8_t>(macrosurface.triangles.size(), 1)};
  std::iota(working.merged_into.begin(), working.merged_into.end(), 0u);
  if (options.resolution > 0) {
    parallel_for(parts.size(), 16, [&](size_t begin, size_t end) {
      for (size_t part = begin; part < end && !job.is_cancelled(); ++part) {
        CollapsibleMesh mesh = extract_part(macrosurface, parts, part);
        Simplifier(mesh, options.resolution, job).run();
        store_part(mesh, parts, part, working);
      }
    });
  }
  return compact(working, parts);
}

}  // namespace farfield
