// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>

#include "base/free_memory.h"
#include "base/result.h"
#include "base/text.h"
#include "import/gltf_assemblies.h"
#include "import/gltf_document.h"
#include "import/gltf_mesh_extras.h"
#include "import/gltf_nodes.h"
#include "import/gltf_volumes.h"
#include "import/read_file.h"
#include "import/read_source.h"
#include "import/read_volume.h"

namespace farfield {
namespace {

using glm::dmat4;
using glm::dvec4;

// ---- animation

/// The key interval that a time falls into: keys [index, index + 1] and how far between them, in [0, 1].
struct Interval {
  size_t index;
  double t;
  double seconds;  ///< length of the interval
};

Interval find_interval(const std::vector<float>& times, double seconds) {
  if (!(seconds > times.front())) return {0, 0.0, 0.0};  // also for NaN
  if (seconds >= times.back()) return {times.size() - 1, 0.0, 0.0};
  const auto above = std::upper_bound(times.begin(), times.end(), seconds,
                                      [](double s, float key) { return s < static_cast<double>(key); });
  const size_t index = static_cast<size_t>(above - times.begin()) - 1;
  const double begin = times[index], length = static_cast<double>(times[index + 1]) - begin;
  return {index, (seconds - begin) / length, length};
}

dvec4 slerp(dvec4 a, dvec4 b, double t) {
  double cosine = glm::dot(a, b);
  if (cosine < 0) {  // the short way round
    b = -b;
    cosine = -cosine;
  }
  if (cosine > 0.9999995) return glm::normalize(glm::mix(a, b, t));  // sin would lose its digits
  const double angle = std::acos(cosine);
  return (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle);
}

/// The value of a channel at a time (glTF 2.0, appendix C). Rotations come out as unit quaternions.
dvec4 sample(const GltfChannel& channel, double seconds) {
  const Interval at = find_interval(channel.times, seconds);
  const auto value = [&](size_t i) { return dvec4(channel.values[i]); };
  const bool is_rotation = channel.path == GltfChannel::Path::Rotation;
  dvec4 result;
  if (channel.interpolation == GltfChannel::Interpolation::CubicSpline) {
    if (at.t == 0.0) {
      result = value(3 * at.index + 1);
    } else {
      const double t = at.t, t2 = t * t, t3 = t2 * t;
      result = (2 * t3 - 3 * t2 + 1) * value(3 * at.index + 1) +
               at.seconds * (t3 - 2 * t2 + t) * value(3 * at.index + 2) + (3 * t2 - 2 * t3) * value(3 * at.index + 4) +
               at.seconds * (t3 - t2) * value(3 * at.index + 3);
    }
  } else if (channel.interpolation == GltfChannel::Interpolation::Step || at.t == 0.0) {
    result = value(at.index);
  } else if (is_rotation) {
    result = slerp(value(at.index), value(at.index + 1), at.t);
  } else {
    result = glm::mix(value(at.index), value(at.index + 1), at.t);
  }
  if (!is_rotation) return result;
  const double length = glm::length(result);
  return length > 0 ? result / length : dvec4(0, 0, 0, 1);
}

dmat4 local_matrix(const GltfScene& scene, const GltfNode& node, double seconds) {
  NodeTransform transform{node.translation, node.scale, node.rotation, node.matrix, node.has_matrix};
  for (const uint32_t index : node.channels) {
    const GltfChannel& channel = scene.channels[index];
    const dvec4 value = sample(channel, seconds);
    switch (channel.path) {
      case GltfChannel::Path::Translation:
        transform.translation = dvec3(value);
        break;
      case GltfChannel::Path::Rotation:
        transform.rotation = value;
        break;
      case GltfChannel::Path::Scale:
        transform.scale = dvec3(value);
        break;
    }
  }
  return to_matrix(transform);
}

void set_world_matrices(const GltfScene& scene, double seconds, std::vector<dmat4>& world) {
  world.clear();
  world.reserve(scene.nodes.size());
  for (const GltfNode& node : scene.nodes) {
    const dmat4 local = local_matrix(scene, node, seconds);
    world.push_back(node.parent < 0 ? local : world[static_cast<size_t>(node.parent)] * local);
  }
}

dmat4 world_matrix(const GltfScene& scene, uint32_t node, double seconds) {
  dmat4 world(1.0);
  for (int32_t n = static_cast<int32_t>(node); n >= 0; n = scene.nodes[static_cast<size_t>(n)].parent) {
    world = local_matrix(scene, scene.nodes[static_cast<size_t>(n)], seconds) * world;
  }
  return world;
}

dmat4 to_square(const mat4x3& m) { return dmat4(dvec4(m[0], 0), dvec4(m[1], 0), dvec4(m[2], 0), dvec4(m[3], 1)); }

/// In floats, seen from `origin`.
mat4x3 to_affine(const dmat4& m, const dvec3& origin = dvec3(0.0)) {
  return mat4x3(vec3(m[0]), vec3(m[1]), vec3(m[2]), vec3(dvec3(m[3]) - origin));
}

vec3 corner_of(const Box3& box, int number) {
  return vec3((number & 1 ? box.upper : box.lower).x, (number & 2 ? box.upper : box.lower).y,
              (number & 4 ? box.upper : box.lower).z);
}

/// Whether floats are so sparse where the box lies that the steps between them could be seen on what is in it.
bool is_far_for_its_size(const dvec3& lower, const dvec3& upper) {
  constexpr double kFarthestInSizes = 16;  // a 2^19th of its size is then the step of a float
  return glm::length(0.5 * (lower + upper)) > kFarthestInSizes * glm::length(upper - lower);  // false for NaN
}

/// Puts a camera where its node is, seen from `origin`. Scales, mirrors and shears are taken out: forward stays, up is
/// made upright to it.
void place(GltfCamera& camera, const dmat4& world, const dvec3& origin) {
  camera.position = vec3(dvec3(world[3]) - origin);
  const dvec3 forward = -dvec3(world[2]), up(world[1]);
  if (glm::length(glm::cross(forward, up)) <= 1e-12 * glm::length(forward) * glm::length(up)) return;
  camera.forward = vec3(glm::normalize(forward));
  camera.right = vec3(glm::normalize(glm::cross(forward, up)));
  camera.up = glm::cross(camera.right, camera.forward);
}

// ---- reading

class SceneReader {
 public:
  SceneReader(const GltfDocument& document, std::filesystem::path folder, AssemblyRule rule)
      : document_(document), model_(document.model), folder_(std::move(folder)), rule_(rule) {}

