// SPDX-License-Identifier: Apache-2.0
// From polygons to clean triangles: move near the origin, weld, triangulate.
#include "prefilter/condition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/free_memory.h"
#include "base/hash.h"
#include "base/index.h"
#include "base/result.h"
#include "prefilter/cut_tile.h"
#include "prefilter/subdivide.h"
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

/// Calls visit(array) for each array that has an element per corner, also where it is empty.
template <typename Visit>
void for_each_corner_array(SourceMesh& mesh, const Visit& visit) {
  visit(mesh.corner_position);
  visit(mesh.corner_uv);
  visit(mesh.corner_color);
  visit(mesh.corner_normal);
}

/// Keeps the faces for which keep(begin, end) of their corners holds; `number` gets the former numbers of those.
template <typename Keep>
size_t remove_faces(SourceMesh& mesh, std::vector<uint32_t>& number, const Keep& keep) {
  uint32_t corners = 0, begin = 0;
  for (uint32_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t end = mesh.face_begin[face + 1];
    if (keep(begin, end)) {
      for_each_corner_array(mesh, [&](auto& array) {
        if (!array.empty()) std::copy(array.begin() + begin, array.begin() + end, array.begin() + corners);
      });
      corners += end - begin;
      mesh.face_material[number.size()] = mesh.face_material[face];
      number.push_back(face);
      mesh.face_begin[number.size()] = corners;
    }
    begin = end;
  }
  const size_t dropped = mesh.face_count() - number.size();
  for_each_corner_array(mesh, [&](auto& array) {
    if (!array.empty()) array.resize(corners);
  });
  mesh.face_material.resize(number.size());
  mesh.face_begin.resize(number.size() + 1);
  return dropped;
}

/// Returns the former numbers of the faces that stay.
std::vector<uint32_t> drop_faces_that_are_not_finite(SourceMesh& mesh) {
  std::vector<uint32_t> number;
  const size_t dropped = remove_faces(mesh, number, [&](uint32_t begin, uint32_t end) {
    return std::all_of(mesh.corner_position.begin() + begin, mesh.corner_position.begin() + end, [&](uint32_t v) {
      const dvec3& p = mesh.positions[v];
      return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    });
  });
  if (dropped > 0)
    mesh.warnings.push_back(fmt::format("{} faces have coordinates that are not finite; dropped", dropped));
  return number;
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

struct TriangleKeyHash {
  size_t operator()(const uvec3& t) const { return mix64(mix64(t.x, t.y), t.z); }
};

/// Appends the triangles of the mesh's polygons to a surface that has their vertices.
class Triangulation {
 public:
  /// place: per face, or empty.
  Triangulation(SourceMesh& mesh, const WeldResult& welded, const std::vector<uint32_t>& place, SourceSurface& surface)
      : mesh_(mesh), welded_(welded), place_(place), surface_(surface) {}

  void run(const std::vector<uint32_t>& source_face, const Job& job) {
    for (size_t face = 0; face < mesh_.face_count() && !job.is_cancelled(); ++face) add_face(face, source_face[face]);
    if (quads_ == 0) free_memory(surface_.quad);
    if (degenerate_ > 0) mesh_.warnings.push_back(fmt::format("{} faces have no area; dropped", degenerate_));
    if (repeated_ > 0) {
      mesh_.warnings.push_back(
          fmt::format("{} triangles repeat an earlier one with the same corners; dropped", repeated_));
    }
  }

 private:
  void add_face(size_t face, uint32_t source_face) {
    distinct_corners(mesh_, welded_, mesh_.face_begin[face], mesh_.face_begin[face + 1], corners_);
    points_.clear();
    for (const uint32_t c : corners_) points_.emplace_back(surface_.positions[vertex_of(c)]);
    bool has_area = false;
    const size_t first = surface_.triangles.size();
    for (const uvec3& t : triangulate_polygon(points_)) {
      has_area |= add_triangle({corners_[t.x], corners_[t.y], corners_[t.z]}, face, source_face);
    }
    if (!has_area) ++degenerate_;
    const bool is_quad = corners_.size() == 4 && surface_.triangles.size() == first + 2;
    surface_.quad.resize(surface_.triangles.size(), is_quad ? quads_++ : kNoIndex);
  }

  /// False: it has no area.
  bool add_triangle(const uvec3& corner, size_t face, uint32_t source_face) {
    surface_.triangles.push_back({vertex_of(corner.x), vertex_of(corner.y), vertex_of(corner.z)});
    const dvec3 area = surface_.area_vector(surface_.triangles.size() - 1);
    const bool has_area = glm::dot(area, area) > 0;
    if (!has_area || !is_first(surface_.triangles.back())) {
      surface_.triangles.pop_back();
      return has_area;
    }
    surface_.material.push_back(mesh_.face_material[face]);
    surface_.source_face.push_back(source_face);
    if (!place_.empty()) surface_.placement.push_back(place_[face]);
    add_corners(corner, mesh_.corner_uv, surface_.corner_uv);
    add_corners(corner, mesh_.corner_color, surface_.corner_color);
    add_corners(corner, mesh_.corner_normal, surface_.corner_normal);
    return true;
  }

  bool is_first(uvec3 t) {
    if (t.x > t.y) std::swap(t.x, t.y);
    if (t.y > t.z) std::swap(t.y, t.z);
    if (t.x > t.y) std::swap(t.x, t.y);
    const bool is_new = seen_.insert(t).second;
    repeated_ += !is_new;
    return is_new;
  }

  template <typename T>
  static void add_corners(const uvec3& corner, const std::vector<T>& from, std::vector<T>& to) {
    if (from.empty()) return;
    for (int k = 0; k < 3; ++k) to.push_back(from[corner[k]]);
  }

  uint32_t vertex_of(uint32_t corner) const { return welded_.vertex_of[mesh_.corner_position[corner]]; }

  SourceMesh& mesh_;
  const WeldResult& welded_;
  const std::vector<uint32_t>& place_;
  SourceSurface& surface_;
  std::unordered_set<uvec3, TriangleKeyHash> seen_;
  size_t degenerate_ = 0, repeated_ = 0;
  uint32_t quads_ = 0;
  std::vector<uint32_t> corners_;
  std::vector<dvec3> points_;
};

void drop_unused_vertices(SourceSurface& surface) {
  std::vector<uint32_t> target(surface.positions.size(), kNoIndex);
  std::vector<vec3> kept;
  for (uvec3& t : surface.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (target[t[k]] == kNoIndex) {
        target[t[k]] = static_cast<uint32_t>(kept.size());
        kept.push_back(surface.positions[t[k]]);
      }
      t[k] = target[t[k]];
    }
  }
  surface.positions = std::move(kept);
}

