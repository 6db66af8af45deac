// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "base/hash.h"
#include "base/json_words.h"
#include "base/result.h"
#include "import/gltf_json.h"
#include "import/read_file.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using tinygltf::Model;

// What a file may require. The rest changes geometry or looks in ways that we would get wrong.
constexpr std::string_view kKnownExtensions[] = {"EXT_mesh_gpu_instancing",
                                                 "EXT_texture_webp",
                                                 "KHR_lights_punctual",
                                                 "KHR_materials_diffuse_transmission",
                                                 "KHR_materials_emissive_strength",
                                                 "KHR_materials_ior",
                                                 "KHR_materials_pbrSpecularGlossiness",
                                                 "KHR_materials_specular",
                                                 "KHR_materials_transmission",
                                                 "KHR_materials_unlit",
                                                 "KHR_mesh_quantization",
                                                 "KHR_node_visibility",
                                                 "KHR_texture_transform"};

/// File access for tinygltf: only regular files in or relative to the document's folder, with our size limit, hashed.
struct FileAccess {
  std::string folder;
  std::vector<HashedFile> files;

  void note(const std::string& path, uint64_t hash) {
    files.push_back({fs::path(path).lexically_relative(folder).generic_string(), hash});
  }
};

bool file_exists(const std::string& path, void* user) {
  // tinygltf also looks into the working directory ("./NAME"); what a file means must not depend on that.
  auto& access = *static_cast<FileAccess*>(user);
  if (!path.starts_with(access.folder)) return false;
  std::error_code failure;
  const bool exists = fs::is_regular_file(path, failure);
  if (!exists) access.note(path, 0);
  return exists;
}

bool read_whole_file(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
  auto bytes = read_file(path);
  if (!bytes) {
    if (error) *error += bytes.error().message;
    return false;
  }
  auto& access = *static_cast<FileAccess*>(user);
  access.note(path, hash_values<unsigned char>(*bytes));
  *out = std::move(*bytes);
  return true;
}

/// Keeps an image encoded. tinygltf hands over bytes of a buffer view without having checked its range: those are
/// fetched later, with checks.
bool keep_encoded(tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
                  int size, void*) {
  if (image->bufferView < 0) image->image.assign(bytes, bytes + size);
  return true;
}

std::string first_line(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  return line.empty() ? "not a glTF file" : line;
}

/// Names the compression that a file says it uses, or "". Such a file need not require it, and still not parse without.
std::string used_compression(const Model& model) {
  for (const std::string& name : model.extensionsUsed) {
    if (name.find("compression") != std::string::npos) return name;
  }
  return "";
}

/// Extensions of materials that the mesh reader warns about, each with the material's name.
constexpr std::string_view kNamedByMaterials[] = {"KHR_materials_clearcoat", "KHR_materials_sheen",
                                                  "KHR_materials_anisotropy", "KHR_materials_volume"};

/// A line for each extension that is used, not required, and not read.
std::vector<std::string> warn_of_unknown_extensions(const Model& model) {
  const auto has = [](const auto& names, const std::string& name) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
  };
  std::vector<std::string> warnings;
  for (const std::string& name : std::set<std::string>(model.extensionsUsed.begin(), model.extensionsUsed.end())) {
    if (has(kKnownExtensions, name) || has(kNamedByMaterials, name)) continue;
    warnings.push_back(fmt::format("extension {} is not read; what it adds is ignored", name));
  }
  return warnings;
}

/// Names all required extensions that we do not know, or "".
std::string unknown_extensions(const Model& model) {
  std::string names;
  for (const std::string& name : model.extensionsRequired) {
    if (std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), name) != std::end(kKnownExtensions))
      continue;
    names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

