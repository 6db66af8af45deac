// SPDX-License-Identifier: Apache-2.0
// How alike would levels look if they were meshes that meshoptimizer simplifies, in the same bytes?
//
//   build/release/bin/simplified_levels SOURCE ASSET.farfield simplify|sloppy OUT.farfield [MESH]
//   build/release/bin/farfield evaluate OUT.farfield --source SOURCE
//
// OUT is the asset with a mesh for each of its levels but the source: the source, resolved as the bake does it, that
// meshopt_simplify or meshopt_simplifySloppy has brought to at most the level's resident bytes (with the BVH, measured
// as the bake does). Where simplify stops before, its least is taken, and said. Faces have flat normals and the mean of
// the materials around their corners, as a renderer without levels would show them.
#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <filesystem>

#include "bake/pack_level.h"
#include "base/file_io.h"
#include "bvh/level_scene.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "prefilter/condition.h"
#include "prefilter/material_filter.h"
#include "prefilter/resolve.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

enum class Simplifier { Simplify, Sloppy };

/// A mesh to simplify, and what its vertices look like.
class VertexMesh {
 public:
  explicit VertexMesh(Surface surface) : surface_(std::move(surface)), materials_(surface_.positions.size()) {
    std::vector<float> area(surface_.positions.size());
    for (size_t f = 0; f < surface_.triangles.size(); ++f) {
      const auto of_face = static_cast<float>(glm::length(area_vector_of(corners_of(surface_, f))));
      for (int c = 0; c < 3; ++c) {
        const uint32_t v = surface_.triangles[f][c];
        area[v] += of_face;
        if (!(area[v] > 0)) continue;
        const float share = of_face / area[v];
        materials_[v] = mix(materials_[v], 1 - share, surface_.materials[f], share);
      }
    }
  }

  size_t face_count() const { return surface_.triangles.size(); }

  /// At most `faces` faces, if the simplifier can.
  Surface simplified(Simplifier simplifier, size_t faces) const {
    const uint32_t* indices = &surface_.triangles[0].x;
    const float* positions = &surface_.positions[0].x;
    const size_t count = 3 * face_count(), vertices = surface_.positions.size();
    std::vector<uint32_t> kept(count);
    kept.resize(simplifier == Simplifier::Simplify
                    ? meshopt_simplify(kept.data(), indices, count, positions, vertices, sizeof(vec3), 3 * faces,
                                       FLT_MAX, 0, nullptr)
                    : meshopt_simplifySloppy(kept.data(), indices, count, positions, vertices, sizeof(vec3), 3 * faces,
                                             FLT_MAX, nullptr));
    Surface result;
    result.positions = surface_.positions;
    result.origin = surface_.origin;
    for (size_t i = 0; i < kept.size(); i += 3) {
      const uvec3 face(kept[i], kept[i + 1], kept[i + 2]);
      const dvec3 across = area_vector_of(corners_of(surface_, face));
      if (!(glm::length(across) > 0)) continue;
      result.triangles.push_back(face);
      result.materials.push_back(material_of(face, vec3(glm::normalize(across))));
    }
    return result;
  }

 private:
  FaceMaterial material_of(const uvec3& face, const vec3& normal) const {
    const FaceMaterial two = mix(materials_[face.x], 0.5f, materials_[face.y], 0.5f);
    FaceMaterial material = mix(two, 2.0f / 3, materials_[face.z], 1.0f / 3);
    material.sggx = SymMat3::outer(normal);
    return material;
  }

  Surface surface_;
  std::vector<FaceMaterial> materials_;  ///< of vertices: means over the faces around, weighted by area
};

/// A level of a mesh alone, and what it costs.
struct MeshLevel {
  LevelData level;
  LevelCost cost;
};

Result<MeshLevel> make_level(const LevelEntry& entry, const Surface& mesh) {
  const SurfaceOrder order = order_surface(mesh);
  LevelData level = pack_level(entry.level, entry.resolution, reorder(mesh, order), order, {}, {});
  FARFIELD_TRY_LET(const auto cost, measure_level_scene(view_of(level)));
  return MeshLevel{std::move(level), cost};
}

