// SPDX-License-Identifier: Apache-2.0
// Meshes of glTF files, with their materials in the terms of SourceMaterial.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "base/hash.h"
#include "base/result.h"
#include "import/corner_normals.h"
#include "import/gltf_document.h"
#include "import/gltf_mesh_extras.h"
#include "import/gltf_nodes.h"
#include "import/read_formats.h"

namespace farfield {
namespace {

using tinygltf::Model;
using tinygltf::Value;

// Flattening multiplies: a small file with many nodes could ask for any number of triangles.
constexpr uint64_t kMaxTriangles = 100'000'000;

const Value* extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto found = extensions.find(name);
  return found == extensions.end() ? nullptr : &found->second;
}

float unit(double value) { return std::isfinite(value) ? static_cast<float>(std::clamp(value, 0.0, 1.0)) : 0.0f; }

Wrap to_wrap(int mode) {
  return mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? Wrap::Clamp
         : mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::Mirror
                                                         : Wrap::Repeat;
}

/// Which coordinates a texture uses and what happens to them first (KHR_texture_transform).
struct UvSource {
  int set = 0;
  glm::dvec2 offset{0.0}, scale{1.0};
  double rotation_rad = 0;

  friend bool operator==(const UvSource&, const UvSource&) = default;

  vec2 apply(double u, double v) const {
    const double c = std::cos(rotation_rad), s = std::sin(rotation_rad);
    const double x = u * scale.x, y = v * scale.y;
    return vec2(glm::dvec2(c * x + s * y, -s * x + c * y) + offset);
  }
};

UvSource uv_source(int texcoord, const tinygltf::ExtensionMap& extensions) {
  UvSource out;
  out.set = std::clamp(texcoord, 0, 99);
  const Value* transform = extension(extensions, "KHR_texture_transform");
  if (!transform || !transform->IsObject()) return out;
  const auto pair = [&](const char* key, glm::dvec2& value) {
    if (!transform->Has(key) || transform->Get(key).ArrayLen() != 2) return;
    for (int c = 0; c < 2; ++c) {
      const Value& number = transform->Get(key).Get(c);
      if (number.IsNumber() && std::isfinite(number.GetNumberAsDouble())) value[c] = number.GetNumberAsDouble();
    }
  };
  pair("offset", out.offset);
  pair("scale", out.scale);
  out.rotation_rad = extension_number(*transform, "rotation").value_or(0);
  if (const auto set = extension_number(*transform, "texCoord"))
    out.set = static_cast<int>(std::clamp(*set, 0.0, 99.0));
  return out;
}

/// Materials of the file, converted when a primitive first uses them.
class MaterialReader {
 public:
  MaterialReader(const GltfDocument& document, SourceMesh& mesh) : document_(document), mesh_(mesh) {}

  /// Index into mesh.materials. material -1: none.
  uint32_t find(int material) {
    const auto [found, is_new] = index_.try_emplace(material, static_cast<uint32_t>(mesh_.materials.size()));
    if (is_new) {
      mesh_.materials.emplace_back();
      uv_.emplace_back();
      if (material >= 0) convert(material, found->second);
    }
    return found->second;
  }
  const UvSource& uv(uint32_t index) const { return uv_[index]; }
  /// An error once an image was wanted and none can be read: no fault of the file, so no case for plain colours.
  const Result<void>& ready() const { return ready_; }

 private:
  void warn(std::string text) { mesh_.warnings.push_back(std::move(text)); }

  void convert(int index, uint32_t target) {
    const auto& source = document_.model.materials[static_cast<size_t>(index)];
    const auto& pbr = source.pbrMetallicRoughness;
    SourceMaterial out;
    out.name = source.name;
    out.base_color = vec3(1.0f);
    if (pbr.baseColorFactor.size() == 4) {
      for (int c = 0; c < 3; ++c) out.base_color[c] = unit(pbr.baseColorFactor[static_cast<size_t>(c)]);
      out.alpha = unit(pbr.baseColorFactor[3]);
    }
    out.metallic = unit(pbr.metallicFactor);
    out.roughness = unit(pbr.roughnessFactor);
    set_alpha_mode(source, out);
    set_specular(source, out);
    const Value* glossiness = extension(source.extensions, "KHR_materials_pbrSpecularGlossiness");
    if (glossiness && glossiness->IsObject()) set_specular_glossiness(source, *glossiness, out);
    set_transmission(source, out);
    if (glossiness && glossiness->IsObject())
      set_diffuse_texture(*glossiness, out, uv_[target]);
    else
      set_textures(source, out, uv_[target]);
    set_normals(source, out, uv_[target]);
    set_emission(source, out, uv_[target]);
    mesh_.materials[target] = std::move(out);
  }

