// SPDX-License-Identifier: Apache-2.0
#include "python/materials.h"

#include <pybind11/stl.h>

#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <type_traits>

namespace farfield::python {
namespace {

using glm::vec3;

vec3 to_vec3(const py::handle& value) {
  const auto v = value.cast<std::array<float, 3>>();
  return {v[0], v[1], v[2]};
}

template <typename Value>
void assign(Value& to, const py::handle& value) {
  if constexpr (std::is_same_v<Value, vec3>) {
    to = to_vec3(value);
  } else {
    to = value.cast<Value>();
  }
}

std::string text_of(const py::handle& value) { return py::repr(value).cast<std::string>(); }

/// What a field does with its value, by the field's name.
template <typename Struct>
using Fields = std::map<std::string, std::function<void(Struct&, const py::handle&)>>;

template <typename Struct, typename Value>
typename Fields<Struct>::mapped_type field(Value Struct::*member) {
  return [member](Struct& out, const py::handle& value) { assign(out.*member, value); };
}

template <typename Struct>
void read_fields(const py::dict& values, const Fields<Struct>& fields, const char* what, Struct& out) {
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    const auto found = fields.find(name);
    if (found == fields.end()) {
      std::string known;
      for (const auto& [other, unused] : fields) known += (known.empty() ? "" : ", ") + other;
      throw py::value_error(std::string(what) + " has no '" + name + "'; there are: " + known);
    }
    try {
      found->second(out, value);
    } catch (const py::cast_error&) {
      throw py::value_error(std::string(what) + ": '" + name + "' cannot be " + text_of(value));
    }
  }
}

template <typename Choice>
Choice choose(const py::handle& value, const std::map<std::string, Choice>& choices) {
  const auto found = choices.find(value.cast<std::string>());
  if (found == choices.end()) throw py::cast_error("no such choice");
  return found->second;
}

void set_image(BakeTexture& texture, const py::handle& value, KeptArrays& arrays) {
  if (py::isinstance<py::str>(value)) {
    texture.file = value.cast<std::string>();
    return;
  }
  auto pixels = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!pixels || pixels.ndim() != 3 || pixels.shape(2) != 4) {
    PyErr_Clear();
    throw py::cast_error("not an image");
  }
  texture.height = static_cast<int>(pixels.shape(0));
  texture.width = static_cast<int>(pixels.shape(1));
  texture.pixels = {pixels.data(), static_cast<size_t>(pixels.shape(0) * pixels.shape(1))};
  arrays.push_back(std::move(pixels));
}

const std::map<std::string, BakeMaterial::Alpha> kAlphaModes = {{"opaque", BakeMaterial::Alpha::Opaque},
                                                                {"mask", BakeMaterial::Alpha::Mask},
                                                                {"blend", BakeMaterial::Alpha::Blend}};
const std::map<std::string, BakeTexture::Wrap> kWraps = {
    {"repeat", BakeTexture::Wrap::Repeat}, {"clamp", BakeTexture::Wrap::Clamp}, {"mirror", BakeTexture::Wrap::Mirror}};

Fields<BakeMaterial> material_fields(KeptArrays& arrays) {
  using M = BakeMaterial;
  Fields<M> fields = {{"name", field(&M::name)},
                      {"base_color", field(&M::base_color)},
                      {"alpha", field(&M::alpha)},
                      {"alpha_cutoff", field(&M::alpha_cutoff)},
                      {"metallic", field(&M::metallic)},
                      {"roughness", field(&M::roughness)},
                      {"specular_f0", field(&M::specular_f0)},
                      {"diffuse_transmission", field(&M::diffuse_transmission)},
                      {"diffuse_transmission_color", field(&M::diffuse_transmission_color)},
                      {"thin_transmission", field(&M::thin_transmission)},
                      {"emission", field(&M::emission)},
                      {"normal_scale", field(&M::normal_scale)},
                      {"height_gain", field(&M::height_gain)},
                      {"height_base", field(&M::height_base)},
                      {"alpha_mode", [](M& m, const py::handle& value) { m.alpha_mode = choose(value, kAlphaModes); }}};
  const std::pair<const char*, BakeTexture M::*> textures[] = {
      {"base_color", &M::base_color_texture}, {"roughness", &M::roughness_texture}, {"alpha", &M::alpha_texture},
      {"normal", &M::normal_texture},         {"emission", &M::emission_texture},   {"height", &M::height_texture}};
  for (const auto& [name, texture] : textures) {
    fields[std::string(name) + "_texture"] = [texture, &arrays](M& m, const py::handle& value) {
      set_image(m.*texture, value, arrays);
    };
    fields[std::string(name) + "_wrap"] = [texture](M& m, const py::handle& value) {
      (m.*texture).wrap_u = (m.*texture).wrap_v = choose(value, kWraps);
    };
  }
  return fields;
}

