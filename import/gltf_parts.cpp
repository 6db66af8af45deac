// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_parts.h"

#include <set>
#include <string>

#include "base/hash.h"
#include "import/gltf_json.h"
#include "import/gltf_nodes.h"
#include "import/read_file.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kVisibility = "KHR_node_visibility";
// Views of hostile files overlap: no more than so many times its bytes are hashed of a buffer.
constexpr uint64_t kMostOverlap = 16;

/// The value of a key, taken out of the object; null if it is not there.
Json take(Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) return nullptr;
  Json value = std::move(object[key]);
  object.erase(key);
  return value;
}

/// The values of an object in the order of their keys, or of an array.
std::vector<Json> values_of(const Json& json) { return {json.begin(), json.end()}; }

std::string text(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

uint64_t number(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<uint64_t>() : 0;
}

}  // namespace

std::optional<GltfParts> GltfParts::open(std::span<const unsigned char> bytes, const fs::path& path) {
  GltfParts parts;
  auto json = parse_json(json_text(bytes));
  if (!json) return std::nullopt;
  auto files = GltfBufferFiles::take_from(*json, path);
  if (!files) return std::nullopt;
  parts.json_ = std::move(*json);
  parts.files_ = std::move(*files);
  parts.folder_ = path.parent_path();
  const Json& all = parts.json_;
  if (all.contains("bufferViews") && all["bufferViews"].is_array()) {
    parts.bytes_of_view_.resize(all["bufferViews"].size());
    for (size_t view = 0; view < all["bufferViews"].size(); ++view) {
      const Json& entry = all["bufferViews"][view];
      if (entry.is_object()) parts.views_of_[number(entry, "buffer")].push_back(view);
    }
  }
  if (all.contains("nodes") && all["nodes"].is_array()) {
    for (size_t node = 0; node < all["nodes"].size(); ++node) {
      const Json& entry = all["nodes"][node];
      if (!entry.is_object() || !entry.contains("children") || !entry["children"].is_array()) continue;
      for (const Json& child : entry["children"])
        if (child.is_number_unsigned()) parts.parent_of_[child.get<int>()] = static_cast<int>(node);
    }
  }
  if (const auto chunk = binary_chunk(bytes); !chunk.empty()) parts.hash_views_of(0, chunk);
  return parts;
}

std::optional<uint64_t> GltfParts::hash(int mesh, int node) {
  hash_ = 0;
  is_clear_ = true;
  for (const char* of_all : {"asset", "extensionsUsed", "extensionsRequired"})
    if (json_.contains(of_all)) add(json_[of_all]);
  if (mesh >= 0)
    add_mesh(mesh);
  else
    add_nodes(node);
  return is_clear_ ? std::optional(hash_) : std::nullopt;
}

void GltfParts::add(const Json& values) {
  const std::string json = values.dump();
  hash_ = mix64(hash_, hash_values(std::span<const char>(json)));
}

void GltfParts::add_mesh(const Json& index) {
  const Json* found = element("meshes", index);
  if (!found) return;
  Json mesh = *found;
  const Json primitives = take(mesh, "primitives");
  add(mesh);
  for (const Json& primitive : primitives) add_primitive(primitive);
}

void GltfParts::add_primitive(Json primitive) {
  if (!primitive.is_object()) return void(is_clear_ = false);
  const Json indices = take(primitive, "indices"), material = take(primitive, "material");
  add(primitive);  // with the names of its attributes, and which are the same
  if (!indices.is_null()) add_accessor(indices);
  if (!material.is_null()) add_material(material);
  for (const Json& accessor : values_of(primitive.value("attributes", Json::object()))) add_accessor(accessor);
  for (const Json& target : primitive.value("targets", Json::array()))
    for (const Json& accessor : values_of(target)) add_accessor(accessor);
}

void GltfParts::add_accessor(const Json& index) {
  const Json* found = element("accessors", index);
  if (!found) return;
  Json accessor = *found;
  std::vector<Json> views = {take(accessor, "bufferView")};
  if (accessor.contains("sparse"))
    for (const char* part : {"indices", "values"})
      if (accessor["sparse"].is_object() && accessor["sparse"].contains(part))
        views.push_back(take(accessor["sparse"][part], "bufferView"));
  add(accessor);
  for (const Json& view : views)
    if (!view.is_null()) add_view(view);
}

void GltfParts::add_view(const Json& index) {
  const Json* found = element("bufferViews", index);
  if (!found) return;
  Json view = *found;
  const size_t buffer = number(view, "buffer");
  std::optional<uint64_t>& bytes = bytes_of_view_[index.get<size_t>()];
  if (!bytes) hash_views_of(buffer);
  if (!bytes) return void(is_clear_ = false);
  view.erase("buffer");
  view.erase("byteOffset");
  add(view);
  hash_ = mix64(hash_, *bytes);
}

void GltfParts::add_material(const Json& index) {
  const Json* found = element("materials", index);
  if (!found) return;
  add(*found);
  add_textures_in(*found);
}

/// Objects such as "normalTexture": {"index": 3}, wherever they are; extensions have them, too.
void GltfParts::add_textures_in(const Json& values) {
  if (!values.is_structured()) return;
  for (const auto& [key, value] : values.items()) {
    if (key.ends_with("exture") && value.is_object() && value.contains("index")) add_texture(value["index"]);
    add_textures_in(value);
  }
}