  void set_alpha_mode(const tinygltf::Material& source, SourceMaterial& out) {
    if (source.alphaMode == "MASK") {
      out.alpha_mode = AlphaMode::Mask;
      out.alpha_cutoff = std::isfinite(source.alphaCutoff) ? static_cast<float>(source.alphaCutoff) : 0.5f;
    } else if (source.alphaMode == "BLEND") {
      out.alpha_mode = AlphaMode::Blend;
    }
  }

  /// F0 of the dielectric part: ((ior - 1) / (ior + 1))^2, 0.04 by default, times KHR_materials_specular.
  void set_specular(const tinygltf::Material& source, SourceMaterial& out) {
    double ior = 1.5;
    if (const Value* e = extension(source.extensions, "KHR_materials_ior"))
      ior = extension_number(*e, "ior").value_or(ior);
    // ior 0 is the extension's way to say "reflects everything"
    const double f0 = ior == 0 ? 1.0 : std::pow((ior - 1) / (ior + 1), 2.0);
    out.dielectric_f0 = vec3(unit(f0));
    if (const Value* e = extension(source.extensions, "KHR_materials_specular")) {
      const vec3 color = extension_vec3(*e, "specularColorFactor").value_or(vec3(1.0f));
      const float factor = unit(extension_number(*e, "specularFactor").value_or(1.0));
      out.dielectric_f0 = glm::clamp(out.dielectric_f0 * color, vec3(0.0f), vec3(1.0f)) * factor;
      if (e->Has("specularTexture") || e->Has("specularColorTexture")) {
        warn(fmt::format("material {}: specular textures are ignored", source.name));
      }
    }
    if (extension(source.extensions, "KHR_materials_unlit")) {
      out.dielectric_f0 = vec3(0.0f);
      out.metallic = 0;
      warn(fmt::format("material {}: unlit is shown as diffuse", source.name));
    }
  }

  /// What the older workflow says, instead of metallic-roughness: no metal, F0 as given, roughness 1 - glossiness.
  void set_specular_glossiness(const tinygltf::Material& source, const Value& e, SourceMaterial& out) {
    out.base_color = vec3(1.0f);
    out.alpha = 1;
    if (e.Has("diffuseFactor") && e.Get("diffuseFactor").ArrayLen() == 4) {
      const Value& factor = e.Get("diffuseFactor");
      const auto number = [&](int c) { return factor.Get(c).IsNumber() ? factor.Get(c).GetNumberAsDouble() : 1.0; };
      for (int c = 0; c < 3; ++c) out.base_color[c] = unit(number(c));
      out.alpha = unit(number(3));
    }
    out.metallic = 0;
    out.dielectric_f0 = glm::clamp(extension_vec3(e, "specularFactor").value_or(vec3(1.0f)), vec3(0.0f), vec3(1.0f));
    out.roughness = 1 - unit(extension_number(e, "glossinessFactor").value_or(1.0));
    if (e.Has("specularGlossinessTexture")) {
      warn(fmt::format("material {}: the texture of specular and glossiness is ignored", source.name));
    }
  }

  /// The diffuse texture of specular-glossiness. tinygltf knows no texture there: its index is checked here.
  void set_diffuse_texture(const Value& e, SourceMaterial& out, UvSource& uv) {
    if (!e.Has("diffuseTexture")) return;
    const Value& info = e.Get("diffuseTexture");
    const double index = extension_number(info, "index").value_or(-1);
    if (!(index >= 0 && index < static_cast<double>(document_.model.textures.size()))) {
      warn(fmt::format("diffuse texture {}: there is no such texture; the plain colour is used", index));
      return;
    }
    tinygltf::ExtensionMap extensions;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
      extensions["KHR_texture_transform"] = info.Get("extensions").Get("KHR_texture_transform");
    }
    const double set = std::clamp(extension_number(info, "texCoord").value_or(0), 0.0, 99.0);
    uv = uv_source(static_cast<int>(set), extensions);
    out.base_color_map = texture(static_cast<int>(index),
                                 out.alpha_mode != AlphaMode::Opaque ? TextureUse::ColorWithAlpha : TextureUse::Color);
  }