  Result<GltfScene> read() {
    scene_.warnings = document_.warnings;
    return with_warnings(read_all(), scene_.warnings);
  }

 private:
  Result<GltfScene> read_all() {
    for (size_t m = 0; m < model_.meshes.size(); ++m) scene_.meshes.push_back(read_mesh_or_nothing(m));
    const std::vector<int> order = scene_nodes(document_);
    flatten_nodes(order);
    for (const auto& animation : model_.animations) {
      FARFIELD_TRY(read_animation(animation));
    }
    find_time_range();
    FARFIELD_TRY(find_assets(order));
    FARFIELD_TRY(place_everything(order));
    if (!scene_.do_instances_move()) free_memory(scene_.in_node);
    scene_.instances.shrink_to_fit();
    return std::move(scene_);
  }

  void warn(std::string text) { scene_.warnings.push_back(std::move(text)); }

  /// Equal meshes become one asset, and so do the parts of assemblies, which follow the meshes.
  Result<void> find_assets(const std::vector<int>& order) {
    first_equal_mesh_ = first_equal_meshes(document_);
    FARFIELD_TRY_LET(assemblies_, find_assemblies(document_, order, scene_.meshes, first_equal_mesh_, rule_));
    for (const std::string& warning : assemblies_.warnings) warn(warning);
    for (const Assembly& assembly : assemblies_.kinds) {
      GltfMesh asset;
      asset.name = model_.nodes[static_cast<size_t>(assembly.node)].name;
      asset.asset_name = unique_name(asset.name, fmt::format("node_{}", assembly.node));
      asset.node = assembly.node;
      asset.bounds = assembly.bounds;
      asset.triangle_count = assembly.triangle_count;
      scene_.meshes.push_back(std::move(asset));
    }
    return {};
  }

