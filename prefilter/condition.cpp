// SPDX-License-Identifier: Apache-2.0
// From polygons to a Surface: move near the origin, weld, triangulate, look at textures, cut masks.
#include "prefilter/condition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include "base/hash.h"
#include "base/index.h"
#include "base/parallel.h"
#include "base/result.h"
#include "prefilter/alpha_cut.h"
#include "prefilter/triangulate.h"
#include "prefilter/weld.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
constexpr size_t kMaxWarnings = 50;

// Longest sides that the bake's single precision can work in: areas and their squares stay normal numbers down to faces
// of 1e-5 of the side.
constexpr double kSmallestSide = 1e-6, kLargestSide = 1e9;
// From this distance (in sides) on, positions are stored relative to an origin of their own: single precision would
// lose more than 4e-6 of the side.
constexpr double kFarInSides = 64;

// ---- positions

/// Keeps the faces for which keep(face) holds; the other arrays of the mesh stay in step.
template <typename Keep>
size_t remove_faces(SourceMesh& mesh, const Keep& keep) {
  size_t corners = 0, faces = 0, dropped = 0;
  uint32_t begin = 0;
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t end = mesh.face_begin[face + 1];
    if (keep(begin, end)) {
      for (uint32_t i = begin; i < end; ++i, ++corners) {
        mesh.corner_position[corners] = mesh.corner_position[i];
        if (!mesh.corner_uv.empty()) mesh.corner_uv[corners] = mesh.corner_uv[i];
        if (!mesh.corner_color.empty()) mesh.corner_color[corners] = mesh.corner_color[i];
      }
      mesh.face_material[faces] = mesh.face_material[face];
      mesh.face_begin[++faces] = static_cast<uint32_t>(corners);
    } else {
      ++dropped;
    }
    begin = end;
  }
  mesh.corner_position.resize(corners);
  if (!mesh.corner_uv.empty()) mesh.corner_uv.resize(corners);
  if (!mesh.corner_color.empty()) mesh.corner_color.resize(corners);
  mesh.face_material.resize(faces);
  mesh.face_begin.resize(faces + 1);
  return dropped;
}

void drop_faces_that_are_not_finite(SourceMesh& mesh) {
  const size_t dropped = remove_faces(mesh, [&](uint32_t begin, uint32_t end) {
    return std::all_of(mesh.corner_position.begin() + begin, mesh.corner_position.begin() + end, [&](uint32_t v) {
      const dvec3& p = mesh.positions[v];
      return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    });
  });
  if (dropped > 0)
    mesh.warnings.push_back(fmt::format("{} faces have coordinates that are not finite; dropped", dropped));
}

/// Where the surface's own origin goes. Errors: nothing there, or a size that single precision cannot work in.
Result<dvec3> choose_origin(const SourceMesh& mesh, const std::string& name) {
  dvec3 lower(INFINITY), upper(-INFINITY);
  for (const uint32_t v : mesh.corner_position) {
    lower = glm::min(lower, mesh.positions[v]);
    upper = glm::max(upper, mesh.positions[v]);
  }
  if (mesh.corner_position.empty()) return make_error(ErrorCode::BadFile, fmt::format("{}: has no usable faces", name));
  const dvec3 size = upper - lower;
  const double side = std::max(size.x, std::max(size.y, size.z));
  if (side == 0) return make_error(ErrorCode::BadFile, fmt::format("{}: all faces lie in one point", name));
  if (!(side >= kSmallestSide && side <= kLargestSide)) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: its longest side is {:.3g}; scale it to between {:.0e} and {:.0e}", name, side,
                                  kSmallestSide, kLargestSide));
  }
  const dvec3 farthest = glm::max(glm::abs(lower), glm::abs(upper));
  if (std::max(farthest.x, std::max(farthest.y, farthest.z)) <= kFarInSides * side) return dvec3(0.0);
  return 0.5 * (lower + upper);
}

// ---- triangles

/// The corners (indices into SourceMesh's corner arrays) of one triangle of a face.
struct CornerTriangle {
  uvec3 corner;
  uvec3 vertex;  ///< welded
  uint32_t material;
};

