// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_assemblies.h"
#include "import/gltf_mesh_extras.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include "base/hash.h"
#include "base/result.h"
#include "import/gltf_nodes.h"

namespace farfield {
namespace {

using glm::dmat4;

constexpr const char* kMark = "farfield_asset";  // in a node's extras
constexpr double kMostTriangles = 20e6;          // of what no mark asks for: more is a place, not a thing
constexpr float kSmallestShare = 0.5f;           // of the whole, that its longest part spans
constexpr uint32_t kDeepest = 64;                // levels of nodes below a root; bounds what looking at all roots costs

/// Two independent 64-bit hashes: equal ones are taken for equal subtrees without another look.
using Fingerprint = std::array<uint64_t, 2>;

Fingerprint mix(const Fingerprint& a, const Fingerprint& b) { return {mix64(a[0], b[0]), mix64(b[1], ~a[1])}; }

template <typename T>
Fingerprint fingerprint(std::span<const T> values) {
  return {hash_values(values, 1), hash_values(values, 2)};
}

Fingerprint fingerprint(uint64_t value) { return {mix64(1, value), mix64(2, value)}; }

/// In floats, as copies of a transform are written.
Fingerprint fingerprint(const dmat4& matrix) {
  std::array<float, 16> values;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) values[static_cast<size_t>(4 * c + r)] = static_cast<float>(matrix[c][r]) + 0.0f;
  return fingerprint(std::span<const float>(values));
}

// ---- equal meshes

std::string looks_of(const GltfDocument& document, int accessor) {
  if (accessor < 0) return "none";
  const auto& a = document.model.accessors[static_cast<size_t>(accessor)];
  return fmt::format("{} {} {} {} [{}] [{}]", a.componentType, a.type, a.count, a.normalized,
                     fmt::join(a.minValues, " "), fmt::join(a.maxValues, " "));
}

/// All of a mesh but its bytes.
std::string looks_of(const GltfDocument& document, const tinygltf::Mesh& mesh, std::span<const int> material_as) {
  std::string looks = fmt::format("weights {}", fmt::join(mesh.weights, " "));
  // A value that is none of the names is like nothing else: which mesh is refused must not depend on the others.
  const auto scheme = scheme_of_extras(mesh);
  looks += !scheme ? scheme.error().message : *scheme ? name_of(**scheme) : "";
  for (const auto& primitive : mesh.primitives) {
    const int material = primitive.material < 0 ? -1 : material_as[static_cast<size_t>(primitive.material)];
    looks += fmt::format("; {} {} {}", primitive.mode, material, looks_of(document, primitive.indices));
    for (const auto& [name, accessor] : primitive.attributes) looks += name + looks_of(document, accessor);
    for (const auto& target : primitive.targets)
      for (const auto& [name, accessor] : target) looks += "+" + name + looks_of(document, accessor);
  }
  return looks;
}

/// The accessors of a mesh, in an order that equal meshes share.
std::vector<int> accessors_of(const tinygltf::Mesh& mesh) {
  std::vector<int> accessors;
  for (const auto& primitive : mesh.primitives) {
    accessors.push_back(primitive.indices);
    for (const auto& [name, accessor] : primitive.attributes) accessors.push_back(accessor);
    for (const auto& target : primitive.targets)
      for (const auto& [name, accessor] : target) accessors.push_back(accessor);
  }
  return accessors;
}

/// The values of a file's accessors by hash, each read once. What cannot be read is like nothing else.
class AccessorHashes {
 public:
  explicit AccessorHashes(const GltfDocument& document) : document_(document) {}

  Fingerprint of(int accessor) {
    if (accessor < 0) return fingerprint(uint64_t{0});
    const auto known = known_.find(accessor);
    if (known != known_.end()) return known->second;
    const auto values = read_accessor(document_, accessor, component_count(document_, accessor));
    return known_[accessor] = values ? fingerprint(std::span<const double>(*values))
                                     : fingerprint(static_cast<uint64_t>(accessor) + 1);
  }

 private:
  const GltfDocument& document_;
  std::map<int, Fingerprint> known_;
};

/// For each material the first of its name if it is equal to that, else itself: names are what mattes go by.
std::vector<int> first_equal_materials(const tinygltf::Model& model) {
  std::map<std::string, int> first_of;
  std::vector<int> first;
  for (size_t m = 0; m < model.materials.size(); ++m) {
    const auto number = static_cast<int>(m);
    const int earlier = first_of.try_emplace(model.materials[m].name, number).first->second;
    first.push_back(model.materials[static_cast<size_t>(earlier)] == model.materials[m] ? earlier : number);
  }
  return first;
}

// ---- subtrees

/// What is known of a node and all that is to be seen below it.
struct Subtree {
  Fingerprint fingerprint{};    ///< of its shape; the transform of the node itself does not count
  uint32_t mesh_nodes = 0;      ///< that show a mesh, once or many times
  double triangles = 0;         ///< of all of them
  uint32_t height = 0;          ///< levels of nodes below
  bool is_stiff = true;         ///< nothing below is animated, nothing is skinned
  bool has_mark_below = false;  ///< somebody said which nodes below are assets, or are not
  std::optional<bool> mark;     ///< of the node itself
};

std::optional<bool> mark_of(const tinygltf::Node& node) {
  if (!node.extras.IsObject() || !node.extras.Has(kMark)) return std::nullopt;
  const tinygltf::Value& value = node.extras.Get(kMark);
  if (value.IsBool()) return value.Get<bool>();
  if (value.IsNumber()) return value.GetNumberAsDouble() != 0;  // Blender's older custom properties
  return std::nullopt;
}

class AssemblyFinder {
 public:
  AssemblyFinder(const GltfDocument& document, std::span<const int> order, std::span<const GltfMesh> meshes,
                 std::span<const uint32_t> first_equal_mesh, AssemblyRule rule)
      : document_(document),
        nodes_(document.model.nodes),
        order_(order),
        meshes_(meshes),
        first_equal_mesh_(first_equal_mesh),
        rule_(rule) {}

