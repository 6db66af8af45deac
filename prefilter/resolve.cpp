// SPDX-License-Identifier: Apache-2.0
#include "prefilter/resolve.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "base/hash.h"
#include "base/index.h"
#include "base/parallel.h"
#include "base/result.h"
#include "prefilter/alpha_cut.h"
#include "prefilter/edge_table.h"
#include "prefilter/face_materials.h"

namespace farfield {
namespace {

struct TriangleKeyHash {
  size_t operator()(const uvec3& t) const { return mix64(mix64(t.x, t.y), t.z); }
};

/// Parts of the source's triangles over shared vertices. The source's own vertices come first.
struct PartMesh {
  std::vector<vec3> positions;
  std::vector<uvec3> triangles;
  std::vector<TrianglePart> parts;  ///< per triangle

  /// In double: single precision calls needles flat.
  dvec3 area_vector(const uvec3& t) const {
    const dvec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
    return glm::cross(b - a, c - a);
  }
  bool has_area(const uvec3& t) const {
    if (t.x == t.y || t.y == t.z || t.z == t.x) return false;
    const dvec3 area = area_vector(t);
    return glm::dot(area, area) > 0;
  }
};

// ---- masks

/// Cuts masked triangles along their masks' outlines; the others stay whole.
class MaskCutter {
 public:
  MaskCutter(const SourceSurface& source, float resolution, const Job& job)
      : source_(source), resolution_(resolution), job_(job) {}

  PartMesh run() {
    mesh_.positions = source_.positions;
    find_patterns();
    if (job_.is_cancelled()) return {};
    for (uint32_t i = 0; i < source_.triangles.size(); ++i) {
      if (pattern_of_[i] == kNoIndex) {
        mesh_.triangles.push_back(source_.triangles[i]);
        mesh_.parts.push_back({i});
      } else {
        add_pieces(i, patterns_[pattern_of_[i]].cut);
      }
    }
    return std::move(mesh_);
  }

 private:
  /// A cut, shared by all triangles that look the same in UV space, as leaf cards do.
  struct Pattern {
    uint32_t material;
    MaskedTriangle triangle;
    double texel_size = 0;  ///< the largest on a triangle that looks so; 0: not known
    CutPattern cut;
  };

  bool is_masked(uint32_t triangle) const {
    return !source_.material_function && source_.material_of(triangle).alpha_mode == AlphaMode::Mask;
  }

  MaskedTriangle masked_triangle(uint32_t i) const {
    MaskedTriangle masked{source_.uv_of(i), {1, 1, 1}};
    if (!source_.corner_color.empty()) {
      for (size_t k = 0; k < 3; ++k) masked.alpha[k] = source_.corner_color[3 * i + k].w;
    }
    // Without usable coordinates only the factor and the vertices can say anything.
    const SourceMaterial& material = source_.material_of(i);
    if (!material.base_color_map && !material.alpha_map) masked.uv = UvTriangle{};
    return masked;
  }

  /// Gives each masked triangle its pattern, and cuts all patterns.
  void find_patterns() {
    pattern_of_.assign(source_.triangles.size(), kNoIndex);
    std::unordered_map<uint64_t, std::vector<uint32_t>> by_hash;
    std::vector<std::vector<MaskedTriangle>> of_material(source_.materials.size());
    for (uint32_t i = 0; i < source_.triangles.size(); ++i) {
      if (!is_masked(i)) continue;
      const uint32_t material = source_.material[i];
      const MaskedTriangle masked = masked_triangle(i);
      auto& same_hash = by_hash[hash_values<MaskedTriangle>({&masked, 1}, material)];
      const auto found = std::find_if(same_hash.begin(), same_hash.end(), [&](uint32_t p) {
        return patterns_[p].material == material && patterns_[p].triangle == masked;
      });
      if (found != same_hash.end()) {
        pattern_of_[i] = *found;
        note_texel_size(i);
        continue;
      }
      pattern_of_[i] = static_cast<uint32_t>(patterns_.size());
      same_hash.push_back(pattern_of_[i]);
      patterns_.push_back({material, masked, 0, {}});
      note_texel_size(i);
      of_material[material].push_back(masked);
    }
    std::vector<int> subdivisions;
    for (size_t m = 0; m < of_material.size(); ++m) {
      subdivisions.push_back(cut_subdivisions(source_.materials[m], of_material[m]));
    }
    parallel_for(patterns_.size(), 1, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end && !job_.is_cancelled(); ++p) {
        Pattern& pattern = patterns_[p];
        pattern.cut = cut_by_mask(source_.materials[pattern.material], pattern.triangle, subdivisions[pattern.material],
                                  tolerance_texels(pattern));
      }
    });
  }