/// Points of a welded face without repeated neighbours: the corners that stay, in order.
void distinct_corners(const SourceMesh& mesh, const WeldResult& welded, uint32_t begin, uint32_t end,
                      std::vector<uint32_t>& corners) {
  const auto vertex = [&](uint32_t corner) { return welded.vertex_of[mesh.corner_position[corner]]; };
  corners.clear();
  for (uint32_t i = begin; i < end; ++i) {
    if (corners.empty() || vertex(i) != vertex(corners.back())) corners.push_back(i);
  }
  while (corners.size() > 1 && vertex(corners.front()) == vertex(corners.back())) corners.pop_back();
}

/// Twice the area vector, in double: single precision calls needles flat.
dvec3 area_vector(const std::vector<vec3>& positions, const uvec3& t) {
  const dvec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
  return glm::cross(b - a, c - a);
}

struct TriangleKeyHash {
  size_t operator()(const uvec3& t) const { return mix64(mix64(t.x, t.y), t.z); }
};

std::vector<CornerTriangle> triangulate(SourceMesh& mesh, const WeldResult& welded) {
  std::vector<CornerTriangle> out;
  out.reserve(mesh.corner_count() - std::min(mesh.corner_count(), 2 * mesh.face_count()));
  std::unordered_set<uvec3, TriangleKeyHash> seen;
  seen.reserve(out.capacity());
  size_t degenerate = 0, repeated = 0;
  std::vector<uint32_t> corners;
  std::vector<dvec3> points;
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    distinct_corners(mesh, welded, mesh.face_begin[face], mesh.face_begin[face + 1], corners);
    points.clear();
    for (const uint32_t c : corners) points.emplace_back(welded.positions[welded.vertex_of[mesh.corner_position[c]]]);
    bool has_area = false;
    for (const uvec3& t : triangulate_polygon(points)) {
      CornerTriangle triangle{{corners[t.x], corners[t.y], corners[t.z]}, {}, mesh.face_material[face]};
      for (int k = 0; k < 3; ++k) triangle.vertex[k] = welded.vertex_of[mesh.corner_position[triangle.corner[k]]];
      const dvec3 area = area_vector(welded.positions, triangle.vertex);
      if (!(glm::dot(area, area) > 0)) continue;
      has_area = true;
      uvec3 key = triangle.vertex;
      if (key.x > key.y) std::swap(key.x, key.y);
      if (key.y > key.z) std::swap(key.y, key.z);
      if (key.x > key.y) std::swap(key.x, key.y);
      if (!seen.insert(key).second) {
        ++repeated;
        continue;
      }
      out.push_back(triangle);
    }
    if (!has_area) ++degenerate;
  }
  if (degenerate > 0) mesh.warnings.push_back(fmt::format("{} faces have no area; dropped", degenerate));
  if (repeated > 0) {
    mesh.warnings.push_back(fmt::format("{} triangles repeat an earlier one with the same corners; dropped", repeated));
  }
  return out;
}

// ---- materials and masks

/// Turns triangles with corner attributes into a surface with a material per face.
class SurfaceBuilder {
 public:
  SurfaceBuilder(const SourceMesh& mesh, std::vector<vec3> positions, const Job& job) : mesh_(mesh), job_(job) {
    surface_.positions = std::move(positions);
  }