  void set_transmission(const tinygltf::Material& source, SourceMaterial& out) {
    if (const Value* e = extension(source.extensions, "KHR_materials_transmission")) {
      out.thin_transmission = unit(extension_number(*e, "transmissionFactor").value_or(0.0));
      if (e->Has("transmissionTexture")) {
        warn(fmt::format("material {}: the texture of its transmission is ignored", source.name));
      }
    }
    for (const char* ignored :
         {"KHR_materials_clearcoat", "KHR_materials_sheen", "KHR_materials_anisotropy", "KHR_materials_volume"}) {
      if (extension(source.extensions, ignored)) warn(fmt::format("material {}: {} is ignored", source.name, ignored));
    }
    const Value* e = extension(source.extensions, "KHR_materials_diffuse_transmission");
    if (!e) return;
    out.diffuse_transmission = unit(extension_number(*e, "diffuseTransmissionFactor").value_or(0.0));
    const vec3 color = extension_vec3(*e, "diffuseTransmissionColorFactor").value_or(vec3(1.0f));
    out.diffuse_transmission_color = glm::clamp(color, vec3(0.0f), vec3(1.0f));
    if (e->Has("diffuseTransmissionTexture") || e->Has("diffuseTransmissionColorTexture")) {
      warn(fmt::format("material {}: diffuse transmission textures are ignored", source.name));
    }
  }

  void set_textures(const tinygltf::Material& source, SourceMaterial& out, UvSource& uv) {
    const auto& pbr = source.pbrMetallicRoughness;
    const auto& color = pbr.baseColorTexture;
    const auto& rough = pbr.metallicRoughnessTexture;
    if (color.index >= 0) {
      uv = uv_source(color.texCoord, color.extensions);
      out.base_color_map =
          texture(color.index, out.alpha_mode != AlphaMode::Opaque ? TextureUse::ColorWithAlpha : TextureUse::Color);
    }
    if (rough.index < 0) return;
    out.metallic_roughness_map = texture(rough.index, TextureUse::Data);
    if (!out.metallic_roughness_map || shares_uv(out, uv, uv_source(rough.texCoord, rough.extensions))) return;
    const vec4 mean = out.metallic_roughness_map.image->mean();
    out.roughness *= mean.y;
    out.metallic *= mean.z;
    out.metallic_roughness_map = {};
    warn(fmt::format("material {}: roughness has texture coordinates of its own; its mean is used", source.name));
  }

  void set_normals(const tinygltf::Material& source, SourceMaterial& out, UvSource& uv) {
    const auto& map = source.normalTexture;
    if (map.index < 0) return;
    out.normal_map = texture(map.index, TextureUse::Data);
    out.normal_scale = std::isfinite(map.scale) ? static_cast<float>(std::clamp(map.scale, -100.0, 100.0)) : 1.0f;
    if (!out.normal_map || shares_uv(out, uv, uv_source(map.texCoord, map.extensions))) return;
    out.normal_map = {};
    warn(fmt::format("material {}: its normal map has texture coordinates of its own; it is ignored", source.name));
  }

  void set_emission(const tinygltf::Material& source, SourceMaterial& out, UvSource& uv) {
    constexpr double kBrightestGlow = 1e9;
    double strength = 1;
    if (const Value* e = extension(source.extensions, "KHR_materials_emissive_strength")) {
      strength = std::clamp(extension_number(*e, "emissiveStrength").value_or(1.0), 0.0, kBrightestGlow);
    }
    for (size_t c = 0; c < std::min<size_t>(source.emissiveFactor.size(), 3); ++c) {
      out.emission[static_cast<int>(c)] = unit(source.emissiveFactor[c]) * static_cast<float>(strength);
    }
    const auto& map = source.emissiveTexture;
    if (map.index < 0 || out.emission == vec3(0.0f)) return;
    out.emission_map = texture(map.index, TextureUse::Color);
    if (!out.emission_map || shares_uv(out, uv, uv_source(map.texCoord, map.extensions))) return;
    out.emission *= vec3(out.emission_map.image->mean());
    out.emission_map = {};
    warn(fmt::format("material {}: emission has texture coordinates of its own; its mean is used", source.name));
  }