  /// One broken mesh does not stop a scene: it stays empty, and is warned about.
  GltfMesh read_mesh_or_nothing(size_t index) {
    GltfMesh mesh;
    mesh.name = model_.meshes[index].name;
    mesh.asset_name = unique_name(mesh.name, fmt::format("mesh_{}", index));
    if (const auto measured = measure(model_.meshes[index], mesh); !measured) {
      warn(fmt::format("mesh {} ({}) is left out: {}", index, mesh.name, measured.error().message));
      mesh.bounds = Box3();
      mesh.triangle_count = 0;
    }
    return mesh;
  }

  /// Counts the triangles and finds the bounds.
  Result<void> measure(const tinygltf::Mesh& source, GltfMesh& mesh) {
    for (const auto& primitive : source.primitives) {
      const auto position = primitive.attributes.find("POSITION");
      if (position == primitive.attributes.end()) continue;
      const int counted = primitive.indices >= 0 ? primitive.indices : position->second;
      const uint64_t count = model_.accessors[static_cast<size_t>(counted)].count;
      const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
      if (mode < TINYGLTF_MODE_TRIANGLES) continue;  // points and lines
      mesh.triangle_count += mode == TINYGLTF_MODE_TRIANGLES ? count / 3 : std::max<uint64_t>(count, 2) - 2;
      FARFIELD_TRY_LET(auto box, position_bounds(position->second));
      mesh.bounds.extend(box);
    }
    if (is_far_for_its_size(dvec3(mesh.bounds.lower), dvec3(mesh.bounds.upper)))
      warn(fmt::format("mesh {}: its points lie so far from its origin that they are coarse; move its node instead",
                       mesh.asset_name));
    return {};
  }

  /// From the accessor's min and max where they are usable (quantised ones are not in mesh units), else from its
  /// values.
  Result<Box3> position_bounds(int index) {
    const auto& accessor = model_.accessors[static_cast<size_t>(index)];
    Box3 box;
    if (!accessor.normalized && accessor.minValues.size() == 3 && accessor.maxValues.size() == 3) {
      for (int c = 0; c < 3; ++c) {
        box.lower[c] = static_cast<float>(accessor.minValues[static_cast<size_t>(c)]);
        box.upper[c] = static_cast<float>(accessor.maxValues[static_cast<size_t>(c)]);
      }
      if (is_finite(box.lower) && is_finite(box.upper)) return box;
      box = Box3();
    }
    FARFIELD_TRY_LET(const auto values, read_accessor(document_, index, 3));
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
      const vec3 point(values[i], values[i + 1], values[i + 2]);
      if (is_finite(point)) box.extend(point);
    }
    return box;
  }

  std::string unique_name(const std::string& name, const std::string& if_empty) {
    std::string clean = name.substr(0, 100);
    for (char& c : clean) {
      const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.';
      if (!is_plain || static_cast<unsigned char>(c) > 127) c = '_';
    }
    if (clean.empty()) clean = if_empty;
    if (clean[0] == '.') clean[0] = '_';
    std::string unique = clean;
    // Some file systems do not tell upper from lower case.
    for (int n = 2; !taken_names_.insert(lower_case(unique)).second; ++n) unique = fmt::format("{}_{}", clean, n);
    return unique;
  }

  void flatten_nodes(const std::vector<int>& order) {
    scene_index_.assign(model_.nodes.size(), -1);
    const std::vector<int> parent = parents(model_);
    for (const int n : order) {
      const NodeTransform transform = transform_of(model_.nodes[static_cast<size_t>(n)]);
      GltfNode node;
      const int up = parent[static_cast<size_t>(n)];
      node.parent = up < 0 ? -1 : scene_index_[static_cast<size_t>(up)];
      node.translation = transform.translation;
      node.scale = transform.scale;
      node.rotation = transform.rotation;
      node.matrix = transform.matrix;
      node.has_matrix = transform.has_matrix;
      scene_index_[static_cast<size_t>(n)] = static_cast<int32_t>(scene_.nodes.size());
      scene_.nodes.push_back(std::move(node));
    }
  }