  Surface build(const std::vector<CornerTriangle>& triangles) {
    find_patterns(triangles);
    std::vector<FaceMaterial> materials(triangles.size());
    parallel_for(triangles.size(), 1024, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        if (pattern_of_[i] == kNoIndex) materials[i] = plain_material(triangles[i]);
      }
    });
    for (size_t i = 0; i < triangles.size(); ++i) {
      if (pattern_of_[i] == kNoIndex) {
        surface_.triangles.push_back(triangles[i].vertex);
        surface_.materials.push_back(materials[i]);
      } else {
        add_pieces(triangles[i], patterns_[pattern_of_[i]]);
      }
    }
    drop_unused_vertices();
    return std::move(surface_);
  }

 private:
  /// A cut and the textures of its pieces; shared by all triangles that look the same in UV space, as leaf cards do.
  struct Pattern {
    uint32_t material;
    MaskedTriangle triangle;
    CutPattern cut;
    std::vector<TextureAverage> averages;  ///< per piece
  };

  UvTriangle uv_of(const CornerTriangle& t) const {
    UvTriangle uv;
    for (int k = 0; k < 3; ++k) {
      uv[static_cast<size_t>(k)] = mesh_.corner_uv.empty() ? vec2(NAN) : mesh_.corner_uv[t.corner[k]];
    }
    return uv;
  }

  vec3 color_of(const CornerTriangle& t) const {
    if (mesh_.corner_color.empty()) return vec3(1.0f);
    return vec3(mesh_.corner_color[t.corner.x] + mesh_.corner_color[t.corner.y] + mesh_.corner_color[t.corner.z]) /
           3.0f;
  }

  vec3 normal_of(const uvec3& t) const { return vec3(glm::normalize(area_vector(surface_.positions, t))); }

  FaceMaterial plain_material(const CornerTriangle& t) const {
    const SourceMaterial& material = mesh_.materials[t.material];
    return face_material(material, average_textures(material, uv_of(t)), color_of(t), normal_of(t.vertex));
  }

  /// Gives each masked triangle its pattern, and cuts all patterns.
  void find_patterns(const std::vector<CornerTriangle>& triangles) {
    pattern_of_.assign(triangles.size(), kNoIndex);
    std::unordered_map<uint64_t, std::vector<uint32_t>> by_hash;
    std::vector<std::vector<MaskedTriangle>> of_material(mesh_.materials.size());
    for (size_t i = 0; i < triangles.size(); ++i) {
      const CornerTriangle& t = triangles[i];
      if (mesh_.materials[t.material].alpha_mode == AlphaMode::Opaque) continue;
      MaskedTriangle masked{uv_of(t), {1, 1, 1}};
      if (!mesh_.corner_color.empty()) {
        for (int k = 0; k < 3; ++k) masked.alpha[static_cast<size_t>(k)] = mesh_.corner_color[t.corner[k]].w;
      }
      // Without usable coordinates only the factor and the vertices can say anything.
      if (!has_maps_with_alpha(t.material)) masked.uv = UvTriangle{};
      auto& same_hash = by_hash[hash_values<MaskedTriangle>({&masked, 1}, t.material)];
      const auto found = std::find_if(same_hash.begin(), same_hash.end(), [&](uint32_t p) {
        return patterns_[p].material == t.material && patterns_[p].triangle == masked;
      });
      if (found != same_hash.end()) {
        pattern_of_[i] = *found;
        continue;
      }
      pattern_of_[i] = static_cast<uint32_t>(patterns_.size());
      same_hash.push_back(pattern_of_[i]);
      patterns_.push_back({t.material, masked, {}, {}});
      of_material[t.material].push_back(masked);
    }
    std::vector<int> subdivisions;
    for (size_t m = 0; m < of_material.size(); ++m) {
      subdivisions.push_back(cut_subdivisions(mesh_.materials[m], of_material[m]));
    }
    parallel_for(patterns_.size(), 1, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end && !job_.is_cancelled(); ++p)
        fill_pattern(patterns_[p], subdivisions[patterns_[p].material]);
    });
  }

  bool has_maps_with_alpha(uint32_t material) const {
    return mesh_.materials[material].base_color_map || mesh_.materials[material].alpha_map;
  }

  void fill_pattern(Pattern& pattern, int subdivisions) const {
    const SourceMaterial& material = mesh_.materials[pattern.material];
    pattern.cut = cut_by_mask(material, pattern.triangle, subdivisions);
    for (const uvec3& t : pattern.cut.triangles) {
      UvTriangle uv;
      for (int k = 0; k < 3; ++k) {
        const vec3& b = pattern.cut.vertices[t[k]];
        const UvTriangle& whole = pattern.triangle.uv;
        uv[static_cast<size_t>(k)] = b.x * whole[0] + b.y * whole[1] + b.z * whole[2];
      }
      pattern.averages.push_back(average_textures(material, uv));
    }
  }

  void add_pieces(const CornerTriangle& t, const Pattern& pattern) {
    std::vector<uint32_t> vertices;
    for (const vec3& barycentric : pattern.cut.vertices) vertices.push_back(vertex_at(t.vertex, barycentric));
    const vec3 normal = normal_of(t.vertex), color = color_of(t);
    for (size_t i = 0; i < pattern.cut.triangles.size(); ++i) {
      const uvec3& piece = pattern.cut.triangles[i];
      const uvec3 triangle(vertices[piece.x], vertices[piece.y], vertices[piece.z]);
      const bool is_collapsed = triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x;
      const dvec3 area = area_vector(surface_.positions, triangle);
      if (is_collapsed || !(glm::dot(area, area) > 0)) continue;  // too small for single precision here
      surface_.triangles.push_back(triangle);
      surface_.materials.push_back(face_material(mesh_.materials[t.material], pattern.averages[i], color, normal));
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
          on_edge_.try_emplace(uvec3(corners[a], corners[b], bits), static_cast<uint32_t>(surface_.positions.size()));
      if (is_new) {
        surface_.positions.push_back(
            glm::mix(surface_.positions[corners[a]], surface_.positions[corners[b]], barycentric[b]));
      }
      return found->second;
    }
    surface_.positions.push_back(barycentric.x * surface_.positions[corners.x] +
                                 barycentric.y * surface_.positions[corners.y] +
                                 barycentric.z * surface_.positions[corners.z]);
    return static_cast<uint32_t>(surface_.positions.size() - 1);
  }

  void drop_unused_vertices() {
    std::vector<uint32_t> target(surface_.positions.size(), kNoIndex);
    std::vector<vec3> kept;
    for (uvec3& t : surface_.triangles) {
      for (int k = 0; k < 3; ++k) {
        if (target[t[k]] == kNoIndex) {
          target[t[k]] = static_cast<uint32_t>(kept.size());
          kept.push_back(surface_.positions[t[k]]);
        }
        t[k] = target[t[k]];
      }
    }
    surface_.positions = std::move(kept);
  }

  const SourceMesh& mesh_;
  const Job& job_;
  Surface surface_;
  std::vector<uint32_t> pattern_of_;  ///< per triangle; kNoIndex: not masked
  std::vector<Pattern> patterns_;
  std::unordered_map<uvec3, uint32_t, TriangleKeyHash> on_edge_;
};