/// The largest mesh found that takes no more than the level; the simplifier's smallest if there is none.
Result<MeshLevel> fit(const LevelEntry& entry, const VertexMesh& mesh, Simplifier simplifier) {
  size_t fits = 2, too_many = mesh.face_count() + 1;  // faces asked for
  FARFIELD_TRY_LET(auto best, make_level(entry, mesh.simplified(simplifier, fits)));
  if (best.cost.resident_bytes > entry.resident_bytes) return best;
  while (too_many - fits > 1 + fits / 64) {
    const size_t faces = fits + (too_many - fits) / 2;
    FARFIELD_TRY_LET(auto level, make_level(entry, mesh.simplified(simplifier, faces)));
    if (level.cost.resident_bytes > entry.resident_bytes) {
      too_many = faces;
      continue;
    }
    fits = faces;
    best = std::move(level);
  }
  return best;
}

/// Writes the mesh in the level's place.
Result<LevelEntry> replace(LevelEntry entry, const MeshLevel& mesh, const fs::path& folder) {
  entry.triangles = face_count(mesh.level);
  entry.voxels = entry.bricks = 0;
  entry.resident_bytes = mesh.cost.resident_bytes;
  entry.build_peak_bytes = mesh.cost.build_peak_bytes;
  entry.errors.reset();
  FARFIELD_TRY_LET(entry.file_bytes, write_level(folder / entry.file, mesh.level));
  FARFIELD_TRY_LET(entry.file_hash, hash_file(folder / entry.file));
  return entry;
}

struct Arguments {
  fs::path source_file, asset;
  Simplifier simplifier = Simplifier::Simplify;
  fs::path out;
  ImportOptions import;
};

Result<void> run(const Arguments& arguments) {
  const auto& [source_file, asset, simplifier, out, import] = arguments;
  FARFIELD_TRY_LET(auto manifest, read_manifest(asset));
  FARFIELD_TRY_LET(const auto source, import_asset(source_file, import));
  if (source.source_hash != manifest.source_hash)
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: was not baked from {}; bake it again", asset.string(), source_file.string()));
  fs::create_directories(out);
  fs::copy(asset, out, fs::copy_options::overwrite_existing | fs::copy_options::recursive);
  manifest.options = "simplified_levels";  // no bake takes it for its own
  std::vector<LevelEntry> levels;
  for (const LevelEntry& entry : manifest.levels) {
    if (entry.level == 0) {
      levels.push_back(entry);
      continue;
    }
    FARFIELD_TRY_LET(auto resolved, resolve(source.source, static_cast<float>(entry.resolution)));
    FARFIELD_TRY_LET(const auto mesh, fit(entry, VertexMesh(std::move(resolved.surface)), simplifier));
    if (!mesh.level.has_surface()) {
      fmt::print("{:4}^3 nothing is left of it\n", entry.grid);
      continue;
    }
    FARFIELD_TRY_LET(const auto replaced, replace(entry, mesh, out));
    levels.push_back(replaced);
    fmt::print("{:4}^3 {:8} triangles, {:8} bytes where the level has {:8}{}\n", entry.grid, replaced.triangles,
               replaced.resident_bytes, entry.resident_bytes,
               replaced.resident_bytes > entry.resident_bytes ? ": the simplifier can no less" : "");
    std::fflush(stdout);
  }
  manifest.levels = std::move(levels);
  return write_manifest(out, manifest);
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  using farfield::Simplifier;
  if (argc < 5 || argc > 6 || (std::strcmp(argv[3], "simplify") != 0 && std::strcmp(argv[3], "sloppy") != 0)) {
    fmt::print("usage: simplified_levels SOURCE ASSET.farfield simplify|sloppy OUT.farfield [MESH of a glTF]\n");
    return 2;
  }
  farfield::Arguments arguments{argv[1], argv[2], Simplifier::Simplify, argv[4], {}};
  if (std::strcmp(argv[3], "sloppy") == 0) arguments.simplifier = Simplifier::Sloppy;
  if (argc == 6) arguments.import.mesh = std::atoi(argv[5]);
  if (const auto done = farfield::run(arguments); !done) {
    fmt::print(stderr, "{}\n", done.error().message);
    return 1;
  }
}