MaterialSample to_sample(const py::object& answer) {
  using S = MaterialSample;
  static const Fields<S> fields = {{"diffuse", field(&S::diffuse)},     {"specular", field(&S::specular)},
                                   {"roughness", field(&S::roughness)}, {"transmission", field(&S::transmission)},
                                   {"opacity", field(&S::opacity)},     {"normal", field(&S::normal)},
                                   {"emission", field(&S::emission)}};
  if (!py::isinstance<py::dict>(answer)) {
    throw py::value_error("a material function returns a dictionary, not " + text_of(answer));
  }
  S sample;
  read_fields(py::reinterpret_borrow<py::dict>(answer), fields, "a material sample", sample);
  return sample;
}

/// A function that copies of a std::function share. They are made and dropped without the GIL: of the pointer, whose
/// last one takes it.
std::shared_ptr<py::function> share(py::function function) {
  return {new py::function(std::move(function)), [](py::function* f) {
            const py::gil_scoped_acquire gil;
            delete f;
          }};
}

template <typename T>
py::array_t<T> column_of(const MaterialQuery* queries, size_t count, T MaterialQuery::*member) {
  py::array_t<T> column(static_cast<py::ssize_t>(count));
  for (size_t i = 0; i < count; ++i) column.mutable_data()[i] = queries[i].*member;
  return column;
}

template <int N>
py::array_t<float> column_of(const MaterialQuery* queries, size_t count, glm::vec<N, float> MaterialQuery::*member) {
  py::array_t<float> column({static_cast<py::ssize_t>(count), py::ssize_t{N}});
  for (size_t i = 0; i < count; ++i) {
    for (int k = 0; k < N; ++k) column.mutable_data()[N * i + static_cast<size_t>(k)] = (queries[i].*member)[k];
  }
  return column;
}

template <int N>
py::tuple to_tuple(const glm::vec<N, float>& v) {
  py::tuple out(N);
  for (int i = 0; i < N; ++i) out[static_cast<size_t>(i)] = v[i];
  return out;
}

}  // namespace

BakeMaterial to_material(const py::dict& values, KeptArrays& arrays) {
  BakeMaterial material;
  read_fields(values, material_fields(arrays), "a material", material);
  return material;
}

bool takes_batches(const py::function& function) { return function.attr("batched").cast<bool>(); }

MaterialFunction to_material_function(py::function function, LongCall& call) {
  if (takes_batches(function)) {
    return [batch = to_material_batch(std::move(function), call)](const MaterialQuery& query) {
      MaterialSample sample;
      batch(&query, &sample, 1);
      return sample;
    };
  }
  return [shared = share(std::move(function)), &call](const MaterialQuery& query) {
    MaterialSample sample;
    call.call_python([&] {
      try {
        sample = to_sample((*shared)(query));
      } catch (const py::builtin_exception& unfit) {
        unfit.set_error();
        throw py::error_already_set();
      }
    });
    return sample;
  };
}

MaterialBatchFunction to_material_batch(py::function function, LongCall& call) {
  return [shared = share(std::move(function)), &call](const MaterialQuery* queries, MaterialSample* samples,
                                                      size_t count) {
    call.call_python([&] {
      const auto column = [&](auto member) { return column_of(queries, count, member); };
      using Q = MaterialQuery;
      const py::object answer =
          (*shared)(count, column(&Q::material), column(&Q::face), column(&Q::uv), column(&Q::duv_dx),
                    column(&Q::duv_dy), column(&Q::color), column(&Q::opacity_only));
      const auto rows = answer.cast<py::array_t<float, py::array::c_style | py::array::forcecast>>();
      constexpr size_t kNumbers = sizeof(MaterialSample) / sizeof(float);  // farfield/_arrays.py has their order
      static_assert(kNumbers == 17 && std::is_trivially_copyable_v<MaterialSample>);
      if (static_cast<size_t>(rows.size()) != kNumbers * count) throw py::value_error("not a row of numbers per place");
      std::memcpy(static_cast<void*>(samples), rows.data(), count * sizeof(MaterialSample));
    });
  };
}

void define_materials(py::module_& module) {
  using Q = MaterialQuery;
  py::class_<Q>(module, "MaterialQuery", "A place on a surface of the source, as a material function is asked for it.")
      .def_readonly("material", &Q::material, "The id that the face carries.")
      .def_readonly("face", &Q::face, "Number of the face, in the order in which the source has them.")
      .def_readonly("opacity_only", &Q::opacity_only, "Nothing but the answer's opacity will be looked at.")
      .def_property_readonly(
          "uv", [](const Q& q) { return to_tuple(q.uv); }, "v points down the image; NaN where there are none.")
      .def_property_readonly(
          "duv_dx", [](const Q& q) { return to_tuple(q.duv_dx); }, "Half-axis of the footprint in uv.")
      .def_property_readonly(
          "duv_dy", [](const Q& q) { return to_tuple(q.duv_dy); }, "The other half-axis.")
      .def_property_readonly(
          "color", [](const Q& q) { return to_tuple(q.color); }, "Vertex colour, linear RGBA.");
}

}  // namespace farfield::python