  Result<void> read_animation(const tinygltf::Animation& animation) {
    for (const auto& source : animation.channels) {
      const bool has_node = source.target_node >= 0 && source.target_node < static_cast<int>(model_.nodes.size());
      if (source.target_node >= 0 && !has_node)
        return document_.bad(fmt::format("animation {}: no such node", animation.name));
      if (!has_node || scene_index_[static_cast<size_t>(source.target_node)] < 0) continue;  // not in this scene
      FARFIELD_TRY(read_channel(animation, source));
    }
    return {};
  }

  Result<void> read_channel(const tinygltf::Animation& animation, const tinygltf::AnimationChannel& source) {
    const auto place = fmt::format("animation {} of node {}", animation.name, source.target_node);
    GltfChannel channel{};
    if (source.target_path == "translation")
      channel.path = GltfChannel::Path::Translation;
    else if (source.target_path == "rotation")
      channel.path = GltfChannel::Path::Rotation;
    else if (source.target_path == "scale")
      channel.path = GltfChannel::Path::Scale;
    else
      return warn(fmt::format("{}: {} is not animated", place, source.target_path)), Result<void>();

    GltfNode& node = scene_.nodes[static_cast<size_t>(scene_index_[static_cast<size_t>(source.target_node)])];
    const bool is_taken = std::any_of(node.channels.begin(), node.channels.end(),
                                      [&](uint32_t c) { return scene_.channels[c].path == channel.path; });
    if (is_taken || node.has_matrix) {
      warn(fmt::format("{}: {}; ignored", place,
                       is_taken ? "a second animation of the same property" : "the node has a matrix"));
      return {};
    }
    if (source.sampler < 0 || source.sampler >= static_cast<int>(animation.samplers.size())) {
      return document_.bad(place + ": no such sampler");
    }
    const auto& sampler = animation.samplers[static_cast<size_t>(source.sampler)];
    channel.interpolation = sampler.interpolation == "STEP"          ? GltfChannel::Interpolation::Step
                            : sampler.interpolation == "CUBICSPLINE" ? GltfChannel::Interpolation::CubicSpline
                                                                     : GltfChannel::Interpolation::Linear;
    FARFIELD_TRY(read_keys(sampler, place, channel));
    node.channels.push_back(static_cast<uint32_t>(scene_.channels.size()));
    scene_.channels.push_back(std::move(channel));
    return {};
  }

  Result<void> read_keys(const tinygltf::AnimationSampler& sampler, const std::string& place, GltfChannel& channel) {
    const int accessor_count = static_cast<int>(model_.accessors.size());
    if (sampler.input < 0 || sampler.input >= accessor_count || sampler.output < 0 ||
        sampler.output >= accessor_count) {
      return document_.bad(place + ": no such accessor");
    }
    const int components = channel.path == GltfChannel::Path::Rotation ? 4 : 3;
    FARFIELD_TRY_LET(const auto times, read_accessor(document_, sampler.input, 1));
    FARFIELD_TRY_LET(const auto values, read_accessor(document_, sampler.output, components));

    const size_t per_key = channel.interpolation == GltfChannel::Interpolation::CubicSpline ? 3 : 1;
    if (times.empty() || values.size() != times.size() * per_key * static_cast<size_t>(components)) {
      return document_.bad(fmt::format("{}: {} keys, but values for another number", place, times.size()));
    }
    channel.times.assign(times.begin(), times.end());
    for (size_t i = 0; i < channel.times.size(); ++i) {
      const bool is_good = std::isfinite(channel.times[i]) && (i == 0 || channel.times[i] > channel.times[i - 1]);
      if (!is_good) return document_.bad(fmt::format("{}: key times do not increase at key {}", place, i));
    }
    for (size_t i = 0; i < values.size(); i += static_cast<size_t>(components)) {
      vec4 value(0.0f);
      for (int c = 0; c < components; ++c) {
        value[c] = static_cast<float>(values[i + static_cast<size_t>(c)]);
        if (!std::isfinite(value[c])) return document_.bad(place + ": a key is not finite");
      }
      channel.values.push_back(value);
    }
    return {};
  }