/// One line each, and not a thousand of them.
std::vector<std::string> limit(std::vector<std::string> warnings) {
  if (warnings.size() <= kMaxWarnings) return warnings;
  const size_t more = warnings.size() - kMaxWarnings;
  warnings.resize(kMaxWarnings);
  warnings.push_back(fmt::format("and {} further warnings", more));
  return warnings;
}

}  // namespace

Result<ImportedAsset> condition(SourceMesh mesh, const std::string& name, const Job& job) {
  drop_faces_that_are_not_finite(mesh);
  FARFIELD_TRY_LET(const auto origin, choose_origin(mesh, name));
  std::vector<vec3> positions;
  positions.reserve(mesh.positions.size());
  for (const dvec3& p : mesh.positions) positions.emplace_back(p - origin);
  mesh.positions = {};
  WeldResult welded = weld(positions, mesh.face_begin, mesh.corner_position);
  positions = {};
  if (100 * welded.near_welds > welded.positions.size()) {  // a few happen in any large mesh
    mesh.warnings.push_back(fmt::format("{} vertices joined with others within rounding of them", welded.near_welds));
  }
  const std::vector<CornerTriangle> triangles = triangulate(mesh, welded);

  ImportedAsset asset;
  asset.surface = SurfaceBuilder(mesh, std::move(welded.positions), job).build(triangles);
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, fmt::format("{}: cancelled", name));
  asset.surface.origin = origin;
  if (asset.surface.triangles.empty()) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: no face has any area", name));
  }
  asset.source_hash = mesh.source_hash;
  asset.source_files = std::move(mesh.source_files);
  asset.warnings = limit(std::move(mesh.warnings));
  return asset;
}

Result<ImportedAsset> import_asset(const fs::path& path, const ImportOptions& options, const Job& job) {
  FARFIELD_TRY_LET(auto mesh, read_source(path, options));
  return condition(std::move(mesh), path.string(), job);
}

}  // namespace farfield
