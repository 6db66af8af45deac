// SPDX-License-Identifier: Apache-2.0
#include "tests/support/small_assets.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include "base/base64.h"
#include "base/random.h"
#include "base/vec.h"
#include "tests/support/gltf_files.h"
#include "tests/support/random_unit.h"

namespace farfield::test {
namespace {

using LeafCorners = std::array<vec3, 4>;

/// Square leaves of side 0.12 in a ball of radius 0.9 around (0, 1.5, 0).
std::vector<LeafCorners> make_leaves(int count) {
  Rng rng(42);
  std::vector<LeafCorners> leaves;
  for (int i = 0; i < count; ++i) {
    const vec3 center = vec3(0.0f, 1.5f, 0.0f) + 0.9f * std::cbrt(rng.next()) * random_unit(rng);
    const Frame frame(random_unit(rng));
    const vec3 x = 0.06f * frame.x, y = 0.06f * frame.y;
    leaves.push_back({center - x - y, center + x - y, center + x + y, center - x + y});
  }
  return leaves;
}

/// The sides of a six-sided trunk from the ground to the middle of the crown.
std::vector<LeafCorners> make_trunk() {
  std::vector<LeafCorners> sides;
  const auto corner = [](int i, float y) {
    const float phi = kPi / 3.0f * static_cast<float>(i);
    return vec3(0.1f * std::cos(phi), y, 0.1f * std::sin(phi));
  };
  for (int i = 0; i < 6; ++i)
    sides.push_back({corner(i, 0.0f), corner(i, 1.5f), corner(i + 1, 1.5f), corner(i + 1, 0.0f)});
  return sides;
}

}  // namespace

void write_bush_obj(const std::filesystem::path& path, int leaves) {
  std::filesystem::path mtl = path;
  mtl.replace_extension(".mtl");
  std::ofstream(mtl) << "newmtl bark\nKd 0.3 0.2 0.1\nnewmtl light\nKd 0.2 0.5 0.1\nnewmtl dark\nKd 0.1 0.3 0.1\n";

  std::ofstream obj(path);
  obj << "mtllib " << mtl.filename().string() << "\n";
  int vertices = 0;
  const auto write_quad = [&](const LeafCorners& corners, const char* material) {
    for (const vec3& corner : corners) obj << fmt::format("v {} {} {}\n", corner.x, corner.y, corner.z);
    obj << fmt::format("usemtl {}\nf {} {} {} {}\n", material, vertices + 1, vertices + 2, vertices + 3, vertices + 4);
    vertices += 4;
  };
  for (const LeafCorners& side : make_trunk()) write_quad(side, "bark");
  int index = 0;
  for (const LeafCorners& leaf : make_leaves(leaves)) write_quad(leaf, index++ % 2 ? "light" : "dark");
}

void write_bush_scene(const std::filesystem::path& path, int leaves) {
  std::vector<float> positions;
  for (const LeafCorners& leaf : make_leaves(leaves))
    for (const int corner : {0, 1, 2, 0, 2, 3})
      for (int axis = 0; axis < 3; ++axis) positions.push_back(leaf[static_cast<size_t>(corner)][axis]);
  std::string buffer = raw(positions);
  const size_t times = buffer.size();
  buffer += raw<float>({0.0f, 1.0f});
  const size_t path_keys = buffer.size();
  buffer += raw<float>({0, 1.5f, 5.0f, 0, 1.5f, 80.0f});
  const size_t points = positions.size() / 3;

  // fmt's braces and JSON's do not go together: @ marks what is filled in.
  std::string text = R"({
  "asset": {"version": "2.0"}, "scene": 0,
  "extensionsUsed": ["KHR_lights_punctual"],
  "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3.0}]}},
  "scenes": [{"nodes": [0, 1, 2, 3]}],
  "nodes": [
    {"name": "left", "mesh": 0, "translation": [-1.2, 0, 0]},
    {"name": "right", "mesh": 0, "translation": [1.2, 0, 0], "scale": [0.8, 0.8, 0.8]},
    {"name": "camera", "camera": 0, "translation": [0, 1.5, 5]},
    {"name": "sun", "rotation": [-0.5, 0, 0, 0.8660254], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
  "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1}}],
  "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.1, 1], "metallicFactor": 0}}],
  "meshes": [{"name": "bush", "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
  "animations": [{"samplers": [{"input": 1, "output": 2}], "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}]}],
  "accessors": [
    {"bufferView": 0, "componentType": 5126, "count": @points, "type": "VEC3", "min": [-1, 0.5, -1], "max": [1, 2.5, 1]},
    {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
    {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
  "bufferViews": [
    {"buffer": 0, "byteOffset": 0, "byteLength": @mesh},
    {"buffer": 0, "byteOffset": @times, "byteLength": 8},
    {"buffer": 0, "byteOffset": @path, "byteLength": 24}],
  "buffers": [{"byteLength": @all, "uri": "data:application/octet-stream;base64,@data"}]
})";
  const auto fill = [&](const std::string& mark, const std::string& value) {
    text.replace(text.find(mark), mark.size(), value);
  };
  fill("@points", fmt::format("{}", points));
  fill("@mesh", fmt::format("{}", points * 12));
  fill("@times", fmt::format("{}", times));
  fill("@path", fmt::format("{}", path_keys));
  fill("@all", fmt::format("{}", buffer.size()));
  fill("@data", base64(buffer));
  std::ofstream(path) << text;
}

}  // namespace farfield::test