  void find_time_range() {
    if (scene_.channels.empty()) return;
    double start = INFINITY, end = -INFINITY, spacing = INFINITY;
    for (const GltfChannel& channel : scene_.channels) {
      start = std::min(start, static_cast<double>(channel.times.front()));
      end = std::max(end, static_cast<double>(channel.times.back()));
      for (size_t i = 1; i < channel.times.size(); ++i) {
        spacing = std::min(spacing, static_cast<double>(channel.times[i]) - channel.times[i - 1]);
      }
    }
    scene_.start_seconds = start;
    scene_.end_seconds = end;
    for (const double rate : {24.0, 25.0, 30.0, 48.0, 50.0, 60.0}) {
      if (std::abs(spacing * rate - 1) < 0.01) scene_.frames_per_second = rate;
    }
  }

  Result<void> place_everything(const std::vector<int>& order) {
    std::vector<dmat4> world;
    set_world_matrices(scene_, 0, world);
    const std::vector<bool> hidden = hidden_nodes(document_);
    for (uint32_t i = 0; i < order.size(); ++i) {
      const auto number = static_cast<size_t>(order[i]);
      const auto& node = model_.nodes[number];
      if (assemblies_.kind_of[number] >= 0)
        add_assembly(order[i], i, world);
      else if (node.mesh >= 0 && !hidden[number] && !assemblies_.is_part[number])
        FARFIELD_TRY(add_instances(node, order[i], i, world));
      if (hidden[number]) continue;
      add_volume(order[i], i, world);
      add_model(order[i], i, world);
    }
    place_instances();
    for (uint32_t i = 0; i < order.size(); ++i) {
      const auto& node = model_.nodes[static_cast<size_t>(order[i])];
      if (node.camera >= 0) add_camera(node, i, world[i]);
      const auto light = node.extensions.find("KHR_lights_punctual");
      if (light != node.extensions.end() && !hidden[static_cast<size_t>(order[i])])
        add_light(node, light->second, i, world[i]);
    }
    return {};
  }

  void add_assembly(int number, uint32_t index, const std::vector<dmat4>& worlds) {
    const auto kind = static_cast<size_t>(assemblies_.kind_of[static_cast<size_t>(number)]);
    const InstanceData data = data_of_extras(model_.nodes[static_cast<size_t>(number)]);
    show(number, static_cast<uint32_t>(model_.meshes.size() + kind), index, worlds, {dmat4(1.0)}, {data});
  }

  /// A volume that a node names; one asset for equal ones. What cannot be read is left out, as broken meshes are.
  void add_volume(int number, uint32_t index, const std::vector<dmat4>& worlds) {
    const auto& node = model_.nodes[static_cast<size_t>(number)];
    auto named = volume_of_extras(node);
    const auto leave_out = [&](const std::string& why) {
      warn(fmt::format("node {} ({}): its volume is left out: {}", number, node.name, why));
    };
    if (!named) return leave_out(named.error().message);
    if (!*named) return;
    const NamedVolume& volume = **named;
    const auto is_same = [&](const GltfMesh& mesh) {
      return mesh.volume == volume.file && canonical_text(mesh.fog) == canonical_text(volume.fog);
    };
    auto found = std::ranges::find_if(scene_.meshes, is_same);
    if (found == scene_.meshes.end()) {
      const auto extent = read_volume_extent(folder_ / volume.file, volume.fog);
      if (!extent) return leave_out(extent.error().message);
      GltfMesh mesh;
      mesh.name = node.name;
      const std::string stem = std::filesystem::path(volume.file).stem().string();
      mesh.asset_name = unique_name(stem, fmt::format("volume_{}", number));
      mesh.bounds = {vec3(extent->lower), vec3(extent->upper)};
      mesh.volume = volume.file;
      mesh.fog = volume.fog;
      scene_.meshes.push_back(std::move(mesh));
      found = std::prev(scene_.meshes.end());
    }
    const auto asset = static_cast<uint32_t>(found - scene_.meshes.begin());
    show(number, asset, index, worlds, {dmat4(1.0)}, {data_of_extras(node)});
  }