Result<void> check_meshes(const GltfDocument& document) {
  const Model& model = document.model;
  for (size_t m = 0; m < model.meshes.size(); ++m) {
    for (size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
      const auto& primitive = model.meshes[m].primitives[p];
      const auto place = fmt::format("mesh {} primitive {}", m, p);
      if (!is_index(primitive.indices, model.accessors)) return document.bad(place + ": no such index accessor");
      if (!is_index(primitive.material, model.materials)) return document.bad(place + ": no such material");
      for (const auto& [name, accessor] : primitive.attributes) {
        if (accessor < 0 || !is_index(accessor, model.accessors)) {
          return document.bad(fmt::format("{}: no such accessor for {}", place, name));
        }
      }
      for (const auto& target : primitive.targets) {
        for (const auto& [name, accessor] : target) {
          if (!is_index(accessor, model.accessors)) {
            return document.bad(fmt::format("{}: no such accessor for the morph target of {}", place, name));
          }
        }
      }
    }
  }
  return {};
}

Result<void> check_textures(const GltfDocument& document) {
  const Model& model = document.model;
  for (size_t t = 0; t < model.textures.size(); ++t) {
    if (!is_index(image_of(model.textures[t]), model.images) || !is_index(model.textures[t].sampler, model.samplers)) {
      return document.bad(fmt::format("texture {}: no such image or sampler", t));
    }
  }
  for (size_t m = 0; m < model.materials.size(); ++m) {
    const auto& material = model.materials[m];
    const auto& pbr = material.pbrMetallicRoughness;
    if (!is_index(pbr.baseColorTexture.index, model.textures) ||
        !is_index(pbr.metallicRoughnessTexture.index, model.textures) ||
        !is_index(material.normalTexture.index, model.textures) ||
        !is_index(material.emissiveTexture.index, model.textures)) {
      return document.bad(fmt::format("material {}: no such texture", m));
    }
  }
  return {};
}

Result<void> check_skins(const GltfDocument& document) {
  const Model& model = document.model;
  for (size_t s = 0; s < model.skins.size(); ++s) {
    const auto& skin = model.skins[s];
    const auto is_node = [&](int n) { return n >= 0 && is_index(n, model.nodes); };
    if (!is_index(skin.inverseBindMatrices, model.accessors) || skin.joints.empty() ||
        !std::all_of(skin.joints.begin(), skin.joints.end(), is_node)) {
      return document.bad(fmt::format("skin {}: no joints, or no such node or accessor", s));
    }
  }
  return {};
}

/// Every node has at most one parent and no node is its own ancestor (glTF 2.0, 3.5.2): so walks end.
Result<void> check_nodes(const GltfDocument& document) {
  const Model& model = document.model;
  const int count = static_cast<int>(model.nodes.size());
  std::vector<int> parent(model.nodes.size(), -1);
  for (int n = 0; n < count; ++n) {
    const auto& node = model.nodes[static_cast<size_t>(n)];
    if (!is_index(node.mesh, model.meshes) || !is_index(node.camera, model.cameras) ||
        !is_index(node.skin, model.skins)) {
      return document.bad(fmt::format("node {}: no such mesh, camera or skin", n));
    }
    for (const int child : node.children) {
      if (child < 0 || child >= count) return document.bad(fmt::format("node {}: no such child {}", n, child));
      if (parent[static_cast<size_t>(child)] >= 0) return document.bad(fmt::format("node {} has two parents", child));
      parent[static_cast<size_t>(child)] = n;
    }
  }
  // With one parent each, a cycle is what no root leads to.
  std::vector<int> stack;
  for (int n = 0; n < count; ++n) {
    if (parent[static_cast<size_t>(n)] < 0) stack.push_back(n);
  }
  size_t reached = 0;
  while (!stack.empty()) {
    const int n = stack.back();
    stack.pop_back();
    ++reached;
    const auto& children = model.nodes[static_cast<size_t>(n)].children;
    stack.insert(stack.end(), children.begin(), children.end());
  }
  if (reached != model.nodes.size()) return document.bad("nodes form a cycle: a node is its own ancestor");
  for (size_t s = 0; s < model.scenes.size(); ++s) {
    for (const int n : model.scenes[s].nodes) {
      if (n < 0 || n >= count) return document.bad(fmt::format("scene {}: no such node {}", s, n));
      if (parent[static_cast<size_t>(n)] >= 0) return document.bad(fmt::format("scene {}: node {} is no root", s, n));
    }
  }
  return {};
}