  void note_texel_size(uint32_t i) {
    const uvec3& t = source_.triangles[i];
    Pattern& pattern = patterns_[pattern_of_[i]];
    pattern.texel_size = std::max(pattern.texel_size,
                                  texel_size(source_.materials[pattern.material], pattern.triangle,
                                             {source_.positions[t.x], source_.positions[t.y], source_.positions[t.z]}));
  }

  /// No level shows where an outline is within a quarter of a voxel, nor is it known within a texel.
  double tolerance_texels(const Pattern& pattern) const {
    constexpr double kVoxels = 0.25, kLeastTexels = 1;
    if (!(pattern.texel_size > 0)) return kOutlineTexels;
    return std::max(kLeastTexels, kVoxels * resolution_ / pattern.texel_size);
  }

  void add_pieces(uint32_t triangle, const CutPattern& cut) {
    std::vector<uint32_t> vertices;
    for (const vec3& barycentric : cut.vertices) {
      vertices.push_back(vertex_at(source_.triangles[triangle], barycentric));
    }
    for (const uvec3& piece : cut.triangles) {
      const uvec3 t(vertices[piece.x], vertices[piece.y], vertices[piece.z]);
      if (!mesh_.has_area(t)) continue;  // too small for single precision here
      mesh_.triangles.push_back(t);
      mesh_.parts.push_back({triangle, {cut.vertices[piece.x], cut.vertices[piece.y], cut.vertices[piece.z]}});
    }
  }

  /// The vertex at a point of a triangle: its corners are those of the mesh, points on its edges are shared with the
  /// neighbours that were cut at the same place.
  uint32_t vertex_at(const uvec3& corners, const vec3& barycentric) {
    for (int k = 0; k < 3; ++k) {
      if (barycentric[k] == 1.0f) return corners[k];
    }
    for (int k = 0; k < 3; ++k) {
      if (barycentric[k] != 0.0f) continue;
      int a = (k + 1) % 3, b = (k + 2) % 3;
      if (corners[a] > corners[b]) std::swap(a, b);
      uint32_t bits;
      std::memcpy(&bits, &barycentric[b], sizeof bits);
      const auto [found, is_new] =
          on_edge_.try_emplace(uvec3(corners[a], corners[b], bits), static_cast<uint32_t>(mesh_.positions.size()));
      if (is_new) {
        mesh_.positions.push_back(glm::mix(mesh_.positions[corners[a]], mesh_.positions[corners[b]], barycentric[b]));
      }
      return found->second;
    }
    mesh_.positions.push_back(barycentric.x * mesh_.positions[corners.x] + barycentric.y * mesh_.positions[corners.y] +
                              barycentric.z * mesh_.positions[corners.z]);
    return static_cast<uint32_t>(mesh_.positions.size() - 1);
  }

  const SourceSurface& source_;
  const float resolution_;
  const Job& job_;
  PartMesh mesh_;
  std::vector<uint32_t> pattern_of_;  ///< per triangle; kNoIndex: not masked
  std::vector<Pattern> patterns_;
  std::unordered_map<uvec3, uint32_t, TriangleKeyHash> on_edge_;
};

// ---- detail

/// Splits what varies [longest-edge bisection: Rivara 1984].
class DetailSplitter {
 public:
  DetailSplitter(const SourceSurface& source, float resolution, const Job& job, PartMesh& mesh)
      : source_(source), resolution_(resolution), job_(job), mesh_(mesh) {}

  void run() {
    state_.assign(mesh_.triangles.size(), State::Unknown);
    while (!job_.is_cancelled() && split_once()) {
    }
  }

 private:
  enum class State : uint8_t { Unknown, Varied, Plain };