  Result<Assemblies> find() {
    found_.kind_of.assign(nodes_.size(), -1);
    found_.is_part.assign(nodes_.size(), false);
    if (rule_ == AssemblyRule::None) return std::move(found_);
    hidden_ = hidden_nodes(document_);
    parents_ = parents(document_.model);
    find_animated();
    subtrees_.resize(nodes_.size());
    for (size_t i = order_.size(); i-- > 0;) FARFIELD_TRY(look_at(order_[i]));  // children come before their parents
    for (const int n : order_)
      if (is_shown(n) && at(n).is_stiff) ++repeats_[at(n).fingerprint];
    for (const int n : order_) FARFIELD_TRY(decide(n));
    return std::move(found_);
  }

 private:
  Subtree& at(int node) { return subtrees_[static_cast<size_t>(node)]; }
  const tinygltf::Node& node(int number) const { return nodes_[static_cast<size_t>(number)]; }
  bool is_shown(int number) { return !hidden_[static_cast<size_t>(number)] && at(number).mesh_nodes > 0; }

  /// Whether a node is neither part of anything nor has parts.
  bool is_alone(int number) const { return parents_[static_cast<size_t>(number)] < 0 && node(number).children.empty(); }

  void find_animated() {
    is_animated_.assign(nodes_.size(), false);
    for (const auto& animation : document_.model.animations)
      for (const auto& channel : animation.channels)
        if (channel.target_node >= 0 && channel.target_node < static_cast<int>(nodes_.size()))
          is_animated_[static_cast<size_t>(channel.target_node)] = true;
  }

  Result<void> look_at(int number) {
    if (hidden_[static_cast<size_t>(number)]) return {};
    Subtree& tree = at(number);
    tree.mark = mark_of(node(number));
    if (node(number).mesh >= 0) FARFIELD_TRY(look_at_mesh(number, tree));
    std::vector<Fingerprint> below;
    for (const int child : node(number).children) {
      if (!is_shown(child)) continue;
      const Subtree& part = at(child);
      below.push_back(mix(fingerprint(to_matrix(transform_of(node(child)))), part.fingerprint));
      tree.mesh_nodes += part.mesh_nodes;
      tree.triangles += part.triangles;
      tree.height = std::max(tree.height, part.height + 1);
      tree.is_stiff = tree.is_stiff && part.is_stiff && !is_animated_[static_cast<size_t>(child)];
      tree.has_mark_below = tree.has_mark_below || part.has_mark_below || part.mark.has_value();
    }
    std::ranges::sort(below);  // in which order a node names its children does not matter
    for (const Fingerprint& part : below) tree.fingerprint = mix(tree.fingerprint, part);
    return {};
  }

  Result<void> look_at_mesh(int number, Subtree& tree) {
    const auto mesh = static_cast<size_t>(node(number).mesh);
    tree.mesh_nodes = 1;
    if (is_alone(number) && !tree.mark) return {};  // a forest of a million places may be one such node
    FARFIELD_TRY_LET(const auto places, instance_transforms(document_, node(number)));
    tree.triangles = static_cast<double>(meshes_[mesh].triangle_count) * static_cast<double>(places.size());
    tree.is_stiff = node(number).skin < 0;
    tree.fingerprint = fingerprint(uint64_t{first_equal_mesh_[mesh]});
    for (const dmat4& place : places) tree.fingerprint = mix(tree.fingerprint, fingerprint(place));
    return {};
  }