/// A range of `count` elements of `element` bytes each, `stride` apart, inside a buffer view.
struct ByteRange {
  const unsigned char* data = nullptr;
  size_t stride = 0;
};

Result<ByteRange> byte_range(const GltfDocument& document, int view_index, uint64_t offset, uint64_t count,
                             uint64_t element, const std::string& place) {
  const Model& model = document.model;
  if (view_index < 0 || !is_index(view_index, model.bufferViews)) return document.bad(place + ": no such buffer view");
  const auto& view = model.bufferViews[static_cast<size_t>(view_index)];
  if (view.buffer < 0 || !is_index(view.buffer, model.buffers)) return document.bad(place + ": no such buffer");
  FARFIELD_TRY_LET(const auto buffer, document.buffer_bytes(static_cast<size_t>(view.buffer)));
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
    return document.bad(
        fmt::format("{}: buffer view {} reaches past its buffer of {} bytes", place, view_index, buffer.size()));
  }
  const uint64_t stride = view.byteStride == 0 ? element : view.byteStride;
  // Bounding the factors first keeps the product from wrapping around.
  const bool fits =
      count == 0 || (element > 0 && offset <= view.byteLength && stride >= 1 && count - 1 <= view.byteLength / stride &&
                     (count - 1) * stride + element <= view.byteLength - offset);
  if (!fits) {
    return document.bad(fmt::format("{}: {} elements reach past buffer view {} of {} bytes", place, count, view_index,
                                    view.byteLength));
  }
  return ByteRange{buffer.data() + view.byteOffset + (count == 0 ? 0 : offset), stride};
}

double decode(const unsigned char* raw, int component_type, bool normalized) {
  const auto as = [raw](auto v) {
    std::memcpy(&v, raw, sizeof v);
    return v;
  };
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return normalized ? std::max(as(int8_t{}) / 127.0, -1.0) : as(int8_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return as(uint8_t{}) / (normalized ? 255.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return normalized ? std::max(as(int16_t{}) / 32767.0, -1.0) : as(int16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return as(uint16_t{}) / (normalized ? 65535.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_INT:
      return as(int32_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return as(uint32_t{});
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return static_cast<double>(as(float{}));
    default:
      return as(double{});
  }
}

/// Overwrites the sparse elements (glTF 2.0, 3.6.2.3).
Result<void> apply_sparse(const GltfDocument& document, const tinygltf::Accessor& accessor, const std::string& place,
                          int components, size_t component_bytes, std::vector<double>& values) {
  const auto& sparse = accessor.sparse;
  if (sparse.count < 0 || static_cast<uint64_t>(sparse.count) > accessor.count || sparse.indices.byteOffset < 0 ||
      sparse.values.byteOffset < 0) {
    return document.bad(place + ": bad sparse count or offset");
  }
  const int index_bytes = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(sparse.indices.componentType));
  if (index_bytes <= 0) return document.bad(place + ": bad sparse index type");
  const auto count = static_cast<uint64_t>(sparse.count);
  FARFIELD_TRY_LET(const auto indices,
                   byte_range(document, sparse.indices.bufferView, static_cast<uint64_t>(sparse.indices.byteOffset),
                              count, static_cast<uint64_t>(index_bytes), place));
  FARFIELD_TRY_LET(const auto replaced,
                   byte_range(document, sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset),
                              count, component_bytes * static_cast<size_t>(components), place));
  for (uint64_t i = 0; i < count; ++i) {
    // Sparse index and value arrays are always tightly packed.
    const double target =
        decode(indices.data + i * static_cast<uint64_t>(index_bytes), sparse.indices.componentType, false);
    if (!(target >= 0) || target >= static_cast<double>(accessor.count)) {
      return document.bad(fmt::format("{}: sparse index {} of {} elements", place, target, accessor.count));
    }
    for (int c = 0; c < components; ++c) {
      const size_t at = static_cast<size_t>(i) * static_cast<size_t>(components) + static_cast<size_t>(c);
      values[static_cast<size_t>(target) * static_cast<size_t>(components) + static_cast<size_t>(c)] =
          decode(replaced.data + at * component_bytes, accessor.componentType, accessor.normalized);
    }
  }
  return {};
}

uint64_t total_buffer_bytes(const GltfDocument& document) {
  uint64_t bytes = document.buffer_files->total_bytes();
  for (const auto& buffer : document.model.buffers) bytes += buffer.data.size();
  return bytes;
}

/// The text for tinygltf, which would read all buffers: those in files of their own are taken out. What cannot be
/// parsed stays as it is, for tinygltf to say why.
Result<std::string> text_without_buffer_files(std::span<const unsigned char> bytes, const fs::path& path,
                                              GltfBufferFiles& files) {
  const auto as_it_is = [&] { return std::string(bytes.begin(), bytes.end()); };
  auto json = parse_json(bytes);
  if (!json) return as_it_is();
  FARFIELD_TRY_LET(files, GltfBufferFiles::take_from(*json, path));
  return files.empty() ? as_it_is() : json->dump();
}

}  // namespace

tl::unexpected<Error> GltfDocument::bad(const std::string& what) const {
  return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, what));
}