void GltfParts::add_texture(const Json& index) {
  const Json* found = element("textures", index);
  if (!found) return;
  Json texture = *found;
  std::vector<Json> images = {take(texture, "source")};
  const Json sampler = take(texture, "sampler");
  if (texture.contains("extensions") && texture["extensions"].is_object())
    for (Json& extension : texture["extensions"]) images.push_back(take(extension, "source"));  // EXT_texture_webp
  add(texture);
  if (!sampler.is_null())
    if (const Json* how = element("samplers", sampler)) add(*how);
  for (const Json& image : images)
    if (!image.is_null()) add_image(image);
}

void GltfParts::add_image(const Json& index) {
  const Json* found = element("images", index);
  if (!found) return;
  Json image = *found;
  const Json view = take(image, "bufferView");
  add(image);
  if (!view.is_null()) return add_view(view);
  const std::string uri = text(image, "uri");
  if (uri.empty() || uri.starts_with("data:")) return;
  const auto bytes = read_file(folder_ / GltfBufferFiles::path_of_uri(uri));
  hash_ = mix64(hash_, bytes ? hash_values<unsigned char>(*bytes) : 0);  // an image may be missing
}

/// Each node with the number of its children, parents first: that tells trees apart.
void GltfParts::add_nodes(int root) {
  add_visibility_above(root);
  std::vector<Json> stack = {root};
  std::set<size_t> seen;
  while (!stack.empty() && is_clear_) {
    const Json index = std::move(stack.back());
    stack.pop_back();
    const Json* found = element("nodes", index);
    if (!found || !seen.insert(index.get<size_t>()).second) return void(is_clear_ = false);
    add_node(*found, index == root);
    const Json children = found->value("children", Json::array());
    if (!children.is_array()) return void(is_clear_ = false);
    hash_ = mix64(hash_, children.size());
    for (size_t i = children.size(); i-- > 0;) stack.push_back(children[i]);
  }
}

void GltfParts::add_node(Json node, bool is_root) {
  // A skinned mesh stands where a joint is, which may be anywhere in the file.
  if (!node.is_object() || node.contains("skin")) return void(is_clear_ = false);
  const Json mesh = take(node, "mesh");
  for (const char* elsewhere : {"children", "camera"}) node.erase(elsewhere);
  if (is_root)
    for (const char* of_instances : {"translation", "rotation", "scale", "matrix"}) node.erase(of_instances);
  Json attributes;
  if (node.contains("extensions") && node["extensions"].is_object() &&
      node["extensions"].contains(kInstancingExtension))
    attributes = take(node["extensions"][kInstancingExtension], "attributes");
  add(node);
  if (!mesh.is_null()) add_mesh(mesh);
  if (!attributes.is_object()) return;
  for (const auto& [name, accessor] : attributes.items()) {
    add(name);
    add_accessor(accessor);
  }
}

/// What a node above hides is not there.
void GltfParts::add_visibility_above(int node) {
  std::set<int> seen;
  for (auto up = parent_of_.find(node); up != parent_of_.end(); up = parent_of_.find(up->second)) {
    const Json* parent = element("nodes", up->second);
    if (!parent || !seen.insert(up->second).second) return void(is_clear_ = false);
    const Json extensions = parent->value("extensions", Json::object());
    if (extensions.is_object() && extensions.contains(kVisibility)) add(extensions[kVisibility]);
  }
}

/// Null, and the hash is of no use, where there is none.
const Json* GltfParts::element(const char* list, const Json& index) {
  const auto found = json_.find(list);
  const bool is_there = found != json_.end() && found->is_array() && index.is_number_integer() &&
                        index.get<int64_t>() >= 0 && index.get<uint64_t>() < found->size() &&
                        (*found)[index.get<size_t>()].is_object();
  if (!is_there) is_clear_ = false;
  return is_there ? &(*found)[index.get<size_t>()] : nullptr;
}

void GltfParts::hash_views_of(size_t buffer) {
  if (files_.has(buffer)) {
    const auto bytes = files_.bytes(buffer);
    if (bytes) hash_views_of(buffer, *bytes);
    files_.forget(buffer);
    return;
  }
  // Embedded as text: equal text is equal bytes.
  const Json* entry = element("buffers", buffer);
  const std::string uri = entry ? text(*entry, "uri") : "";
  if (uri.empty()) return;
  for (const size_t view : views_of_[buffer]) {
    const uint64_t begin = number(json_["bufferViews"][view], "byteOffset");
    bytes_of_view_[view] = mix64(hash_values(std::span<const char>(uri)), begin);
  }
}

void GltfParts::hash_views_of(size_t buffer, std::span<const unsigned char> bytes) {
  uint64_t allowed = kMostOverlap * bytes.size();
  for (const size_t view : views_of_[buffer]) {
    const uint64_t begin = number(json_["bufferViews"][view], "byteOffset");
    const uint64_t count = number(json_["bufferViews"][view], "byteLength");
    if (begin > bytes.size() || count > bytes.size() - begin || count > allowed) continue;
    allowed -= count;
    bytes_of_view_[view] = hash_values(bytes.subspan(begin, count));
  }
}

}  // namespace farfield