/// Makes shading normals unit; where the source gives none that is usable, the face's own. Leaves them out altogether
/// where they say nothing new, as of flat-shaded exports.
void tidy_normals(SourceSurface& surface, std::vector<std::string>& warnings) {
  constexpr float kSameCosine = 0.999999f;  // 0.08 degrees
  bool is_smooth = false;
  size_t unusable = 0;
  for (size_t corner = 0; corner < surface.corner_normal.size(); ++corner) {
    vec3& normal = surface.corner_normal[corner];
    const vec3 own(glm::normalize(surface.area_vector(corner / 3)));
    const float largest = max_component(glm::abs(normal));
    if (largest > 0 && is_finite(normal)) {
      normal = glm::normalize(normal / largest);
    } else {
      unusable += largest != 0;
      normal = own;
    }
    is_smooth |= std::abs(glm::dot(normal, own)) < kSameCosine;
  }
  if (unusable > 0) warnings.push_back(fmt::format("{} normals are not finite; ignored", unusable));
  if (!is_smooth) free_memory(surface.corner_normal);
}

/// One line each, and not a thousand of them.
std::vector<std::string> limit(std::vector<std::string> warnings) {
  if (warnings.size() <= kMaxWarnings) return warnings;
  const size_t more = warnings.size() - kMaxWarnings;
  warnings.resize(kMaxWarnings);
  warnings.push_back(fmt::format("and {} further warnings", more));
  return warnings;
}

tl::unexpected<Error> cancelled() { return make_error(ErrorCode::Cancelled, "import: cancelled"); }

/// Per face: its place, or kNoIndex; nothing if no mesh has several. file_face: of each face its number in the file.
std::vector<uint32_t> places_of_faces(const SourceMesh& mesh, const std::vector<uint32_t>& file_face) {
  std::unordered_set<uint32_t> meshes;
  const auto is_new = [&](const SourcePlacement& placement) { return meshes.insert(placement.mesh).second; };
  if (std::ranges::all_of(mesh.placements, is_new)) return {};
  std::vector<uint32_t> places(file_face.size(), kNoIndex);
  uint32_t place = 0;  // both ascend
  for (size_t face = 0; face < file_face.size(); ++face) {
    while (place < mesh.placements.size() &&
           mesh.placements[place].first_face + mesh.placements[place].face_count <= file_face[face]) {
      ++place;
    }
    if (place < mesh.placements.size() && mesh.placements[place].first_face <= file_face[face]) places[face] = place;
  }
  return places;
}