Result<std::span<const unsigned char>> GltfDocument::buffer_bytes(size_t buffer) const {
  if (buffer_files->has(buffer)) return buffer_files->bytes(buffer);
  return std::span<const unsigned char>(model.buffers[buffer].data);
}

std::vector<HashedFile> GltfDocument::files_read() const {
  std::vector<HashedFile> all = files;
  all.insert(all.end(), buffer_files->files_read().begin(), buffer_files->files_read().end());
  return all;
}

Result<GltfDocument> open_gltf(std::span<const unsigned char> bytes, const fs::path& path) {
  GltfDocument document;
  document.name = path.string();
  document.buffer_files = std::make_unique<GltfBufferFiles>();
  const bool is_binary = is_binary_gltf(bytes);
  if (!is_binary && !may_be_json(bytes)) {
    return document.bad("it is no glTF, neither a JSON object nor binary: give a .gltf or .glb");
  }
  if (is_too_deep(json_text(bytes))) {
    return document.bad(fmt::format("JSON is nested deeper than {} levels", kMaxJsonDepth));
  }

  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  FileAccess access{(fs::absolute(folder) / "").string(), {}};
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_encoded, nullptr);
  loader.SetFsCallbacks({file_exists, tinygltf::ExpandFilePath, read_whole_file, nullptr, &access});
  std::string error, warning, text;
  if (!is_binary) {
    FARFIELD_TRY_LET(text, text_without_buffer_files(bytes, path, *document.buffer_files));
  }
  bool ok = false;
  try {
    const auto size = static_cast<unsigned int>(is_binary ? bytes.size() : text.size());
    const std::string base = fs::absolute(folder).string();
    ok = is_binary ? loader.LoadBinaryFromMemory(&document.model, &error, &warning, bytes.data(), size, base)
                   : loader.LoadASCIIFromString(&document.model, &error, &warning, text.data(), size, base);
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  // First of all: an unknown compression also makes the parse fail, with a less helpful message.
  const std::string required = unknown_extensions(document.model);
  if (const std::string names = ok || !required.empty() ? required : used_compression(document.model); !names.empty()) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: requires {}, which is not supported; export without it", document.name, names));
  }
  if (document.model.asset.version.starts_with("1")) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: glTF {}; convert it to glTF 2.0", document.name, document.model.asset.version));
  }
  if (!ok) return document.bad(json_words(first_line(error)));
  document.files = std::move(access.files);
  document.warnings = warn_of_unknown_extensions(document.model);

  for (const auto check : {check_meshes, check_textures, check_skins, check_nodes}) {
    if (auto good = check(document); !good) return tl::unexpected(good.error());
  }
  return document;
}

int image_of(const tinygltf::Texture& texture) {
  const auto webp = texture.extensions.find("EXT_texture_webp");
  if (webp == texture.extensions.end()) return texture.source;
  const auto source = extension_number(webp->second, "source");
  return source ? static_cast<int>(std::clamp(*source, -1e9, 1e9)) : texture.source;
}