  /// The same of a mesh in a file of its own.
  void add_model(int number, uint32_t index, const std::vector<dmat4>& worlds) {
    const auto& node = model_.nodes[static_cast<size_t>(number)];
    const auto named = mesh_of_extras(node);
    const auto leave_out = [&](const std::string& why) {
      warn(fmt::format("node {} ({}): its mesh is left out: {}", number, node.name, why));
    };
    if (!named) return leave_out(named.error().message);
    if (!*named) return;
    const auto is_same = [&](const GltfMesh& mesh) {
      return mesh.model == (*named)->file && mesh.scheme == (*named)->scheme;
    };
    auto found = std::ranges::find_if(scene_.meshes, is_same);
    if (found == scene_.meshes.end()) {
      const auto source = read_source(folder_ / (*named)->file);
      if (!source) return leave_out(source.error().message);
      GltfMesh mesh;
      mesh.name = node.name;
      const std::string stem = std::filesystem::path((*named)->file).stem().string();
      mesh.asset_name = unique_name(stem, fmt::format("mesh_of_node_{}", number));
      for (const uint32_t v : source->corner_position) mesh.bounds.extend(vec3(source->positions[v]));
      mesh.triangle_count = source->corner_count() - 2 * source->face_count();
      mesh.model = (*named)->file;
      mesh.scheme = (*named)->scheme;
      scene_.meshes.push_back(std::move(mesh));
      found = std::prev(scene_.meshes.end());
    }
    const auto asset = static_cast<uint32_t>(found - scene_.meshes.begin());
    show(number, asset, index, worlds, {dmat4(1.0)}, {data_of_extras(node)});
  }

  Result<void> add_instances(const tinygltf::Node& node, int number, uint32_t index, const std::vector<dmat4>& worlds) {
    FARFIELD_TRY_LET(auto transforms, instance_transforms(document_, node));
    FARFIELD_TRY_LET(const auto data, instance_data(document_, node, transforms.size()));
    if (node.skin >= 0) FARFIELD_TRY(move_to_skeleton(node, number, index, transforms));
    if (has_weights_of_its_own(document_, node)) warn(fmt::format("node {} ({}): {}", number, node.name, kOwnWeights));
    show(number, first_equal_mesh_[static_cast<size_t>(node.mesh)], index, worlds, transforms, data);
    return {};
  }

  /// Instances of an asset at a node: once for each transform, with the data of the same number.
  void show(int number, uint32_t asset, uint32_t index, const std::vector<dmat4>& worlds,
            const std::vector<dmat4>& transforms, const std::vector<InstanceData>& data) {
    const std::string& name = model_.nodes[static_cast<size_t>(number)].name;
    const dmat4& world = worlds[index];
    const auto first_seen = [&](const dmat4& in_node) -> std::optional<dmat4> {
      if (is_invertible(world * in_node)) return world * in_node;
      for (const double seconds : times_to_look_at(index)) {
        const dmat4 then = world_matrix(scene_, index, seconds) * in_node;
        if (is_invertible(then)) return then;
      }
      return std::nullopt;
    };
    size_t singular = 0;
    for (size_t i = 0; i < transforms.size(); ++i) {
      const mat4x3 in_node = to_affine(transforms[i]);
      const auto seen = first_seen(to_square(in_node));
      if (seen) {
        scene_.instances.push_back({asset, mat4x3(1), name, index, data[i]});
        scene_.in_node.push_back(in_node);
        places_.push_back(*seen);
      } else {
        ++singular;
      }
    }
    if (singular > 0) warn(fmt::format("node {} ({}): its transform is singular; left out", number, name));
  }

  /// A skinned mesh goes with a joint instead of with its node.
  Result<void> move_to_skeleton(const tinygltf::Node& node, int number, uint32_t& index,
                                std::vector<dmat4>& transforms) {
    FARFIELD_TRY_LET(const auto place, skin_place(document_, node));
    warn(fmt::format("node {} ({}): {}", number, node.name, place ? kSkinned : kBrokenSkin));
    const int32_t joint = place ? scene_index_[static_cast<size_t>(place->joint)] : -1;
    if (joint < 0) return {};  // or outside of the scene: it stands where its node is
    index = static_cast<uint32_t>(joint);
    for (dmat4& transform : transforms) transform = place->in_joint * transform;
    return {};
  }