  /// Bisects all varied triangles that are too large, once. False: there are none.
  bool split_once() {
    edges_ = build_edge_table(mesh_.triangles, mesh_.positions.size());
    find_longest_edges();
    look_at_new_triangles();
    middle_.assign(edges_.size(), kNoIndex);
    std::vector<uint32_t> waiting;
    for (uint32_t f = 0; f < mesh_.triangles.size(); ++f) {
      if (is_large(f) && state_[f] == State::Varied) mark_longest_edge(f, waiting);
    }
    const bool any = !waiting.empty();
    // A triangle that is split at all is split across its longest edge first.
    while (!waiting.empty()) {
      const uint32_t face = waiting.back();
      waiting.pop_back();
      mark_longest_edge(face, waiting);
    }
    if (any) split_marked();
    return any;
  }

  float length2(uint32_t edge) const {
    const vec3 d = mesh_.positions[edges_.larger_vertex[edge]] - mesh_.positions[edges_.smaller_vertex[edge]];
    return glm::dot(d, d);
  }

  /// Of edges that are as long the one with the larger number, so that neighbours agree.
  void find_longest_edges() {
    longest_.resize(mesh_.triangles.size());
    for (size_t f = 0; f < longest_.size(); ++f) {
      const uvec3& e = edges_.face_edges[f];
      int longest = 0;
      for (int c = 1; c < 3; ++c) {
        if (std::pair(length2(e[c]), e[c]) > std::pair(length2(e[longest]), e[longest])) longest = c;
      }
      longest_[f] = static_cast<uint8_t>(longest);
    }
  }

  uint32_t longest_edge(uint32_t face) const { return edges_.face_edges[face][longest_[face]]; }
  bool is_large(uint32_t face) const { return length2(longest_edge(face)) > resolution_ * resolution_; }

  void look_at_new_triangles() {
    parallel_for(mesh_.triangles.size(), 256, [&](size_t begin, size_t end) {
      for (size_t f = begin; f < end && !job_.is_cancelled(); ++f) {
        if (state_[f] != State::Unknown || !is_large(static_cast<uint32_t>(f))) continue;
        state_[f] = is_varied(source_, mesh_.parts[f], resolution_) ? State::Varied : State::Plain;
      }
    });
  }

  /// Gives the edge a vertex in its middle; the faces at it then wait for their turn.
  void mark_longest_edge(uint32_t face, std::vector<uint32_t>& waiting) {
    const uint32_t edge = longest_edge(face);
    if (middle_[edge] != kNoIndex) return;
    middle_[edge] = static_cast<uint32_t>(mesh_.positions.size());
    mesh_.positions.push_back(
        0.5f * (mesh_.positions[edges_.smaller_vertex[edge]] + mesh_.positions[edges_.larger_vertex[edge]]));
    for (const uint32_t other : edges_.faces_of(edge)) waiting.push_back(other);
  }

  /// A triangle on its way to be split: `middle[c]` splits the edge from corner c to the next, kNoIndex: does not.
  struct Cut {
    uvec3 vertex;
    TrianglePart part;
    uvec3 middle;
  };

  void split_marked() {
    PartMesh old;
    old.triangles = std::exchange(mesh_.triangles, {});
    old.parts = std::exchange(mesh_.parts, {});
    const std::vector<State> old_state = std::exchange(state_, {});
    for (size_t f = 0; f < old.triangles.size(); ++f) {
      const uvec3& e = edges_.face_edges[f];
      const Cut whole{old.triangles[f], old.parts[f], {middle_[e.x], middle_[e.y], middle_[e.z]}};
      const bool stays = whole.middle == uvec3(kNoIndex);
      add(whole, longest_[f], stays || old_state[f] == State::Plain ? old_state[f] : State::Unknown);
    }
  }

  /// Adds what becomes of a triangle whose edge at corner `first` is split before the others.
  void add(const Cut& cut, int first, State state) {
    const int a = first, b = (first + 1) % 3, c = (first + 2) % 3;
    if (cut.middle[a] == kNoIndex) {
      mesh_.triangles.push_back(cut.vertex);
      mesh_.parts.push_back(cut.part);
      state_.push_back(state);
      return;
    }
    const auto& at = cut.part.corners;
    const auto corner = [&](int k) { return at[static_cast<size_t>(k)]; };
    const vec3 half = 0.5f * (corner(a) + corner(b));
    const uint32_t m = cut.middle[a];
    // Each half keeps one of the two other edges; it is split, if at all, from the new vertex.
    add({{cut.vertex[c], cut.vertex[a], m}, {cut.part.triangle, {corner(c), corner(a), half}}, only(cut.middle[c])}, 0,
        state);
    add({{cut.vertex[b], cut.vertex[c], m}, {cut.part.triangle, {corner(b), corner(c), half}}, only(cut.middle[b])}, 0,
        state);
  }
  static uvec3 only(uint32_t middle) { return {middle, kNoIndex, kNoIndex}; }