int component_count(const GltfDocument& document, int accessor) {
  return tinygltf::GetNumComponentsInType(
      static_cast<uint32_t>(document.model.accessors[static_cast<size_t>(accessor)].type));
}

Result<std::vector<double>> read_accessor(const GltfDocument& document, int index, int components) {
  const auto& accessor = document.model.accessors[static_cast<size_t>(index)];
  const auto place = fmt::format("accessor {}", index);
  const int component_bytes = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(accessor.componentType));
  if (component_bytes <= 0) return document.bad(place + ": unknown component type");
  if (component_count(document, index) != components) {
    return document.bad(fmt::format("{}: {} components expected", place, components));
  }
  const auto bytes = static_cast<size_t>(component_bytes);
  std::vector<double> values;
  if (accessor.bufferView >= 0 || !accessor.sparse.isSparse) {
    const size_t element = bytes * static_cast<size_t>(components);
    FARFIELD_TRY_LET(const auto range,
                     byte_range(document, accessor.bufferView, accessor.byteOffset, accessor.count, element, place));
    values.resize(accessor.count * static_cast<size_t>(components));
    for (size_t i = 0, at = 0; i < accessor.count; ++i) {
      for (size_t c = 0; c < static_cast<size_t>(components); ++c, ++at) {
        values[at] = decode(range.data + i * range.stride + c * bytes, accessor.componentType, accessor.normalized);
      }
    }
  } else {
    // Zeros to be overwritten: no bytes back the count, so it is held against all bytes that there are.
    if (accessor.count > total_buffer_bytes(document)) return document.bad(place + ": count is larger than the file");
    values.resize(accessor.count * static_cast<size_t>(components));
  }
  if (accessor.sparse.isSparse) {
    FARFIELD_TRY(apply_sparse(document, accessor, place, components, bytes, values));
  }
  return values;
}

Result<std::vector<uint32_t>> read_indices(const GltfDocument& document, int index) {
  const auto& accessor = document.model.accessors[static_cast<size_t>(index)];
  const bool is_unsigned = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                           accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                           accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  if (!is_unsigned) return document.bad(fmt::format("accessor {}: indices have to be unsigned integers", index));
  FARFIELD_TRY_LET(const auto values, read_accessor(document, index, 1));
  return std::vector<uint32_t>(values.begin(), values.end());
}

Result<std::vector<unsigned char>> image_bytes(const GltfDocument& document, int index) {
  const auto& image = document.model.images[static_cast<size_t>(index)];
  if (image.bufferView >= 0) {
    const auto place = fmt::format("image {}", index);
    if (!is_index(image.bufferView, document.model.bufferViews)) return document.bad(place + ": no such buffer view");
    const size_t size = document.model.bufferViews[static_cast<size_t>(image.bufferView)].byteLength;
    FARFIELD_TRY_LET(const auto range, byte_range(document, image.bufferView, 0, size, 1, place));
    return std::vector<unsigned char>(range.data, range.data + size);
  }
  if (image.image.empty()) {
    return make_error(ErrorCode::NotFound,
                      fmt::format("{}: image {} ({}) is missing", document.name, index, image.uri));
  }
  return image.image;
}

std::optional<double> extension_number(const tinygltf::Value& object, const char* key) {
  if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsNumber()) return std::nullopt;
  const double value = object.Get(key).GetNumberAsDouble();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<vec3> extension_vec3(const tinygltf::Value& object, const char* key) {
  if (!object.IsObject() || !object.Has(key)) return std::nullopt;
  const tinygltf::Value& array = object.Get(key);
  if (!array.IsArray() || array.ArrayLen() != 3) return std::nullopt;
  vec3 out;
  for (int c = 0; c < 3; ++c) {
    if (!array.Get(c).IsNumber()) return std::nullopt;
    out[c] = static_cast<float>(array.Get(c).GetNumberAsDouble());
  }
  return is_finite(out) ? std::optional(out) : std::nullopt;
}

}  // namespace farfield
