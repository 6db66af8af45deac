// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/gtc/type_ptr.hpp>

namespace farfield {
namespace {

using tinygltf::Model;

constexpr double kLargestId = 9007199254740992.0;  // 2^53: up to there doubles are exact

std::string place_of_instancing(const tinygltf::Node& node) {
  return fmt::format("node {} ({})", node.name, kInstancingExtension);
}

/// The accessor of an attribute of EXT_mesh_gpu_instancing; -1: the file does not give the attribute.
Result<int> attribute_accessor(const GltfDocument& document, const tinygltf::Node& node, const char* name) {
  const auto extension = node.extensions.find(kInstancingExtension);
  if (extension == node.extensions.end() || !extension->second.Has("attributes")) return -1;
  const tinygltf::Value& attributes = extension->second.Get("attributes");
  if (!attributes.IsObject() || !attributes.Has(name)) return -1;
  const double index = extension_number(attributes, name).value_or(-1);
  if (!(index >= 0 && index < static_cast<double>(document.model.accessors.size()))) {
    return document.bad(fmt::format("{}: no such accessor for {}", place_of_instancing(node), name));
  }
  return static_cast<int>(index);
}

/// Empty when the file does not give the attribute.
Result<std::vector<double>> read_attribute(const GltfDocument& document, const tinygltf::Node& node, const char* name,
                                           int components) {
  FARFIELD_TRY_LET(const int accessor, attribute_accessor(document, node, name));
  if (accessor < 0) return std::vector<double>();
  return read_accessor(document, accessor, components);
}

Result<void> set_ids(const GltfDocument& document, const tinygltf::Node& node, std::vector<InstanceData>& data) {
  FARFIELD_TRY_LET(const auto ids, read_attribute(document, node, "_ID", 1));
  if (ids.empty()) return {};
  if (ids.size() != data.size()) return document.bad(place_of_instancing(node) + ": _ID differs in length");
  for (size_t i = 0; i < data.size(); ++i) {
    if (!(ids[i] >= 0 && ids[i] <= kLargestId && ids[i] == std::floor(ids[i])))
      return document.bad(fmt::format("{}: _ID {} is no whole number from 0", place_of_instancing(node), ids[i]));
    data[i].id = static_cast<uint64_t>(ids[i]);
  }
  return {};
}

/// Three components, or four of which the last is left out.
Result<void> set_tints(const GltfDocument& document, const tinygltf::Node& node, std::vector<InstanceData>& data) {
  FARFIELD_TRY_LET(const int accessor, attribute_accessor(document, node, "_TINT"));
  if (accessor < 0) return {};
  const int components = component_count(document, accessor) == 4 ? 4 : 3;
  FARFIELD_TRY_LET(const auto tints, read_accessor(document, accessor, components));
  const auto step = static_cast<size_t>(components);
  if (tints.size() != step * data.size()) return document.bad(place_of_instancing(node) + ": _TINT differs in length");
  for (size_t i = 0; i < data.size(); ++i) {
    data[i].tint = vec3(tints[step * i], tints[step * i + 1], tints[step * i + 2]);
    if (!is_finite(data[i].tint)) return document.bad(place_of_instancing(node) + ": a _TINT is not finite");
  }
  return {};
}

/// Zero and NaN quaternions become the identity.
glm::dvec4 unit_quaternion(const glm::dvec4& q) {
  const double length = glm::length(q);
  return length > 0 && std::isfinite(length) ? q / length : glm::dvec4(0, 0, 0, 1);
}

/// A scene might list a node twice: it is there once.
std::vector<int> depth_first(const Model& model, const std::vector<int>& roots) {
  std::vector<bool> seen(model.nodes.size());
  std::vector<int> order, stack(roots.rbegin(), roots.rend());
  while (!stack.empty()) {
    const int n = stack.back();
    stack.pop_back();
    if (seen[static_cast<size_t>(n)]) continue;
    seen[static_cast<size_t>(n)] = true;
    order.push_back(n);
    const auto& children = model.nodes[static_cast<size_t>(n)].children;
    stack.insert(stack.end(), children.rbegin(), children.rend());
  }
  return order;
}

}  // namespace

std::vector<int> parents(const Model& model) {
  std::vector<int> parent(model.nodes.size(), -1);
  for (size_t n = 0; n < model.nodes.size(); ++n) {
    for (const int child : model.nodes[n].children) parent[static_cast<size_t>(child)] = static_cast<int>(n);
  }
  return parent;
}

std::vector<int> scene_nodes(const GltfDocument& document) {
  const Model& model = document.model;
  std::vector<int> roots;
  if (model.scenes.empty()) {
    const std::vector<int> parent = parents(model);
    for (size_t n = 0; n < parent.size(); ++n) {
      if (parent[n] < 0) roots.push_back(static_cast<int>(n));
    }
  } else {
    const size_t scene = model.defaultScene >= 0 && is_index(model.defaultScene, model.scenes)
                             ? static_cast<size_t>(model.defaultScene)
                             : 0;
    roots = model.scenes[scene].nodes;
  }
  return depth_first(model, roots);
}

std::vector<int> nodes_below(const Model& model, int root) { return depth_first(model, {root}); }

NodeTransform transform_of(const tinygltf::Node& node) {
  NodeTransform out;
  if (node.matrix.size() == 16) {
    out.has_matrix = true;
    for (int i = 0; i < 16; ++i) out.matrix[i / 4][i % 4] = node.matrix[static_cast<size_t>(i)];
    return out;
  }
  if (node.translation.size() == 3) out.translation = {node.translation[0], node.translation[1], node.translation[2]};
  if (node.scale.size() == 3) out.scale = {node.scale[0], node.scale[1], node.scale[2]};
  if (node.rotation.size() == 4) {
    out.rotation = unit_quaternion({node.rotation[0], node.rotation[1], node.rotation[2], node.rotation[3]});
  }
  return out;
}

glm::dmat4 to_matrix(const NodeTransform& transform) {
  if (transform.has_matrix) return transform.matrix;
  const glm::dvec4& q = transform.rotation;
  const double x = q.x, y = q.y, z = q.z, w = q.w;
  glm::dmat4 m(1.0);
  m[0] = transform.scale.x * glm::dvec4(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0);
  m[1] = transform.scale.y * glm::dvec4(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0);
  m[2] = transform.scale.z * glm::dvec4(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0);
  m[3] = glm::dvec4(transform.translation, 1);
  return m;
}

std::vector<bool> hidden_nodes(const GltfDocument& document) {
  const Model& model = document.model;
  const std::vector<int> parent = parents(model);
  std::vector<bool> hidden(model.nodes.size());
  for (const int n : scene_nodes(document)) {
    const auto at = static_cast<size_t>(n);
    const auto extension = model.nodes[at].extensions.find("KHR_node_visibility");
    if (extension != model.nodes[at].extensions.end() && extension->second.Has("visible")) {
      const tinygltf::Value& visible = extension->second.Get("visible");
      hidden[at] = visible.IsBool() && !visible.Get<bool>();
    }
    if (parent[at] >= 0 && hidden[static_cast<size_t>(parent[at])]) hidden[at] = true;
  }
  return hidden;
}

Result<std::optional<SkinPlace>> skin_place(const GltfDocument& document, const tinygltf::Node& node) {
  const auto& skin = document.model.skins[static_cast<size_t>(node.skin)];
  SkinPlace place{skin.joints[0], glm::dmat4(1.0)};
  if (skin.inverseBindMatrices < 0) return place;
  FARFIELD_TRY_LET(const auto matrices, read_accessor(document, skin.inverseBindMatrices, 16));
  if (matrices.size() < 16) return document.bad(fmt::format("skin {}: no inverse bind matrix", node.skin));
  place.in_joint = glm::make_mat4(matrices.data());
  const glm::dvec4 last_row(place.in_joint[0].w, place.in_joint[1].w, place.in_joint[2].w, place.in_joint[3].w);
  if (!is_invertible(place.in_joint) || glm::length(last_row - glm::dvec4(0, 0, 0, 1)) > 1e-3) return std::nullopt;
  return place;
}

Result<std::vector<glm::dmat4>> instance_transforms(const GltfDocument& document, const tinygltf::Node& node) {
  if (!node.extensions.contains(kInstancingExtension)) return std::vector<glm::dmat4>{glm::dmat4(1.0)};
  const auto place = place_of_instancing(node);
  FARFIELD_TRY_LET(const auto translations, read_attribute(document, node, "TRANSLATION", 3));
  FARFIELD_TRY_LET(const auto rotations, read_attribute(document, node, "ROTATION", 4));
  FARFIELD_TRY_LET(const auto scales, read_attribute(document, node, "SCALE", 3));

  const size_t count = std::max({translations.size() / 3, rotations.size() / 4, scales.size() / 3});
  const auto fits = [count](const std::vector<double>& values, size_t components) {
    return values.empty() || values.size() == count * components;
  };
  if (!fits(translations, 3) || !fits(rotations, 4) || !fits(scales, 3)) {
    return document.bad(place + ": TRANSLATION, ROTATION and SCALE differ in length");
  }
  std::vector<glm::dmat4> transforms;
  transforms.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    NodeTransform transform;
    if (!translations.empty()) transform.translation = glm::make_vec3(&translations[3 * i]);
    if (!scales.empty()) transform.scale = glm::make_vec3(&scales[3 * i]);
    if (!rotations.empty()) transform.rotation = unit_quaternion(glm::make_vec4(&rotations[4 * i]));
    transforms.push_back(to_matrix(transform));
  }
  return transforms;
}

