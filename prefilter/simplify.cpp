// SPDX-License-Identifier: Apache-2.0
// Loops, edges, or of each connected part what suits it.
#include "prefilter/simplify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "base/index.h"
#include "cache/level.h"
#include "prefilter/collapse_edges.h"
#include "prefilter/collapse_loops.h"
#include "prefilter/quad_part.h"
#include "prefilter/surface_parts.h"

namespace farfield {
namespace {

// What well-structured quads are (docs/decisions/0034).
constexpr std::ptrdiff_t kFewestQuads = 32;  ///< of a connected part
constexpr double kLeastQuadShare = 0.9;      ///< of its faces
constexpr double kMostFaces = 1.35;          ///< that loops may leave of it, against edges

/// Per face: 1 where both halves of its quad are there.
std::vector<uint8_t> find_quads(const Surface& surface) {
  const std::vector<uint32_t> other = find_other_halves(surface.quad);
  std::vector<uint8_t> is_quad(surface.triangles.size(), 0);
  for (size_t f = 0; f < other.size(); ++f) is_quad[f] = other[f] != kNoIndex;
  return is_quad;
}

/// What happened first, then what happened after it.
SimplifyResult compose(SimplifyResult first, SimplifyResult then) {
  for (uint32_t& vertex : first.vertex_map) {
    if (vertex != kMorphVoxelized) vertex = then.vertex_map[vertex];
  }
  for (uint32_t& face : first.face_map) {
    if (face != kMorphCollapsed) face = then.face_map[face];
  }
  return {std::move(then.surface), std::move(first.vertex_map), std::move(first.face_map)};
}

/// Loops of what is quads, edges of what is not. is_unwanted: per face, those whose parts nobody asks for, which may
/// stay as they are; empty: none.
SimplifyResult collapse_loops_first(const Surface& surface, const std::vector<uint8_t>& is_unwanted, double resolution,
                                    const Job& job) {
  LoopCollapseResult loops = collapse_loops(surface, resolution, job);
  std::vector<uint8_t> is_fixed = find_quads(loops.simplified.surface);
  for (size_t f = 0; f < is_unwanted.size(); ++f) {
    const uint32_t left = loops.simplified.face_map[f];
    if (is_unwanted[f] && left != kMorphCollapsed) is_fixed[left] = 1;
  }
  SimplifyResult edges = collapse_edges(loops.simplified.surface, {resolution, is_fixed, loops.deviation}, job);
  return compose(std::move(loops.simplified), std::move(edges));
}

/// Per connected part: whether it is a mesh of quads.
std::vector<uint8_t> find_quad_parts(const Surface& surface, const SurfaceParts& parts) {
  const std::vector<uint8_t> is_quad = find_quads(surface);
  std::vector<uint8_t> result;
  for (size_t part = 0; part < parts.size(); ++part) {
    const auto faces = parts.faces_of(part);
    const auto halves = std::ranges::count_if(faces, [&](uint32_t face) { return is_quad[face] != 0; });
    result.push_back(halves >= 2 * kFewestQuads &&
                     static_cast<double>(halves) >= kLeastQuadShare * static_cast<double>(faces.size()));
  }
  return result;
}

/// Leaves those parts of which loops keep too many faces.
void leave_out_badly_structured(const SurfaceParts& parts, const SimplifyResult& loops, const SimplifyResult& edges,
                                std::vector<uint8_t>& chosen) {
  for (size_t part = 0; part < parts.size(); ++part) {
    double with_loops = 0, with_edges = 0;
    for (const uint32_t face : parts.faces_of(part)) {
      with_loops += loops.face_map[face] != kMorphCollapsed;
      with_edges += edges.face_map[face] != kMorphCollapsed;
    }
    if (with_loops > kMostFaces * with_edges) chosen[part] = 0;
  }
}

/// Each part as it is in one of two results of the same surface.
class PartChooser {
 public:
  PartChooser(const Surface& surface, const SimplifyResult& loops, const SimplifyResult& edges)
      : surface_(surface), from_{&edges, &loops} {
    result_.surface.origin = surface.origin;
    result_.vertex_map.assign(surface.positions.size(), kMorphVoxelized);
    result_.face_map.assign(surface.triangles.size(), kMorphCollapsed);
  }