  /// Whether a map that was just read can go by the coordinates of those before it: one set per corner is kept.
  static bool shares_uv(const SourceMaterial& material, UvSource& uv, const UvSource& wanted) {
    const auto maps = material.maps();
    if (std::ranges::count_if(maps, [](const SourceTexture* map) { return bool(*map); }) == 1) uv = wanted;
    return uv == wanted;
  }

  /// Null, with a warning, when the image cannot be had: the factors then stand alone.
  SourceTexture texture(int index, TextureUse use) {
    SourceTexture out = found_texture(index, use);
    out.is_missing = !out;
    return out;
  }

  SourceTexture found_texture(int index, TextureUse use) {
    const auto& source = document_.model.textures[static_cast<size_t>(index)];
    SourceTexture out;
    if (source.sampler >= 0) {
      const auto& sampler = document_.model.samplers[static_cast<size_t>(source.sampler)];
      out.wrap_u = to_wrap(sampler.wrapS);
      out.wrap_v = to_wrap(sampler.wrapT);
    }
    const int image_index = image_of(source);
    if (image_index < 0) {
      warn(fmt::format("texture {}: no image that this version reads; the plain colour is used", index));
      return out;
    }
    const auto key = std::make_pair(image_index, use);
    const auto found = images_.find(key);
    if (found != images_.end()) {
      out.image = found->second;
      return out;
    }
    out.image = image(image_index, use);
    images_.emplace(key, out.image);
    return out;
  }

  std::shared_ptr<const Texture> image(int index, TextureUse use) {
    const auto bytes = image_bytes(document_, index);
    if (!bytes) return without_image(bytes.error());
    auto decoded = decode_texture(*bytes, fmt::format("{}: image {}", document_.name, index), use);
    if (decoded) return std::make_shared<const Texture>(std::move(*decoded));
    if (decoded.error().code == ErrorCode::Io) {
      ready_ = tl::unexpected(decoded.error());
      return nullptr;
    }
    return without_image(decoded.error());
  }

  std::shared_ptr<const Texture> without_image(const Error& why) {
    warn(fmt::format("{}; the plain colour is used", why.message));
    return nullptr;
  }

  const GltfDocument& document_;
  SourceMesh& mesh_;
  std::map<int, uint32_t> index_;
  std::vector<UvSource> uv_;  ///< per material of the mesh
  std::map<std::pair<int, TextureUse>, std::shared_ptr<const Texture>> images_;
  Result<void> ready_;
};

/// The corner triples of a primitive, whatever its mode.
std::vector<uvec3> to_triangles(const std::vector<uint32_t>& indices, int mode) {
  std::vector<uvec3> out;
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    for (size_t i = 0; i + 2 < indices.size(); i += 3) out.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
  } else {
    for (size_t i = 0; i + 2 < indices.size(); ++i) {
      const bool is_fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
      const size_t swap = !is_fan && i % 2 == 1 ? 1 : 0;
      out.emplace_back(is_fan ? indices[0] : indices[i], indices[i + 1 + swap], indices[i + 2 - swap]);
    }
  }
  return out;
}

class GltfMeshReader {
 public:
  explicit GltfMeshReader(const GltfDocument& document)
      : document_(document), model_(document.model), materials_(document, mesh_) {}

  Result<SourceMesh> read(int mesh, int node) {
    mesh_.warnings = document_.warnings;
    return with_warnings(read_all(mesh, node), mesh_.warnings);
  }

 private:
  static vec2 no_uv() { return vec2(std::numeric_limits<float>::quiet_NaN()); }

  Result<SourceMesh> read_all(int mesh, int node) {
    FARFIELD_TRY(mesh >= 0 ? read_one(mesh) : node >= 0 ? read_below(node) : read_scene());
    FARFIELD_TRY(materials_.ready());
    if (!mesh_.corner_uv.empty()) mesh_.corner_uv.resize(mesh_.corner_count(), no_uv());
    if (!mesh_.corner_color.empty()) mesh_.corner_color.resize(mesh_.corner_count(), vec4(1.0f));
    if (!mesh_.corner_normal.empty()) mesh_.corner_normal.resize(mesh_.corner_count(), vec3(0.0f));
    mesh_.source_files = document_.files_read();
    mesh_.is_split = true;
    if (std::ranges::none_of(mesh_.face_scheme, [](const auto& scheme) { return scheme.has_value(); })) {
      mesh_.face_scheme.clear();
    }
    return std::move(mesh_);
  }