InstanceData data_of_extras(const tinygltf::Node& node) {
  InstanceData data;
  const double id = extension_number(node.extras, "farfield_id").value_or(0);
  if (id >= 0 && id <= kLargestId) data.id = static_cast<uint64_t>(id);
  data.tint = extension_vec3(node.extras, "farfield_tint").value_or(data.tint);
  return data;
}

Result<std::vector<InstanceData>> instance_data(const GltfDocument& document, const tinygltf::Node& node,
                                                size_t count) {
  std::vector<InstanceData> data(count, data_of_extras(node));
  FARFIELD_TRY(set_ids(document, node, data));
  FARFIELD_TRY(set_tints(document, node, data));
  return data;
}

bool has_weights_of_its_own(const GltfDocument& document, const tinygltf::Node& node) {
  return !node.weights.empty() && node.mesh >= 0 &&
         node.weights != document.model.meshes[static_cast<size_t>(node.mesh)].weights;
}

bool is_invertible(const glm::dmat4& m) {
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 4; ++r) {
      if (!std::isfinite(m[c][r])) return false;
    }
  }
  const dvec3 x(m[0]), y(m[1]), z(m[2]);
  const double volume = std::abs(glm::dot(x, glm::cross(y, z)));
  // Relative to the box that the columns could span: a flat or collapsed transform loses all digits of it.
  return volume > 1e-9 * glm::length(x) * glm::length(y) * glm::length(z);
}

}  // namespace farfield
