// SPDX-License-Identifier: Apache-2.0
// farfield/bake.h for Python. farfield/__init__.py has brought all arrays into one shape.
#include "python/bake.h"

#include <pybind11/stl.h>

#include <array>
#include <utility>

#include "farfield/bake.h"
#include "python/materials.h"

namespace farfield::python {
namespace {

template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// An array's rows of N numbers; none for None.
template <int N, typename T>
BakeRows<N> to_rows(const py::handle& value, KeptArrays& arrays) {
  if (value.is_none()) return {};
  auto array = value.cast<Array<T>>();
  const BakeRows<N> rows(array.data(), static_cast<size_t>(array.size() / N));
  arrays.push_back(std::move(array));
  return rows;
}

/// (values, is per point); None: the mesh does not have it.
template <int N>
BakeAttribute<N> to_attribute(const py::handle& value, KeptArrays& arrays) {
  if (value.is_none()) return {};
  const auto pair = value.cast<py::tuple>();
  return {to_rows<N, float>(pair[0], arrays), pair[1].cast<bool>() ? BakePer::Point : BakePer::Corner};
}

BakeMesh to_mesh(const py::dict& fields, KeptArrays& arrays) {
  BakeMesh mesh;
  mesh.name = fields["name"].cast<std::string>();
  mesh.points = to_rows<3, double>(fields["points"], arrays);
  mesh.corners = to_rows<1, int64_t>(fields["corners"], arrays);
  mesh.counts = to_rows<1, int64_t>(fields["counts"], arrays);
  mesh.materials = to_rows<1, int64_t>(fields["material_ids"], arrays);
  mesh.uv = to_attribute<2>(fields["uv"], arrays);
  mesh.normals = to_attribute<3>(fields["normals"], arrays);
  mesh.colors = to_attribute<4>(fields["colors"], arrays);
  if (!fields["scheme"].is_none()) {
    mesh.scheme = static_cast<BakeSubdivision::Scheme>(fields["scheme"].cast<uint8_t>());
  }
  mesh.creases = to_rows<2, int64_t>(fields["creases"], arrays);
  mesh.crease_sharpness = to_rows<1, double>(fields["crease_sharpness"], arrays);
  mesh.sharp_points = to_rows<1, int64_t>(fields["sharp_points"], arrays);
  mesh.point_sharpness = to_rows<1, double>(fields["point_sharpness"], arrays);
  return mesh;
}

/// A 3 x 4 array.
glm::dmat4x3 to_matrix(const py::handle& rows) {
  const auto array = rows.cast<Array<double>>();
  glm::dmat4x3 matrix;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) matrix[column][row] = array.at(row, column);
  return matrix;
}

/// (mesh, its transform).
BakeInstance to_instance(const py::tuple& pair) { return {pair[0].cast<uint32_t>(), to_matrix(pair[1])}; }

BakeDownsampling to_downsampling(const std::string& name) {
  constexpr std::pair<const char*, BakeDownsampling> kNames[] = {{"linear", BakeDownsampling::Linear},
                                                                 {"transp", BakeDownsampling::Transp},
                                                                 {"iso", BakeDownsampling::Iso},
                                                                 {"aniso", BakeDownsampling::Aniso},
                                                                 {"matched", BakeDownsampling::Matched}};
  for (const auto& [known, method] : kNames)
    if (name == known) return method;
  throw py::value_error("downsampling is linear, transp, iso, aniso or matched, not " + name);
}

BakeFog to_fog(const py::dict& fields) {
  BakeFog fog;
  fog.density_grid = fields["density_grid"].cast<std::string>();
  fog.density_scale = fields["density_scale"].cast<double>();
  if (!fields["albedo"].is_none()) {
    const auto albedo = fields["albedo"].cast<std::array<float, 3>>();
    fog.albedo = glm::vec3(albedo[0], albedo[1], albedo[2]);
  }
  fog.anisotropy = fields["anisotropy"].cast<double>();
  fog.level_set = fields["level_set"].cast<bool>();
  fog.fibre_roughness = fields["fibre_roughness"].cast<double>();
  return fog;
}

/// Numbers as farfield/__init__.py has looked them up.
BakeSubdivision to_subdivision(const py::dict& fields) {
  BakeSubdivision subdivision;
  subdivision.scheme = static_cast<BakeSubdivision::Scheme>(fields["subdivide"].cast<uint8_t>());
  subdivision.boundary = static_cast<BakeSubdivision::Boundary>(fields["subdivide_boundary"].cast<uint8_t>());
  subdivision.uv = static_cast<BakeSubdivision::Uv>(fields["subdivide_uv"].cast<uint8_t>());
  subdivision.error = fields["subdivide_error"].cast<double>();
  subdivision.edge = fields["subdivide_edge"].cast<double>();
  subdivision.detail = fields["displace_detail"].cast<double>();
  return subdivision;
}

BakeSettings to_settings(const py::dict& fields, LongCall& call, bool has_progress) {
  BakeSettings settings;
  settings.finest_grid = fields["finest_grid"].cast<uint32_t>();
  settings.coarsest_grid = fields["coarsest_grid"].cast<uint32_t>();
  settings.rays_per_voxel = fields["rays_per_voxel"].cast<uint32_t>();
  settings.source_only = fields["source_only"].cast<bool>();
  settings.subdivision = to_subdivision(fields);
  settings.simplify = static_cast<BakeSimplify>(fields["simplify"].cast<uint8_t>());
  settings.threads = fields["threads"].cast<int>();
  settings.memory_limit_bytes = fields["memory_limit_bytes"].cast<uint64_t>();
  settings.fog = to_fog(fields);
  settings.downsampling = to_downsampling(fields["downsampling"].cast<std::string>());
  settings.cancel = &call.cancel();
  if (has_progress) settings.progress = [&call](double done, const std::string& stage) { call.report(done, stage); };
  return settings;
}

py::dict to_dict(const BakeSummary& summary) {
  using namespace py::literals;
  py::list levels, warnings;
  for (const BakedLevel& level : summary.levels) {
    levels.append(py::dict("level"_a = level.level, "grid"_a = level.grid, "resolution"_a = level.resolution,
                           "triangles"_a = level.triangles, "voxels"_a = level.voxels,
                           "bytes_disk"_a = level.file_bytes, "bytes_resident"_a = level.resident_bytes));
  }
  for (const std::string& warning : summary.warnings) warnings.append(warning);
  return py::dict("levels"_a = levels, "warnings"_a = warnings, "seconds"_a = summary.seconds,
                  "up_to_date"_a = summary.is_up_to_date);
}

py::dict bake_arrays(const std::string& folder, const std::string& name, const py::list& meshes,
                     const py::list& instances, const py::object& materials, const std::string& material_key,
                     const py::dict& settings, const py::object& progress) {
  LongCall call(progress);
  KeptArrays arrays;
  BakeInput input;
  input.name = name;
  for (const auto& mesh : meshes) input.meshes.push_back(to_mesh(mesh.cast<py::dict>(), arrays));
  for (const auto& instance : instances) input.instances.push_back(to_instance(instance.cast<py::tuple>()));
  if (py::isinstance<py::function>(materials)) {
    auto function = materials.cast<py::function>();
    if (takes_batches(function)) {
      input.material_batch_function = to_material_batch(std::move(function), call);
    } else {
      input.material_function = to_material_function(std::move(function), call);
    }
    input.material_key = material_key;
  } else {
    for (const auto& material : materials.cast<py::list>())
      input.materials.push_back(to_material(material.cast<py::dict>(), arrays));
  }
  const BakeSettings limits = to_settings(settings, call, !progress.is_none());
  return to_dict(call.run([&] { return bake_meshes(input, folder, limits); }));
}

/// density: (depth, height, width); channels: what else voxels have, a row of numbers for each, or None.
py::dict bake_density(const std::string& folder, const std::string& name, const Array<float>& density,
                      const py::dict& channels, const py::object& to_asset, const py::dict& settings,
                      const py::object& progress) {
  LongCall call(progress);
  KeptArrays arrays;
  BakeVolume volume;
  volume.name = name;
  volume.depth = static_cast<uint32_t>(density.shape(0));
  volume.height = static_cast<uint32_t>(density.shape(1));
  volume.width = static_cast<uint32_t>(density.shape(2));
  volume.density = BakeRows<1>(density.data(), static_cast<size_t>(density.size()));
  volume.albedo = to_rows<3, float>(channels["albedo"], arrays);
  volume.sggx = to_rows<6, float>(channels["sggx"], arrays);
  volume.fibre = to_rows<3, float>(channels["fibre"], arrays);
  volume.anisotropy = to_rows<1, float>(channels["anisotropy"], arrays);
  volume.self_shadowing = to_rows<1, float>(channels["self_shadowing"], arrays);
  volume.to_asset = to_matrix(to_asset);
  const BakeSettings limits = to_settings(settings, call, !progress.is_none());
  return to_dict(call.run([&] { return bake_volume(volume, folder, limits); }));
}

py::dict bake_source_file(const std::string& source, const std::string& folder, int mesh, const py::dict& settings,
                          const py::object& progress) {
  LongCall call(progress);
  const BakeSettings limits = to_settings(settings, call, !progress.is_none());
  return to_dict(call.run([&] { return bake_file(source, folder, limits, mesh); }));
}

}  // namespace

void define_bake(py::module_& module) {
  module.def("bake_meshes", &bake_arrays);
  module.def("bake_volume", &bake_density);
  module.def("bake_file", &bake_source_file);
}

}  // namespace farfield::python
