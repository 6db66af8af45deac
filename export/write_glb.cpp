// SPDX-License-Identifier: Apache-2.0
// Binary glTF 2.0. A level has a material per face: what varies most, base colour and opacity, stands at corners
// (COLOR_0), so that vertices are apart where faces differ; the rest is in one material, and one primitive, per group.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "base/file_io.h"
#include "base/hash.h"
#include "export/material_groups.h"
#include "export/surface_writers.h"

namespace farfield {
namespace {

using Json = nlohmann::ordered_json;
using PackedRgba = std::array<uint16_t, 4>;  // linear, 65535 is 1

PackedRgba pack_rgba(const vec3& color, float alpha) {
  const auto pack = [](float x) { return static_cast<uint16_t>(std::lround(65535 * std::clamp(x, 0.0f, 1.0f))); };
  return {pack(color.x), pack(color.y), pack(color.z), pack(alpha)};
}

/// All that makes corners different.
struct Corner {
  uint32_t position = 0, shading = 0;
  PackedRgba color{};
  friend bool operator==(const Corner&, const Corner&) = default;
};
static_assert(sizeof(Corner) == 16, "hashed byte by byte: no padding");
struct CornerHash {
  size_t operator()(const Corner& corner) const { return hash_values(std::span<const Corner>(&corner, 1)); }
};

/// The arrays of the file's buffer.
struct Vertices {
  std::vector<vec3> positions, normals;  ///< normals: none, or one per position
  std::vector<PackedRgba> colors;
  std::vector<uint32_t> indices;  ///< group by group
};

class VertexMaker {
 public:
  explicit VertexMaker(const LevelView& level) : level_(level) {}

  void add_face(uint32_t face, const uvec3& corners, const PackedRgba& color) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t shading = level_.shading_normal.empty() ? 0 : level_.corner_vertex[face][k];
      out_.indices.push_back(vertex_of({corners[k], shading, color}));
    }
  }
  Vertices take() { return std::move(out_); }

 private:
  uint32_t vertex_of(const Corner& corner) {
    const auto [found, is_new] = numbers_.try_emplace(corner, static_cast<uint32_t>(out_.positions.size()));
    if (is_new) {
      out_.positions.push_back(level_.positions[corner.position]);
      out_.colors.push_back(corner.color);
      if (!level_.shading_normal.empty()) out_.normals.push_back(unpack_normal(level_.shading_normal[corner.shading]));
    }
    return found->second;
  }

  const LevelView& level_;
  std::unordered_map<Corner, uint32_t, CornerHash> numbers_;
  Vertices out_;
};

/// glTF's share of the base that goes through: whatever it is, the two parts of material_sample()
/// (scattering/material_model.h) come out as they are. The smallest that leaves the other colour in range.
float through_of(const FaceLook& look) { return std::min(max_component(look.transmission), 0.999f); }

PackedRgba color_of(const FaceLook& face, const FaceLook& group) {
  return pack_rgba(face.diffuse / (1 - through_of(group)), face.opacity);
}

Vertices make_vertices(const LevelView& level, const std::vector<FaceLook>& looks, const std::vector<uvec3>& corners,
                       const MaterialGroups& groups) {
  VertexMaker maker(level);
  for (const uint32_t f : groups.faces) maker.add_face(f, corners[f], color_of(looks[f], groups.looks[groups.of_face[f]]));
  return maker.take();
}

Json to_json(const vec3& v) { return {v.x, v.y, v.z}; }