  const SourceSurface& source_;
  float resolution_;
  const Job& job_;
  PartMesh& mesh_;
  std::vector<State> state_;      ///< per triangle
  std::vector<uint8_t> longest_;  ///< per triangle: the corner at which its longest edge starts
  EdgeTable edges_;
  std::vector<uint32_t> middle_;  ///< per edge: the vertex that splits it, or kNoIndex
};

// ---- what is left

/// Materials of all parts; those that nothing stops at, or that have no area, go.
ResolvedSurface finish(const SourceSurface& source, const PartMesh& mesh, const Job& job) {
  std::vector<FaceMaterial> materials(mesh.triangles.size());
  parallel_for(materials.size(), 256, [&](size_t begin, size_t end) {
    if (job.is_cancelled()) return;
    const auto averages = average_materials(source, std::span(mesh.parts).subspan(begin, end - begin), job);
    for (size_t f = begin; f < end; ++f) {
      materials[f] = averages[f - begin];
      const bool is_cut =
          !source.material_function && source.material_of(mesh.parts[f].triangle).alpha_mode == AlphaMode::Mask;
      if (is_cut) materials[f].opacity = 1;  // the outline says where it is
    }
  });

  ResolvedSurface out;
  out.surface.origin = source.origin;
  out.face_of.assign(source.triangles.size(), kNoIndex);
  std::vector<double> largest(source.triangles.size(), 0);
  std::vector<uint32_t> number(mesh.positions.size(), kNoIndex);
  for (size_t f = 0; f < materials.size(); ++f) {
    uvec3 t = mesh.triangles[f];
    if (!(materials[f].opacity > 0) || !mesh.has_area(t)) continue;
    const uint32_t triangle = mesh.parts[f].triangle;
    if (const double area = glm::length(mesh.area_vector(t)); area > largest[triangle]) {
      largest[triangle] = area;
      out.face_of[triangle] = static_cast<uint32_t>(out.surface.triangles.size());
    }
    for (int k = 0; k < 3; ++k) {
      uint32_t& vertex = number[t[k]];
      if (vertex == kNoIndex) {
        vertex = static_cast<uint32_t>(out.surface.positions.size());
        out.surface.positions.push_back(mesh.positions[t[k]]);
      }
      t[k] = vertex;
    }
    out.surface.triangles.push_back(t);
    out.surface.materials.push_back(materials[f]);
    // What was split or cut is no half any more.
    if (!source.quad.empty()) out.surface.quad.push_back(mesh.parts[f].is_whole() ? source.quad[triangle] : kNoIndex);
  }
  number.resize(source.positions.size());
  out.vertex_of = std::move(number);
  return out;
}

}  // namespace

Result<ResolvedSurface> resolve(const SourceSurface& source, float resolution, const Job& job) {
  PartMesh mesh = MaskCutter(source, resolution, job).run();
  DetailSplitter(source, resolution, job, mesh).run();
  ResolvedSurface resolved = finish(source, mesh, job);
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  if (resolved.surface.triangles.empty()) {
    return make_error(ErrorCode::BadFile, "no face has any area that is not transparent");
  }
  return resolved;
}

uint64_t estimate_resolved_faces(const SourceSurface& source, float resolution, const Job& job) {
  constexpr double kFacesPerSquare = 5;  // bisection ends at edges of 0.7 to 1 times the resolution
  std::atomic<uint64_t> faces{0};        // integers, so that the order does not matter
  parallel_for(source.triangles.size(), 256, [&](size_t begin, size_t end) {
    for (size_t f = begin; f < end && !job.is_cancelled(); ++f) {
      const double squares = 0.5 * glm::length(source.area_vector(f)) / (double(resolution) * resolution);
      const bool is_split = squares > 0.5 && is_varied(source, {static_cast<uint32_t>(f)}, resolution);
      faces += is_split ? std::max<uint64_t>(1, static_cast<uint64_t>(kFacesPerSquare * squares)) : 1;
    }
  });
  return faces;
}

}  // namespace farfield