  bool moves(uint32_t node) const {
    for (auto n = static_cast<int32_t>(node); n >= 0; n = scene_.nodes[static_cast<size_t>(n)].parent) {
      if (!scene_.nodes[static_cast<size_t>(n)].channels.empty()) return true;
    }
    return false;
  }

  /// Chooses the origin, the middle of all instances or zero, and puts them where they are from there.
  void place_instances() {
    dvec3 lower(INFINITY), upper(-INFINITY);
    for (size_t i = 0; i < places_.size(); ++i) {
      const Box3& bounds = scene_.meshes[scene_.instances[i].mesh].bounds;
      if (bounds.is_empty()) continue;
      for (int corner = 0; corner < 8; ++corner) {
        const dvec3 point(places_[i] * dvec4(corner_of(bounds, corner), 1));
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
      }
    }
    const vec3 middle(0.5 * (lower + upper));  // a float, so that those who have floats can add it without loss
    if (is_far_for_its_size(lower, upper) && is_finite(middle)) scene_.origin_world = dvec3(middle);
    for (size_t i = 0; i < places_.size(); ++i)
      scene_.instances[i].to_world = to_affine(places_[i], scene_.origin_world);
  }

  /// The keys of a node and its ancestors, and the times halfway between them, in order.
  std::set<double> times_to_look_at(uint32_t node) const {
    std::set<double> keys;
    for (auto n = static_cast<int32_t>(node); n >= 0; n = scene_.nodes[static_cast<size_t>(n)].parent) {
      for (const uint32_t channel : scene_.nodes[static_cast<size_t>(n)].channels) {
        keys.insert(scene_.channels[channel].times.begin(), scene_.channels[channel].times.end());
      }
    }
    std::set<double> times = keys;
    for (auto key = keys.begin(); key != keys.end() && std::next(key) != keys.end(); ++key) {
      times.insert(0.5 * (*key + *std::next(key)));
    }
    return times;
  }

  void add_camera(const tinygltf::Node& node, uint32_t index, const dmat4& world) {
    const auto& source = model_.cameras[static_cast<size_t>(node.camera)];
    GltfCamera camera;
    camera.name = node.name.empty() ? source.name : node.name;
    camera.node = index;
    camera.is_orthographic = source.type == "orthographic";
    if (camera.is_orthographic) {
      camera.half_width = static_cast<float>(source.orthographic.xmag);
      camera.half_height = static_cast<float>(source.orthographic.ymag);
      camera.z_near = static_cast<float>(source.orthographic.znear);
    } else {
      camera.yfov_rad = static_cast<float>(source.perspective.yfov);
      camera.aspect = static_cast<float>(source.perspective.aspectRatio);
      camera.z_near = static_cast<float>(source.perspective.znear);
    }
    const bool is_good = camera.is_orthographic ? std::isnormal(camera.half_width) && std::isnormal(camera.half_height)
                                                : camera.yfov_rad > 0 && camera.yfov_rad < kPi;
    if (!is_good || !is_invertible(world)) {
      warn(fmt::format("camera {}: its angle, size or transform is not usable; left out", camera.name));
      return;
    }
    camera.half_width = std::abs(camera.half_width);
    camera.half_height = std::abs(camera.half_height);
    if (!(camera.aspect > 0) || !std::isfinite(camera.aspect)) camera.aspect = 0;
    if (!(camera.z_near > 0) || !std::isfinite(camera.z_near)) camera.z_near = 0;
    place(camera, world, scene_.origin_world);
    scene_.cameras.push_back(std::move(camera));
  }