  SimplifyResult choose(const SurfaceParts& parts, const std::vector<uint8_t>& chosen) {
    std::vector<uint8_t> of_vertex(surface_.positions.size(), 0), of_face(surface_.triangles.size(), 0);
    for (size_t part = 0; part < parts.size(); ++part) {
      for (const uint32_t v : parts.vertices_of(part)) of_vertex[v] = chosen[part];
      for (const uint32_t f : parts.faces_of(part)) of_face[f] = chosen[part];
    }
    for (uint32_t v = 0; v < of_vertex.size(); ++v) add_vertex(v, of_vertex[v]);
    for (uint32_t f = 0; f < of_face.size(); ++f) add_face(f, of_face[f]);
    return std::move(result_);
  }

 private:
  void add_vertex(uint32_t v, size_t which) {
    const uint32_t old = from_[which]->vertex_map[v];
    if (old == kMorphVoxelized) return;
    std::vector<uint32_t>& numbers = number_[which];
    numbers.resize(from_[which]->surface.positions.size(), kNoIndex);
    if (numbers[old] == kNoIndex) {
      numbers[old] = static_cast<uint32_t>(result_.surface.positions.size());
      result_.surface.positions.push_back(from_[which]->surface.positions[old]);
    }
    result_.vertex_map[v] = numbers[old];
  }

  void add_face(uint32_t f, size_t which) {
    const uint32_t old = from_[which]->face_map[f];
    if (old == kMorphCollapsed) return;
    const Surface& from = from_[which]->surface;
    const uvec3& t = from.triangles[old];
    result_.face_map[f] = static_cast<uint32_t>(result_.surface.triangles.size());
    result_.surface.triangles.emplace_back(number_[which][t.x], number_[which][t.y], number_[which][t.z]);
    result_.surface.materials.push_back(from.materials[old]);
    if (from.has_quads()) result_.surface.quad.push_back(from.quad[old]);
  }

  const Surface& surface_;
  std::array<const SimplifyResult*, 2> from_;
  std::array<std::vector<uint32_t>, 2> number_;  ///< of vertices of either, in the result
  SimplifyResult result_;
};

SimplifyResult choose_and_simplify(const Surface& surface, double resolution, const Job& job) {
  SimplifyResult edges = collapse_edges(surface, {resolution, {}, {}}, job);
  const SurfaceParts parts = find_parts(surface);
  std::vector<uint8_t> chosen = find_quad_parts(surface, parts);
  if (std::ranges::count(chosen, 1) == 0) return edges;
  std::vector<uint8_t> is_unwanted(surface.triangles.size());
  for (size_t part = 0; part < parts.size(); ++part) {
    for (const uint32_t f : parts.faces_of(part)) is_unwanted[f] = !chosen[part];
  }
  const SimplifyResult loops = collapse_loops_first(surface, is_unwanted, resolution, job);
  leave_out_badly_structured(parts, loops, edges, chosen);
  if (std::ranges::count(chosen, 1) == 0) return edges;
  return PartChooser(surface, loops, edges).choose(parts, chosen);
}

}  // namespace

const char* name_of(SimplifyMethod method) {
  switch (method) {
    case SimplifyMethod::Auto:
      return "auto";
    case SimplifyMethod::Loops:
      return "loops";
    case SimplifyMethod::Edges:
      return "edges";
  }
  return "unknown";
}

Result<SimplifyMethod> parse_simplify_method(const std::string& name) {
  for (const auto method : {SimplifyMethod::Auto, SimplifyMethod::Loops, SimplifyMethod::Edges})
    if (name == name_of(method)) return method;
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is none of auto, loops, edges", name));
}

SimplifyResult simplify(const Surface& macrosurface, const SimplifyOptions& options, const Job& job) {
  if (options.method == SimplifyMethod::Edges || !macrosurface.has_quads() || !options.is_pinned.empty()) {
    SimplifyResult result = collapse_edges(macrosurface, {options.resolution, {}, {}, options.is_pinned}, job);
    result.surface.quad.clear();  // nobody asks for them any more
    return result;
  }
  if (options.method == SimplifyMethod::Loops) return collapse_loops_first(macrosurface, {}, options.resolution, job);
  return choose_and_simplify(macrosurface, options.resolution, job);
}

}  // namespace farfield