  Result<void> read_one(int mesh) {
    if (mesh >= static_cast<int>(model_.meshes.size())) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("{}: there is no mesh {}, only {}", document_.name, mesh, model_.meshes.size()));
    }
    return add_mesh(mesh, glm::dmat4(1.0));
  }

  Result<void> read_scene() {
    if (model_.nodes.empty()) {  // a library of meshes
      for (size_t m = 0; m < model_.meshes.size(); ++m) {
        if (auto done = add_mesh(static_cast<int>(m), glm::dmat4(1.0)); !done) return done;
      }
      return {};
    }
    const std::vector<int> order = scene_nodes(document_);
    return read_nodes(order, world_matrices(order, parents(model_)));
  }

  /// A node's own transform is that of its instances, not its own.
  Result<void> read_below(int root) {
    if (root >= static_cast<int>(model_.nodes.size())) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("{}: there is no node {}, only {}", document_.name, root, model_.nodes.size()));
    }
    const std::vector<int> order = nodes_below(model_, root);
    return read_nodes(order, world_matrices({order.begin() + 1, order.end()}, parents(model_)));
  }

  Result<void> read_nodes(const std::vector<int>& order, const std::vector<glm::dmat4>& world) {
    const std::vector<bool> hidden = hidden_nodes(document_);
    for (const int n : order) {
      const auto& node = model_.nodes[static_cast<size_t>(n)];
      if (node.mesh < 0 || hidden[static_cast<size_t>(n)]) continue;
      FARFIELD_TRY_LET(const auto place, node.skin >= 0 ? skeleton_place(n, world) : world[static_cast<size_t>(n)]);
      FARFIELD_TRY(add_node(n, place));
    }
    return {};
  }

  /// Of the nodes in `order`, parents first; all others stand at the origin.
  std::vector<glm::dmat4> world_matrices(const std::vector<int>& order, const std::vector<int>& parent) const {
    std::vector<glm::dmat4> world(model_.nodes.size(), glm::dmat4(1.0));
    for (const int n : order) {
      const auto at = static_cast<size_t>(n);
      world[at] = to_matrix(transform_of(model_.nodes[at]));
      if (parent[at] >= 0) world[at] = world[static_cast<size_t>(parent[at])] * world[at];
    }
    return world;
  }

  Result<glm::dmat4> skeleton_place(int n, const std::vector<glm::dmat4>& world) {
    const auto& node = model_.nodes[static_cast<size_t>(n)];
    FARFIELD_TRY_LET(const auto place, skin_place(document_, node));
    mesh_.warnings.push_back(fmt::format("node {} ({}): {}", n, node.name, place ? kSkinned : kBrokenSkin));
    return place ? world[static_cast<size_t>(place->joint)] * place->in_joint : world[static_cast<size_t>(n)];
  }

  /// All instances of a node's mesh.
  Result<void> add_node(int n, const glm::dmat4& place) {
    const auto& node = model_.nodes[static_cast<size_t>(n)];
    FARFIELD_TRY_LET(const auto instances, instance_transforms(document_, node));
    size_t singular = 0;
    for (const glm::dmat4& instance : instances) {
      const glm::dmat4 to_world = place * instance;
      if (!is_invertible(to_world)) {
        ++singular;
      } else if (auto done = add_mesh(node.mesh, to_world); !done) {
        return done;
      }
    }
    if (singular > 0) {
      mesh_.warnings.push_back(fmt::format("node {} ({}): its transform is singular; left out", n, node.name));
    }
    if (has_weights_of_its_own(document_, node)) {
      mesh_.warnings.push_back(fmt::format("node {} ({}): {}", n, node.name, kOwnWeights));
    }
    return {};
  }

  Result<void> add_mesh(int index, const glm::dmat4& to_world) {
    const auto& mesh = model_.meshes[static_cast<size_t>(index)];
    const auto scheme = scheme_of_extras(mesh);
    if (!scheme) return document_.bad(fmt::format("mesh {}: {}", index, scheme.error().message));
    const size_t first_face = mesh_.face_count();
    for (size_t p = 0; p < mesh.primitives.size(); ++p) {
      const auto place = fmt::format("mesh {} primitive {}", index, p);
      if (auto done = add_primitive(mesh.primitives[p], mesh.weights, to_world, place); !done) return done;
      mesh_.face_scheme.resize(mesh_.face_count(), *scheme);
    }
    mesh_.placements.push_back(
        {static_cast<uint32_t>(index), first_face, mesh_.face_count() - first_face, glm::dmat4x3(to_world)});
    return {};
  }

  /// The vertex of each corner, three per triangle. Errors: an index past the last vertex.
  Result<std::vector<uvec3>> triangles_of(const tinygltf::Primitive& primitive, size_t vertex_count, int mode,
                                          const std::string& place) {
    std::vector<uint32_t> indices;
    if (primitive.indices >= 0) {
      FARFIELD_TRY_LET(auto read, read_indices(document_, primitive.indices));
      indices = std::move(read);
      for (const uint32_t index : indices) {
        if (index >= vertex_count) {
          return document_.bad(fmt::format("{}: vertex index {}, there are {} vertices", place, index, vertex_count));
        }
      }
    } else {
      indices.resize(vertex_count);
      for (size_t i = 0; i < vertex_count; ++i) indices[i] = static_cast<uint32_t>(i);
    }
    if (mode == TINYGLTF_MODE_TRIANGLES && indices.size() % 3 != 0) {
      mesh_.warnings.push_back(fmt::format("{}: {} corners are no whole number of triangles", place, indices.size()));
    }
    return to_triangles(indices, mode);
  }

  /// Adds what the mesh's weights take of the morph targets to positions or normals.
  Result<void> add_morphs(const tinygltf::Primitive& primitive, const std::vector<double>& weights,
                          const char* attribute, std::vector<double>& values) {
    for (size_t t = 0; t < std::min(weights.size(), primitive.targets.size()); ++t) {
      const auto found = primitive.targets[t].find(attribute);
      if (weights[t] == 0 || found == primitive.targets[t].end() || found->second < 0) continue;
      FARFIELD_TRY_LET(const auto offsets, read_accessor(document_, found->second, 3));
      for (size_t i = 0; i < std::min(values.size(), offsets.size()); ++i) values[i] += weights[t] * offsets[i];
    }
    return {};
  }

  /// Lines and points have no surface. Said once per mesh, however often it stands in the scene.
  void warn_of_lines(const std::string& place) {
    if (said_.insert(place).second)
      mesh_.warnings.push_back(place + ": points or lines; they have no surface, left out");
  }

  Result<void> add_primitive(const tinygltf::Primitive& primitive, const std::vector<double>& weights,
                             const glm::dmat4& to_world, const std::string& place) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    const auto position = primitive.attributes.find("POSITION");
    if (mode < TINYGLTF_MODE_TRIANGLES) return warn_of_lines(place), Result<void>();
    if (position == primitive.attributes.end()) return {};
    if (mode > TINYGLTF_MODE_TRIANGLE_FAN) return document_.bad(fmt::format("{}: unknown mode {}", place, mode));

    const auto& accessor = model_.accessors[static_cast<size_t>(position->second)];
    if (accessor.bufferView < 0 && !accessor.sparse.isSparse) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{}: {}: positions are compressed (Draco or meshopt); export without compression",
                                    document_.name, place));
    }
    FARFIELD_TRY_LET(auto points, read_accessor(document_, position->second, 3));
    FARFIELD_TRY(add_morphs(primitive, weights, "POSITION", points));
    const size_t vertex_count = points.size() / 3;
    FARFIELD_TRY_LET(const auto triangles, triangles_of(primitive, vertex_count, mode, place));
    if (mesh_.face_count() + triangles.size() > kMaxTriangles) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{}: more than {} triangles with all instances; take its meshes one by one",
                                    document_.name, kMaxTriangles));
    }

    const auto base = static_cast<uint32_t>(mesh_.positions.size());
    for (size_t v = 0; v < vertex_count; ++v) {
      const glm::dvec4 p(points[3 * v], points[3 * v + 1], points[3 * v + 2], 1);
      mesh_.positions.emplace_back(to_world * p);
    }
    const uint32_t material = materials_.find(primitive.material);
    const size_t first_corner = mesh_.corner_count();
    for (const uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) mesh_.corner_position.push_back(base + t[k]);
      mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
      mesh_.face_material.push_back(material);
    }
    FARFIELD_TRY(add_normals(primitive, weights, triangles, to_world, vertex_count, first_corner, place));
    FARFIELD_TRY(add_uvs(primitive, triangles, material, vertex_count, first_corner, place));
    return add_colors(primitive, triangles, vertex_count, first_corner, place);
  }

  Result<void> add_normals(const tinygltf::Primitive& primitive, const std::vector<double>& weights,
                           const std::vector<uvec3>& triangles, const glm::dmat4& to_world, size_t vertex_count,
                           size_t first_corner, const std::string& place) {
    const auto attribute = primitive.attributes.find("NORMAL");
    if (attribute == primitive.attributes.end()) return {};
    FARFIELD_TRY_LET(auto values, read_accessor(document_, attribute->second, 3));
    FARFIELD_TRY(add_morphs(primitive, weights, "NORMAL", values));
    if (values.size() / 3 < vertex_count) return document_.bad(place + ": fewer normals than vertices");
    // Normals go with the inverse transpose; its length does not matter, and surfaces have two sides.
    const glm::dmat3 normal_to_world = glm::transpose(glm::inverse(glm::dmat3(to_world)));
    mesh_.corner_normal.resize(first_corner, vec3(0.0f));
    for (const uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) {
        const double* n = &values[3 * size_t{t[k]}];
        mesh_.corner_normal.push_back(unit_normal(normal_to_world * dvec3(n[0], n[1], n[2])));
      }
    }
    return {};
  }

  Result<void> add_uvs(const tinygltf::Primitive& primitive, const std::vector<uvec3>& triangles, uint32_t material,
                       size_t vertex_count, size_t first_corner, const std::string& place) {
    const SourceMaterial& m = mesh_.materials[material];
    if (std::ranges::none_of(m.maps(), [](const SourceTexture* map) { return bool(*map); })) return {};
    const UvSource& source = materials_.uv(material);
    const auto attribute = primitive.attributes.find(fmt::format("TEXCOORD_{}", source.set));
    if (attribute == primitive.attributes.end()) {
      mesh_.warnings.push_back(fmt::format("{}: textured, but without texture coordinates; the mean is used", place));
      return {};
    }
    FARFIELD_TRY_LET(const auto values, read_accessor(document_, attribute->second, 2));
    if (values.size() / 2 < vertex_count) return document_.bad(place + ": fewer texture coordinates than vertices");
    mesh_.corner_uv.resize(first_corner, no_uv());
    for (const uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) mesh_.corner_uv.push_back(source.apply(values[2 * t[k]], values[2 * t[k] + 1]));
    }
    return {};
  }

  /// COLOR_0: linear, RGB or RGBA; multiplies the base colour.
  Result<void> add_colors(const tinygltf::Primitive& primitive, const std::vector<uvec3>& triangles,
                          size_t vertex_count, size_t first_corner, const std::string& place) {
    const auto attribute = primitive.attributes.find("COLOR_0");
    if (attribute == primitive.attributes.end()) return {};
    const int components = component_count(document_, attribute->second);
    if (components != 3 && components != 4) return document_.bad(place + ": COLOR_0 is neither RGB nor RGBA");
    FARFIELD_TRY_LET(const auto values, read_accessor(document_, attribute->second, components));
    if (values.size() / static_cast<size_t>(components) < vertex_count) {
      return document_.bad(place + ": fewer colours than vertices");
    }
    mesh_.corner_color.resize(first_corner, vec4(1.0f));
    for (const uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) {
        vec4 color(1.0f);
        for (int c = 0; c < components; ++c) {
          color[c] = unit(values[static_cast<size_t>(components) * t[k] + static_cast<size_t>(c)]);
        }
        mesh_.corner_color.push_back(color);
      }
    }
    return {};
  }

  const GltfDocument& document_;
  const Model& model_;
  SourceMesh mesh_;
  MaterialReader materials_;
  std::set<std::string> said_;  ///< places
};

}  // namespace

Result<SourceMesh> read_gltf(std::span<const unsigned char> bytes, const std::filesystem::path& path, int mesh,
                             int node) {
  FARFIELD_TRY_LET(const auto document, open_gltf(bytes, path));
  return GltfMeshReader(document).read(mesh, node);
}

}  // namespace farfield
