// SPDX-License-Identifier: Apache-2.0
#include "bake_api/source_from_input.h"

#include <algorithm>
#include <map>

#include "bake_api/gather_materials.h"
#include "bake_api/gather_mesh.h"
#include "base/hash.h"

namespace farfield {
namespace {

/// Goes up when the same input comes to mean something else.
constexpr uint64_t kInputVersion = 1;

/// The hash of a sequence of things, in order. Arrays are hashed with their lengths, so that neighbours do not run into
/// each other.
class ContentHash {
 public:
  template <typename T>
  void add(const std::vector<T>& values) {
    hash_ = hash_values<T>(values, mix64(hash_, values.size()));
  }
  template <typename T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    hash_ = hash_values<T>({&value, 1}, hash_);
  }
  void add(const vec3& value) { hash_ = hash_values<float>({&value.x, 3}, hash_); }
  void add(const std::string& text) { hash_ = hash_values<char>(text, mix64(hash_, text.size())); }
  uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = kInputVersion;
};

/// By what it shows, not by what its file is called.
class TextureHashes {
 public:
  uint64_t of(const SourceTexture& texture) {
    if (!texture) return 0;
    uint64_t& hash = of_image_[texture.image.get()];
    if (hash == 0) {
      ContentHash content;
      content.add(texture.image->width());
      content.add(texture.image->level(0).texels);
      hash = content.value();
    }
    return mix64(mix64(hash, static_cast<uint64_t>(texture.wrap_u)), static_cast<uint64_t>(texture.wrap_v));
  }

 private:
  std::map<const Texture*, uint64_t> of_image_;
};

void add_material(const SourceMaterial& m, TextureHashes& textures, ContentHash& hash) {
  hash.add(m.name);
  for (const vec3& color : {m.base_color, m.dielectric_f0, m.diffuse_transmission_color, m.emission}) hash.add(color);
  for (const float factor : {m.alpha, m.metallic, m.roughness, m.diffuse_transmission, m.alpha_cutoff, m.normal_scale,
                             m.thin_transmission}) {
    hash.add(factor);
  }
  hash.add(m.alpha_mode);
  for (const SourceTexture* map : m.maps()) hash.add(textures.of(*map));
}

void add_heights(const SourceHeights& heights, ContentHash& hash) {
  hash.add(static_cast<bool>(heights));
  if (!heights) return;
  hash.add(heights.map->width());
  hash.add(heights.map->values());
  hash.add(heights.wrap_u);
  hash.add(heights.wrap_v);
  hash.add(heights.gain);
  hash.add(heights.base);
}

MaterialFunction one_by_one(const MaterialBatchFunction& batch) {
  return [batch](const MaterialQuery& query) {
    MaterialSample sample;
    batch(&query, &sample, 1);
    return sample;
  };
}

void add_cage(const CageTags& cage, ContentHash& hash) {
  hash.add(cage.crease_edges);
  hash.add(cage.crease_sharpness);
  hash.add(cage.sharp_vertices);
  hash.add(cage.vertex_sharpness);
}

uint64_t hash_of(const SourceMesh& mesh, const std::string& material_key) {
  ContentHash hash;
  hash.add(mesh.positions);
  hash.add(mesh.face_begin);
  hash.add(mesh.corner_position);
  hash.add(mesh.corner_uv);
  hash.add(mesh.corner_normal);
  hash.add(mesh.corner_color);
  hash.add(mesh.face_material);
  TextureHashes textures;
  for (const SourceMaterial& material : mesh.materials) add_material(material, textures, hash);
  hash.add(static_cast<bool>(mesh.material_function));
  hash.add(material_key);
  if (!mesh.cage.empty()) add_cage(mesh.cage, hash);
  for (const auto& scheme : mesh.face_scheme) hash.add(scheme ? 1 + static_cast<int>(*scheme) : 0);
  if (!mesh.heights.empty()) hash.add(mesh.face_height_scale);
  for (const SourceHeights& heights : mesh.heights) add_heights(heights, hash);
  return hash.value();
}

}  // namespace

Result<SourceMesh> source_from_input(const BakeInput& input, const Job& job) {
  FARFIELD_TRY_LET(SourceMesh mesh, gather_mesh(input, job));
  const uint32_t highest = *std::max_element(mesh.face_material.begin(), mesh.face_material.end());
  FARFIELD_TRY_LET(auto looks, with_warnings(gather_materials(input, size_t{highest} + 1), mesh.warnings));
  mesh.materials = std::move(looks.materials);
  mesh.heights = std::move(looks.heights);
  mesh.warnings.insert(mesh.warnings.end(), looks.warnings.begin(), looks.warnings.end());
  if (mesh.heights.empty()) mesh.face_height_scale.clear();
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
  mesh.material_batch = input.material_batch_function;
  mesh.material_function = mesh.material_batch ? one_by_one(mesh.material_batch) : input.material_function;
  mesh.source_hash = hash_of(mesh, input.material_key);
  return mesh;
}

}  // namespace farfield