/// To positions relative to the origin.
std::vector<SurfacePlacement> placements_from(const SourceMesh& mesh, const dvec3& origin) {
  std::vector<SurfacePlacement> placements;
  for (const SourcePlacement& from : mesh.placements) {
    placements.push_back({from.mesh, from.to_asset});
    placements.back().to_surface[3] -= origin;
  }
  return placements;
}

Result<ImportedAsset> condition_mesh(SourceMesh& mesh, const std::string& name, const Job& job) {
  std::vector<uint32_t> source_face = drop_faces_that_are_not_finite(mesh);
  const std::vector<uint32_t> place = places_of_faces(mesh, source_face);
  if (!mesh.face_number.empty()) {
    for (uint32_t& face : source_face) face = mesh.face_number[face];
  }
  FARFIELD_TRY_LET(const auto origin, choose_origin(mesh, name));
  std::vector<vec3> positions;
  positions.reserve(mesh.positions.size());
  for (const dvec3& p : mesh.positions) positions.emplace_back(p - origin);
  free_memory(mesh.positions);
  WeldResult welded = weld(positions, mesh.face_begin, mesh.corner_position, job);
  if (job.is_cancelled()) return cancelled();
  free_memory(positions);
  if (100 * welded.near_welds > welded.positions.size()) {  // a few happen in any large mesh
    mesh.warnings.push_back(fmt::format("{} vertices joined with others within rounding of them", welded.near_welds));
  }

  ImportedAsset asset;
  SourceSurface& surface = asset.source;
  surface.origin = origin;
  surface.positions = std::move(welded.positions);
  if (!place.empty()) surface.placements = placements_from(mesh, origin);
  surface.materials = std::move(mesh.materials);
  surface.material_function = std::move(mesh.material_function);
  surface.material_batch = std::move(mesh.material_batch);
  Triangulation(mesh, welded, place, surface).run(source_face, job);
  if (job.is_cancelled()) return cancelled();
  if (surface.triangles.empty()) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: no face has any area", name));
  }
  drop_unused_vertices(surface);
  tidy_normals(surface, mesh.warnings);
  asset.source_hash = mesh.source_hash;
  asset.source_files = std::move(mesh.source_files);
  asset.warnings = limit(std::move(mesh.warnings));
  return asset;
}

Result<ImportedAsset> import_tile(const fs::path& path, const ImportOptions& options, const Job& job) {
  KnownMesh own;
  FARFIELD_TRY_LET(const ImportedAsset* whole,
                   (options.known_mesh ? *options.known_mesh : own).import(path, options, job));
  ImportedAsset tile;
  tile.source = cut_tile(whole->source, options.tile);
  if (tile.source.triangles.empty()) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {} faces make no {} tiles; ask for fewer", path.string(),
                                                      whole->source.triangles.size(), options.tile.count));
  }
  tile.source_hash = tile_hash(whole->source_hash, options.tile);
  tile.source_files = whole->source_files;
  if (options.tile.number == 0) tile.warnings = whole->warnings;
  return tile;
}

}  // namespace

Result<ImportedAsset> condition(SourceMesh mesh, const std::string& name, const Job& job) {
  return with_warnings(condition_mesh(mesh, name, job), mesh.warnings);
}

Result<const ImportedAsset*> KnownMesh::import(const fs::path& path, const ImportOptions& options, const Job& job) {
  std::string name = fmt::format("{} mesh={} node={} grid={} {}", path.string(), options.mesh, options.node,
                                 options.subdivision.grid, canonical_text(options.subdivision));
  if (mesh_ && name_ == name) return &*mesh_;
  mesh_.reset();
  ImportOptions whole = options;
  whole.tile = {};
  FARFIELD_TRY_LET(mesh_, import_asset(path, whole, job));
  name_ = std::move(name);
  return &*mesh_;
}

Result<ImportedAsset> import_asset(const fs::path& path, const ImportOptions& options, const Job& job) {
  if (options.tile.is_part()) return import_tile(path, options, job);
  FARFIELD_TRY_LET(auto cage, read_source(path, options));
  FARFIELD_TRY_LET(auto mesh, subdivide(std::move(cage), options.subdivision, path.string(), job));
  return condition(std::move(mesh), path.string(), job);
}

}  // namespace farfield
