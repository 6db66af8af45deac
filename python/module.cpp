// SPDX-License-Identifier: Apache-2.0
// farfield._farfield: what farfield/__init__.py calls. Errors are raised as farfield.Error.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "cache/manifest.h"
#include "evaluate/evaluate.h"
#include "evaluate/evaluation_json.h"
#include "python/bake.h"
#include "python/long_call.h"
#include "python/materials.h"
#include "python/render.h"
#include "python/scene.h"
#include "tools/info_text.h"

namespace farfield::python {
namespace {

const char* name_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
      return "invalid argument";
    case ErrorCode::NotFound:
      return "not found";
    case ErrorCode::Io:
      return "io";
    case ErrorCode::BadFile:
      return "bad file";
    case ErrorCode::Unsupported:
      return "unsupported";
    case ErrorCode::OutOfBudget:
      return "out of budget";
    case ErrorCode::Cancelled:
      return "cancelled";
  }
  return "unknown";
}

std::string info(const std::string& folder) { return tool::info_json(folder, value_or_raise(read_manifest(folder))); }

std::string evaluate_asset(const std::string& folder, const std::string& source, const py::dict& fields,
                           const py::object& progress) {
  LongCall call(progress);
  EvaluateOptions options;
  options.asset = folder;
  options.source = source;
  options.other_source = fields["other_source"].cast<bool>();
  options.first_level = fields["first_level"].cast<uint32_t>();
  options.last_level = fields["last_level"].cast<uint32_t>();
  options.lights = value_or_raise(parse_lights(fields["lights"].cast<std::string>()));
  options.views = fields["views"].cast<int>();
  options.samples_per_pixel = fields["samples"].cast<int>();
  options.seed = fields["seed"].cast<uint64_t>();
  options.job = call.job();
  return to_json(call.run([&] { return evaluate(options); }));
}

}  // namespace

void raise(const Error& error) {
  const py::object type = py::module_::import("farfield._errors").attr("Error");
  const py::object value = type(error.message, name_of(error.code), error.warnings);
  PyErr_SetObject(type.ptr(), value.ptr());
  throw py::error_already_set();
}

}  // namespace farfield::python

PYBIND11_MODULE(_farfield, module) {
  using namespace farfield::python;
  module.attr("version") = FARFIELD_VERSION;
  define_materials(module);
  define_bake(module);
  define_render(module);
  define_scene(module);
  module.def("info", &info);
  module.def("evaluate", &evaluate_asset);
}