  /// Parents come first: what is part of an assembly already is not looked at again.
  Result<void> decide(int number) {
    if (!is_shown(number) || found_.is_part[static_cast<size_t>(number)]) return {};
    const Subtree& tree = at(number);
    if (tree.mark.value_or(false) && !tree.is_stiff) {
      found_.warnings.push_back(
          fmt::format("node {} ({}): it is marked as one asset, but parts of it are animated or "
                      "skinned; they stay apart",
                      number, node(number).name));
    }
    const bool is_wanted = tree.mark.value_or(may_be_repeated_thing(tree));
    if (!is_wanted || !tree.is_stiff) return {};

    if (!tree.mark && refused_.contains(tree.fingerprint)) return {};
    const auto known = kind_with_.find(tree.fingerprint);
    if (known != kind_with_.end()) return take(number, known->second), Result<void>();
    FARFIELD_TRY_LET(const auto measured, measure(number));
    if (!tree.mark && !measured.holds_together) return refused_.insert(tree.fingerprint), Result<void>();
    kind_with_[tree.fingerprint] = static_cast<int>(found_.kinds.size());
    found_.kinds.push_back(measured.assembly);
    take(number, kind_with_[tree.fingerprint]);
    return {};
  }

  bool may_be_repeated_thing(const Subtree& tree) {
    return rule_ == AssemblyRule::Repeated && !tree.has_mark_below && tree.mesh_nodes >= 2 && tree.height <= kDeepest &&
           tree.triangles <= kMostTriangles && repeats_[tree.fingerprint] >= 2;
  }

  struct Measured {
    Assembly assembly;
    bool holds_together = false;  ///< some part is about as long as the whole
  };
  Result<Measured> measure(int root) {
    Measured out;
    out.assembly.node = root;
    out.assembly.triangle_count = static_cast<uint64_t>(at(root).triangles);
    float longest = 0;
    std::vector<std::pair<int, dmat4>> stack = {{root, dmat4(1.0)}};
    while (!stack.empty()) {
      const auto [number, to_root] = stack.back();
      stack.pop_back();
      FARFIELD_TRY_LET(const auto boxes, boxes_of(number, to_root));
      for (const Box3& box : boxes) {
        out.assembly.bounds.extend(box);
        longest = std::max(longest, glm::length(box.size()));
      }
      for (const int child : node(number).children)
        if (is_shown(child)) stack.emplace_back(child, to_root * to_matrix(transform_of(node(child))));
    }
    out.holds_together = longest >= kSmallestShare * glm::length(out.assembly.bounds.size());
    return out;
  }

  /// Of all places where a node shows its mesh.
  Result<std::vector<Box3>> boxes_of(int number, const dmat4& to_root) {
    std::vector<Box3> boxes;
    if (node(number).mesh < 0) return boxes;
    const Box3& bounds = meshes_[static_cast<size_t>(node(number).mesh)].bounds;
    if (bounds.is_empty()) return boxes;
    FARFIELD_TRY_LET(const auto places, instance_transforms(document_, node(number)));
    for (const dmat4& place : places) {
      const dmat4 to_assembly = to_root * place;
      if (!is_invertible(to_assembly)) continue;
      Box3& box = boxes.emplace_back();
      for (int i = 0; i < 8; ++i) box.extend(vec3(to_assembly * glm::dvec4(bounds.corner(i), 1)));
    }
    return boxes;
  }

  void take(int root, int kind) {
    found_.kind_of[static_cast<size_t>(root)] = kind;
    std::vector<int> stack = {root};
    while (!stack.empty()) {
      const int number = stack.back();
      stack.pop_back();
      found_.is_part[static_cast<size_t>(number)] = true;
      for (const int child : node(number).children) stack.push_back(child);
    }
  }

  const GltfDocument& document_;
  const std::vector<tinygltf::Node>& nodes_;
  std::span<const int> order_;
  std::span<const GltfMesh> meshes_;
  std::span<const uint32_t> first_equal_mesh_;
  const AssemblyRule rule_;
  std::vector<bool> hidden_, is_animated_;  ///< per node
  std::vector<int> parents_;                ///< per node
  std::vector<Subtree> subtrees_;           ///< per node
  std::map<Fingerprint, uint32_t> repeats_;
  std::map<Fingerprint, int> kind_with_;
  std::set<Fingerprint> refused_;
  Assemblies found_;
};

}  // namespace

std::vector<uint32_t> first_equal_meshes(const GltfDocument& document) {
  const std::vector<int> material_as = first_equal_materials(document.model);
  std::map<std::string, std::vector<uint32_t>> alike;
  for (uint32_t m = 0; m < document.model.meshes.size(); ++m)
    alike[looks_of(document, document.model.meshes[m], material_as)].push_back(m);

  std::vector<uint32_t> first(document.model.meshes.size());
  AccessorHashes hashes(document);
  for (const auto& [looks, meshes] : alike) {
    std::map<Fingerprint, uint32_t> first_with;
    for (const uint32_t m : meshes) {
      Fingerprint bytes{};
      if (meshes.size() > 1)
        for (const int accessor : accessors_of(document.model.meshes[m])) bytes = mix(bytes, hashes.of(accessor));
      first[m] = first_with.try_emplace(bytes, m).first->second;
    }
  }
  return first;
}

Result<Assemblies> find_assemblies(const GltfDocument& document, std::span<const int> order,
                                   std::span<const GltfMesh> meshes, std::span<const uint32_t> first_equal_mesh,
                                   AssemblyRule rule) {
  return AssemblyFinder(document, order, meshes, first_equal_mesh, rule).find();
}

}  // namespace farfield