  void add_light(const tinygltf::Node& node, const tinygltf::Value& extension, uint32_t index, const dmat4& world) {
    const auto number = extension_number(extension, "light");
    if (!number || *number < 0 || *number >= static_cast<double>(model_.lights.size()) || !is_invertible(world)) {
      warn(fmt::format("light of node {}: no such light, or a singular transform; left out", node.name));
      return;
    }
    const auto& source = model_.lights[static_cast<size_t>(*number)];
    GltfLight light;
    light.type = source.type == "point"  ? GltfLight::Type::Point
                 : source.type == "spot" ? GltfLight::Type::Spot
                                         : GltfLight::Type::Directional;
    light.name = node.name.empty() ? source.name : node.name;
    if (source.color.size() == 3) light.color = vec3(source.color[0], source.color[1], source.color[2]);
    light.intensity = static_cast<float>(source.intensity);
    light.position = vec3(dvec3(world[3]) - scene_.origin_world);
    light.direction = vec3(glm::normalize(-dvec3(world[2])));
    light.inner_cone_rad = static_cast<float>(source.spot.innerConeAngle);
    light.outer_cone_rad = static_cast<float>(source.spot.outerConeAngle);
    light.node = index;
    if (moves(index)) warn(fmt::format("light {}: it is animated; it stays where it is at time 0", light.name));
    if (!is_finite(light.color) || !std::isfinite(light.intensity) || min_component(light.color) < 0 ||
        light.intensity < 0) {
      warn(fmt::format("light {}: colour or intensity is not usable; left out", light.name));
      return;
    }
    scene_.lights.push_back(std::move(light));
  }

  const GltfDocument& document_;
  const tinygltf::Model& model_;
  const std::filesystem::path folder_;  ///< of the file
  const AssemblyRule rule_;
  GltfScene scene_;
  std::vector<uint32_t> first_equal_mesh_;
  Assemblies assemblies_;
  std::vector<int32_t> scene_index_;  ///< of each node of the file, or -1 when it is not in the scene
  std::vector<dmat4> places_;         ///< of the instances, in the file's coordinates
  std::set<std::string> taken_names_;
};

}  // namespace

GltfCamera GltfScene::camera_at(size_t index, double seconds) const {
  GltfCamera camera = cameras[index];
  place(camera, world_matrix(*this, camera.node, seconds), origin_world);
  return camera;
}

bool GltfScene::do_instances_move() const {
  std::vector<bool> moves;
  for (const GltfNode& node : nodes)
    moves.push_back(!node.channels.empty() || (node.parent >= 0 && moves[static_cast<size_t>(node.parent)]));
  return std::ranges::any_of(instances, [&](const GltfInstance& instance) { return moves[instance.node]; });
}

std::vector<GltfInstance> GltfScene::instances_at(double seconds) const {
  std::vector<GltfInstance> placed;
  std::vector<dmat4> of_nodes;
  place_at(seconds, placed, of_nodes);
  return placed;
}

void GltfScene::place_at(double seconds, std::vector<GltfInstance>& placed, std::vector<dmat4>& of_nodes) const {
  placed = instances;
  if (in_node.empty()) return;
  set_world_matrices(*this, seconds, of_nodes);
  size_t count = 0;
  for (size_t i = 0; i < instances.size(); ++i) {
    const dmat4 to_world = of_nodes[instances[i].node] * to_square(in_node[i]);
    if (!is_invertible(to_world)) continue;
    if (count != i) placed[count] = instances[i];
    placed[count++].to_world = to_affine(to_world, origin_world);
  }
  placed.resize(count);
}

Box3 GltfScene::bounds_world() const {
  Box3 box;
  for (const GltfInstance& instance : instances) {
    const Box3& local = meshes[instance.mesh].bounds;
    if (local.is_empty()) continue;
    for (int i = 0; i < 8; ++i) box.extend(instance.to_world * vec4(local.corner(i), 1));
  }
  return box;
}

const char* name_of(AssemblyRule rule) {
  return rule == AssemblyRule::None ? "none" : rule == AssemblyRule::Marked ? "marked" : "repeated";
}

Result<AssemblyRule> parse_assembly_rule(const std::string& name) {
  for (const auto rule : {AssemblyRule::None, AssemblyRule::Marked, AssemblyRule::Repeated})
    if (name == name_of(rule)) return rule;
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is none of none, marked, repeated", name));
}

Result<GltfScene> read_gltf_scene(const std::filesystem::path& path, AssemblyRule assemblies) {
  FARFIELD_TRY_LET(const auto bytes, read_file(path));
  FARFIELD_TRY_LET(const auto document, open_gltf(bytes, path));
  return SceneReader(document, path.parent_path(), assemblies).read();
}

}  // namespace farfield
