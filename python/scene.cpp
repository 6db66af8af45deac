// SPDX-License-Identifier: Apache-2.0
// What stands where in a glTF scene, as arrays: for hosts that place baked assets themselves.
#include "python/scene.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "import/gltf_scene.h"
#include "python/long_call.h"

namespace farfield::python {
namespace {

py::list assets_of(const GltfScene& scene) {
  py::list assets;
  for (const GltfMesh& mesh : scene.meshes) {
    py::dict asset;
    asset["name"] = mesh.name;
    asset["folder"] = mesh.asset_name + ".farfield";
    asset["node"] = mesh.node < 0 ? py::object(py::none()) : py::int_(mesh.node);
    asset["triangles"] = mesh.triangle_count;
    assets.append(asset);
  }
  return assets;
}

py::dict instances_of(const std::vector<GltfInstance>& placed) {
  const size_t count = placed.size();
  py::array_t<uint32_t> asset(count);
  py::array_t<float> to_world({count, size_t{3}, size_t{4}}), tint({count, size_t{3}});
  py::array_t<uint64_t> id(count);
  py::list names;
  for (size_t i = 0; i < count; ++i) {
    const GltfInstance& instance = placed[i];
    asset.mutable_at(i) = instance.mesh;
    id.mutable_at(i) = instance.data.id;
    for (int row = 0; row < 3; ++row) {
      tint.mutable_at(i, row) = instance.data.tint[row];
      for (int column = 0; column < 4; ++column) to_world.mutable_at(i, row, column) = instance.to_world[column][row];
    }
    names.append(instance.name);
  }
  py::dict out;
  out["asset"] = asset;
  out["to_world"] = to_world;
  out["id"] = id;
  out["tint"] = tint;
  out["name"] = names;
  return out;
}

py::dict read_scene(const std::string& path, const std::string& assemblies, double frame) {
  const GltfScene scene = value_or_raise(read_gltf_scene(path, value_or_raise(parse_assembly_rule(assemblies))));
  py::dict out;
  out["assets"] = assets_of(scene);
  out["instances"] = instances_of(scene.instances_at(scene.seconds_of_frame(frame)));
  out["origin"] = py::make_tuple(scene.origin_world.x, scene.origin_world.y, scene.origin_world.z);
  out["warnings"] = scene.warnings;
  return out;
}

}  // namespace

void define_scene(py::module_& module) { module.def("read_scene", &read_scene); }

}  // namespace farfield::python
