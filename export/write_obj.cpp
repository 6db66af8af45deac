// SPDX-License-Identifier: Apache-2.0
// OBJ with MTL, in the dialect that import/material_library.cpp reads back as it was.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/temporary_file.h"
#include "base/text.h"
#include "export/material_groups.h"
#include "export/surface_writers.h"

namespace farfield {
namespace {

/// Text on its way to a file, in pieces.
class TextFile {
 public:
  explicit TextFile(const std::filesystem::path& path) : file_(path) {}

  template <typename... Args>
  void add(fmt::format_string<Args...> text, Args&&... args) {
    fmt::format_to(std::back_inserter(buffer_), text, std::forward<Args>(args)...);
    if (buffer_.size() > kPiece) flush();
  }
  Result<void> commit() {
    flush();
    return file_.commit();
  }

 private:
  static constexpr size_t kPiece = 1 << 16;
  void flush() {
    file_.write(std::as_bytes(std::span(buffer_.data(), buffer_.size())));
    buffer_.clear();
  }

  TemporaryFile file_;
  fmt::memory_buffer buffer_;
};

std::string color_text(const vec3& c) { return fmt::format("{:.6g} {:.6g} {:.6g}", c.x, c.y, c.z); }

/// Phong's exponent and strength, or a mirror's own reflectance: see set_specular() there.
void add_highlight(const FaceLook& look, TextFile& mtl) {
  constexpr float kUsual = 0.04f, kMostExponent = 1e6f;
  if (look.specular == vec3(0.0f)) return mtl.add("illum 1\n");
  const float alpha2 = std::pow(look.roughness, 4.0f);
  mtl.add("Ns {:.6g}\n", std::clamp(2 / std::max(alpha2, 1e-9f) - 2, 0.0f, kMostExponent));
  const bool is_dielectric = max_component(look.specular) <= 1.001f * kUsual;
  const vec3 ks = is_dielectric ? glm::min(look.specular / kUsual, vec3(1.0f)) : look.specular;
  mtl.add("Ks {}\nillum {}\n", color_text(ks), is_dielectric ? 2 : 3);
}

void add_material(const std::string& name, const FaceLook& look, TextFile& mtl) {
  mtl.add("\nnewmtl {}\nKd {}\n", name, color_text(look.diffuse));
  add_highlight(look, mtl);
  if (look.opacity < 1) mtl.add("d {:.6g}\n", look.opacity);
  if (look.emission != vec3(0.0f)) mtl.add("Ke {}\n", color_text(look.emission));
}

void add_positions(const LevelOfAsset& from, TextFile& obj) {
  for (const vec3& position : from.level.positions) {
    if (from.is_in_place()) {
      obj.add("v {} {} {}\n", position.x, position.y, position.z);
      continue;
    }
    const dvec3 p = from.to_source(position);
    obj.add("v {:.15g} {:.15g} {:.15g}\n", p.x, p.y, p.z);
  }
}

void add_normals(const LevelOfAsset& from, TextFile& obj) {
  const mat3 rotation(from.manifest.rotation);
  for (const PackedNormal& normal : from.level.shading_normal) {
    const vec3 n = rotation * unpack_normal(normal);
    obj.add("vn {:.6g} {:.6g} {:.6g}\n", n.x, n.y, n.z);
  }
}

void add_face(const LevelView& level, uint32_t face, const uvec3& corners, TextFile& obj) {
  const uvec3 v = corners + 1u;
  if (level.shading_normal.empty()) return obj.add("f {} {} {}\n", v.x, v.y, v.z);
  const uvec3 n = level.corner_vertex[face] + 1u;
  obj.add("f {}//{} {}//{} {}//{}\n", v.x, n.x, v.y, n.y, v.z, n.z);
}

std::vector<std::string> notes_of(const LevelOfAsset& from, const MaterialGroups& groups) {
  std::vector<std::string> notes;
  if (groups.widest_step > 0) {
    notes.push_back(fmt::format("its materials, one per face, are rounded to {}, {:.1f} % of white apart at most; "
                                ".ply and .glb have their colours",
                                groups.looks.size(), 100 * groups.widest_step));
  }
  if (!from.level.face_transmission.empty())
    notes.push_back("light through leaves (transmission) is left out; .ply and .glb have it");
  if (!from.level.face_sggx.empty()) notes.push_back(kNormalsInRoughness);
  return notes;
}

}  // namespace

std::string group_name(const LevelOfAsset& from, size_t group) {
  return fmt::format("level_{}_{}", from.entry.level, group);
}

std::filesystem::path mtl_of(const std::filesystem::path& obj) {
  std::filesystem::path mtl = obj;
  return mtl.replace_extension(".mtl");
}

Result<WrittenSurface> write_obj(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job) {
  const LevelView& level = from.level;
  const std::vector<uvec3> corners = face_corners(level);
  const MaterialGroups groups = group_materials(face_looks(level, corners), {.by_transmission = false});
  TextFile obj(path), mtl(mtl_of(path));
  const std::string head = fmt::format("# {}: level {} of {}, resolution {}\n", kExportGenerator, from.entry.level,
                                       without_controls(from.manifest.source), from.entry.resolution);
  mtl.add("{}", head);
  for (size_t g = 0; g < groups.looks.size(); ++g) add_material(group_name(from, g), groups.looks[g], mtl);
  obj.add("{}mtllib {}\n", head, mtl_of(path).filename().string());
  add_positions(from, obj);
  add_normals(from, obj);
  for (size_t g = 0; g < groups.looks.size(); ++g) {
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "export: cancelled");
    obj.add("usemtl {}\n", group_name(from, g));
    for (uint32_t i = groups.begin[g]; i < groups.begin[g + 1]; ++i)
      add_face(level, groups.faces[i], corners[groups.faces[i]], obj);
  }
  FARFIELD_TRY(obj.commit());  // the larger one: a full disk shows here
  if (Result<void> done = mtl.commit(); !done) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);  // both or none
    return tl::unexpected(done.error());
  }
  return WrittenSurface{corners.size(), level.positions.size(), groups.looks.size(), notes_of(from, groups)};
}

}  // namespace farfield
