// SPDX-License-Identifier: Apache-2.0
// Pictures of baked assets as arrays, by the path tracer of the tool.
#include "python/render.h"

#include <pybind11/stl.h>

#include <cmath>

#include "base/embree.h"
#include "base/parallel.h"
#include "base/result.h"
#include "path_tracer/integrator.h"
#include "python/materials.h"

namespace farfield::python {
namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// One asset in its place.
struct Placed {
  std::string folder;
  mat4x3 to_world{1.0f};
  MaterialFunction materials;
};

struct View {
  int width = 0, height = 0;
  std::optional<vec3> eye, target;
  vec3 up{0, 1, 0};
  float fov_y_rad = 0.7f;
};

/// (folder, 3 x 4 array, material function or None).
Placed to_placed(const py::tuple& fields, LongCall& call) {
  Placed placed;
  placed.folder = fields[0].cast<std::string>();
  const auto matrix = fields[1].cast<FloatArray>();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) placed.to_world[column][row] = matrix.at(row, column);
  if (!fields[2].is_none()) placed.materials = to_material_function(fields[2].cast<py::function>(), call);
  return placed;
}

std::optional<vec3> to_point(const py::object& value) {
  if (value.is_none()) return std::nullopt;
  const auto v = value.cast<std::array<float, 3>>();
  return vec3(v[0], v[1], v[2]);
}

/// None: sun and sky. Otherwise a constant (r, g, b), a picture (height, width, 3), or the name of one.
Environment to_environment(const py::object& light) {
  if (light.is_none()) return Environment::sun_sky(default_sun_sky());
  if (py::isinstance<py::str>(light)) return value_or_raise(Environment::from_file(light.cast<std::string>()));
  const auto values = light.cast<FloatArray>();
  if (values.ndim() == 1 && values.shape(0) == 3) {
    return Environment::constant(vec3(values.at(0), values.at(1), values.at(2)));
  }
  if (values.ndim() != 3 || values.shape(2) != 3) {
    throw py::value_error("light: None, (r, g, b), an array of shape (height, width, 3), or the name of a picture");
  }
  Image image(static_cast<int>(values.shape(1)), static_cast<int>(values.shape(0)), {"R", "G", "B"});
  std::copy(values.data(), values.data() + values.size(), image.values.begin());
  return value_or_raise(Environment::from_image(image));
}

Box3 bounds_in_world(const Runtime& runtime, AssetId asset, const mat4x3& to_world) {
  Box3 local, box;
  runtime.bounds(asset, local.lower, local.upper);
  for (int i = 0; i < 8; ++i) box.extend(to_world * vec4(local.corner(i), 1.0f));
  return box;
}

/// Without an eye everything is seen, from in front and a little above.
Camera to_camera(const View& view, const Box3& all) {
  const vec3 target = view.target.value_or(all.center());
  const float distance = 0.5f * glm::length(all.size()) / std::sin(0.5f * view.fov_y_rad);
  const vec3 eye = view.eye.value_or(target + distance * glm::normalize(vec3(0.0f, 0.25f, 1.0f)));
  return Camera::perspective(eye, target - eye, view.up, view.fov_y_rad, view.width, view.height);
}

Result<Image> render(const std::vector<Placed>& scene, const View& view, const Lights& lights,
                     const RuntimeOptions& options, const TraceOptions& trace, const Job& job) {
  Film film(view.width, view.height);
  FARFIELD_TRY_LET(const auto device, make_embree_device(thread_count()));
  FARFIELD_TRY_LET(const auto runtime, Runtime::create(device.get(), options));
  Box3 all;
  for (const Placed& placed : scene) {
    FARFIELD_TRY_LET(const auto asset, runtime->open_asset(placed.folder, placed.materials));
    FARFIELD_TRY(runtime->add_instance(asset, placed.to_world));
    all.extend(bounds_in_world(*runtime, asset, placed.to_world));
  }
  const Camera camera = to_camera(view, all);
  runtime->set_cameras({camera.tessellation()});
  FARFIELD_TRY(runtime->plan_frame());
  runtime->prefetch();
  FARFIELD_TRY_LET(const auto embree, make_scene(device.get(), *runtime));
  TraceScene traced;
  traced.embree = embree.get();
  traced.runtime = runtime.get();
  traced.lights = &lights;
  FARFIELD_TRY(path_trace(traced, camera, trace, film, job));
  return film.image();
}

FloatArray to_array(const Image& image, const std::vector<std::string>& channels) {
  std::vector<size_t> index;
  for (const std::string& name : channels) {
    const int found = image.find_channel(name);
    if (found < 0) {
      std::string known;
      for (const std::string& other : image.channels) known += (known.empty() ? "" : ", ") + other;
      throw py::value_error("there is no channel '" + name + "'; there are: " + known);
    }
    index.push_back(static_cast<size_t>(found));
  }
  FloatArray out({static_cast<size_t>(image.height), static_cast<size_t>(image.width), index.size()});
  float* to = out.mutable_data();
  for (size_t pixel = 0; pixel < image.values.size(); pixel += image.channel_count())
    for (const size_t channel : index) *to++ = image.values[pixel + channel];
  return out;
}

FloatArray render_scene(const py::list& scene, const py::dict& fields, const std::vector<std::string>& channels,
                        const py::object& light, const py::object& progress, const py::function& warn) {
  LongCall call(progress);
  std::vector<Placed> placed;
  for (const auto& one : scene) placed.push_back(to_placed(one.cast<py::tuple>(), call));
  View view;
  view.width = fields["width"].cast<int>();
  view.height = fields["height"].cast<int>();
  view.eye = to_point(fields["eye"]);
  view.target = to_point(fields["target"]);
  view.up = *to_point(fields["up"]);
  view.fov_y_rad = fields["fov_y"].cast<float>();
  TraceOptions trace;
  trace.samples_per_pixel = fields["samples"].cast<int>();
  trace.seed = fields["seed"].cast<uint64_t>();
  trace.max_depth = fields["max_depth"].cast<int>();
  trace.transparent = fields["transparent"].cast<bool>();
  RuntimeOptions options;
  options.budget_bytes = fields["budget_bytes"].cast<uint64_t>();
  options.pixel_error = fields["pixel_error"].cast<float>();
  if (!fields["level"].is_none()) options.forced_lambda = fields["level"].cast<float>();
  options.messages = [&](Severity severity, const std::string& text) {
    if (severity != Severity::Info) call.call_python([&] { warn(text); });
  };
  Lights lights;
  lights.environment = to_environment(light);
  const int threads = fields["threads"].cast<int>();
  const Image image = call.run([&] {
    const ThreadLimit limit(threads);
    return render(placed, view, lights, options, trace, call.job());
  });
  return to_array(image, channels);
}

}  // namespace

void define_render(py::module_& module) { module.def("render", &render_scene); }

}  // namespace farfield::python