Json material_json(const std::string& name, const FaceLook& look) {
  Json material = {{"name", name},
                   {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", look.roughness}}},
                   {"doubleSided", true}};
  if (look.opacity < 1) material["alphaMode"] = "BLEND";
  Json extensions = Json::object();
  constexpr float kUsual = 0.04f;  // F0 without the extension
  if (look.specular == vec3(0.0f)) {
    extensions["KHR_materials_specular"] = {{"specularFactor", 0.0}};
  } else if (max_component(glm::abs(look.specular - kUsual)) > 0.001f * kUsual) {
    extensions["KHR_materials_specular"] = {{"specularColorFactor", to_json(look.specular / kUsual)}};
  }
  if (const float through = through_of(look); through > 0) {
    extensions["KHR_materials_diffuse_transmission"] = {
        {"diffuseTransmissionFactor", through}, {"diffuseTransmissionColorFactor", to_json(look.transmission / through)}};
  }
  if (const float strength = max_component(look.emission); strength > 0) {
    material["emissiveFactor"] = to_json(look.emission / strength);
    extensions["KHR_materials_emissive_strength"] = {{"emissiveStrength", strength}};
  }
  if (!extensions.empty()) material["extensions"] = extensions;
  return material;
}

/// The file's JSON and, in the same order, the bytes of its buffer.
class GlbFile {
 public:
  GlbFile(const LevelOfAsset& from, const Vertices& vertices, const MaterialGroups& groups) {
    add_head(from);
    add_primitives(vertices, groups);
    for (size_t g = 0; g < groups.looks.size(); ++g)
      json_["materials"].push_back(material_json(group_name(from, g), groups.looks[g]));
    name_extensions();
    json_["accessors"] = accessors_;
    json_["bufferViews"] = views_;
    json_["buffers"] = Json::array({{{"byteLength", buffer_bytes_}}});
  }

  Result<void> write(const std::filesystem::path& path) const {
    // What files say may be no UTF-8: replaced, not thrown about.
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t file_bytes = 12 + 8 + text.size() + 8 + buffer_bytes_;
    if (file_bytes > std::numeric_limits<uint32_t>::max()) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{}: a .glb has at most 4 GiB, this would have {:.1f}; export a coarser level or "
                                    "a .ply",
                                    path.string(), static_cast<double>(file_bytes) / (1ull << 30)));
    }
    constexpr uint32_t kMagic = 0x46546c67, kVersion = 2, kJson = 0x4e4f534a, kBinary = 0x004e4942;
    const std::array<uint32_t, 5> head = {kMagic, kVersion, static_cast<uint32_t>(file_bytes),
                                          static_cast<uint32_t>(text.size()), kJson};
    const std::array<uint32_t, 2> middle = {static_cast<uint32_t>(buffer_bytes_), kBinary};
    std::vector<std::span<const std::byte>> pieces = {std::as_bytes(std::span(head)), std::as_bytes(std::span(text)),
                                                      std::as_bytes(std::span(middle))};
    pieces.insert(pieces.end(), pieces_.begin(), pieces_.end());
    return write_file_atomically(path, pieces);
  }

 private:
  void add_head(const LevelOfAsset& from) {
    const glm::dmat3& r = from.manifest.rotation;
    const dvec3& o = from.manifest.origin;
    json_["asset"] = {{"version", "2.0"},
                      {"generator", kExportGenerator},
                      {"extras",
                       {{"source", from.manifest.source},
                        {"level", from.entry.level},
                        {"resolution", from.entry.resolution}}}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({{{"nodes", {0}}}});
    Json node = {{"name", fmt::format("level_{}", from.entry.level)}, {"mesh", 0}};
    if (!from.is_in_place()) {
      node["matrix"] = {r[0].x, r[0].y, r[0].z, 0.0, r[1].x, r[1].y, r[1].z, 0.0,
                        r[2].x, r[2].y, r[2].z, 0.0, o.x,    o.y,    o.z,    1.0};
    }
    json_["nodes"] = Json::array({node});
  }

  void add_primitives(const Vertices& vertices, const MaterialGroups& groups) {
    constexpr int kFloat = 5126, kUshort = 5123, kUint = 5125;
    Json attributes;
    attributes["POSITION"] = add_vertices(vertices.positions, kFloat, "VEC3");
    Box3 box;
    for (const vec3& p : vertices.positions) box.extend(p);
    accessors_.back()["min"] = to_json(box.lower);
    accessors_.back()["max"] = to_json(box.upper);
    attributes["COLOR_0"] = add_vertices(vertices.colors, kUshort, "VEC4");
    accessors_.back()["normalized"] = true;
    if (!vertices.normals.empty()) attributes["NORMAL"] = add_vertices(vertices.normals, kFloat, "VEC3");
    const size_t view = add_view(std::as_bytes(std::span(vertices.indices)));
    Json primitives = Json::array();
    for (size_t g = 0; g < groups.looks.size(); ++g) {
      const size_t first = 3 * size_t{groups.begin[g]}, count = 3 * size_t{groups.begin[g + 1]} - first;
      primitives.push_back({{"attributes", attributes}, {"indices", accessors_.size()}, {"material", g}});
      accessors_.push_back({{"bufferView", view},
                            {"byteOffset", sizeof(uint32_t) * first},
                            {"componentType", kUint},
                            {"count", count},
                            {"type", "SCALAR"}});
    }
    json_["meshes"] = Json::array({{{"primitives", primitives}}});
  }

  /// All arrays have elements of whole multiples of four bytes, as glTF wants them.
  size_t add_view(std::span<const std::byte> bytes) {
    views_.push_back({{"buffer", 0}, {"byteOffset", buffer_bytes_}, {"byteLength", bytes.size()}});
    buffer_bytes_ += bytes.size();
    pieces_.push_back(bytes);
    return views_.size() - 1;
  }

  template <typename T>
  size_t add_vertices(const std::vector<T>& values, int component, const char* type) {
    static_assert(sizeof(T) % 4 == 0);
    const size_t view = add_view(std::as_bytes(std::span(values)));
    accessors_.push_back({{"bufferView", view}, {"componentType", component}, {"count", values.size()}, {"type", type}});
    return accessors_.size() - 1;
  }

  void name_extensions() {
    std::vector<std::string> used;
    for (const Json& material : json_["materials"]) {
      if (!material.contains("extensions")) continue;
      for (const auto& extension : material["extensions"].items()) {
        if (std::ranges::find(used, extension.key()) == used.end()) used.push_back(extension.key());
      }
    }
    if (!used.empty()) json_["extensionsUsed"] = used;
  }

  Json json_, accessors_ = Json::array(), views_ = Json::array();
  uint64_t buffer_bytes_ = 0;
  std::vector<std::span<const std::byte>> pieces_;
};

std::vector<std::string> notes_of(const LevelOfAsset& from, const MaterialGroups& groups) {
  std::vector<std::string> notes;
  if (groups.widest_step > 0) {
    notes.push_back(fmt::format("highlights, transmission and light of its faces are rounded to {} materials, {:.1f} % "
                                "of white apart at most; a .ply has them as they are",
                                groups.looks.size(), 100 * groups.widest_step));
  }
  if (!from.level.face_sggx.empty()) notes.push_back(kNormalsInRoughness);
  return notes;
}

}  // namespace

Result<WrittenSurface> write_glb(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job) {
  const LevelView& level = from.level;
  const std::vector<uvec3> corners = face_corners(level);
  const std::vector<FaceLook> looks = face_looks(level, corners);
  const MaterialGroups groups = group_materials(looks, {.by_diffuse = false, .by_opacity = false, .most_groups = 256});
  const Vertices vertices = make_vertices(level, looks, corners, groups);
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "export: cancelled");
  FARFIELD_TRY(GlbFile(from, vertices, groups).write(path));
  return WrittenSurface{corners.size(), vertices.positions.size(), groups.looks.size(), notes_of(from, groups)};
}

}  // namespace farfield
