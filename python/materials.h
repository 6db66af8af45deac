// SPDX-License-Identifier: Apache-2.0
// Materials as Python says them: dictionaries, and functions.
#pragma once

#include <pybind11/numpy.h>

#include <deque>

#include "farfield/bake.h"
#include "python/long_call.h"

namespace farfield::python {

/// Arrays that a BakeInput looks at.
using KeptArrays = std::deque<py::array>;

/// A dictionary with BakeMaterial's fields. Images are (height, width, 4) float32 or names of files; each
/// NAME_texture may have a NAME_wrap. Throws ValueError, naming an unknown or unfit field.
BakeMaterial to_material(const py::dict& fields, KeptArrays& arrays);

/// A MaterialFunction that asks a Python function: it gets a MaterialQuery and returns a dictionary with
/// MaterialSample's fields. `call` outlives it.
MaterialFunction to_material_function(py::function function, LongCall& call);

/// A MaterialBatchFunction that asks a Python function for many places in one call: it gets their number and arrays of
/// material, face, uv, duv_dx, duv_dy, color and opacity_only, and returns MaterialSample's numbers, a row per place.
MaterialBatchFunction to_material_batch(py::function function, LongCall& call);

/// Which of the two a function of farfield/_arrays.py is for.
bool takes_batches(const py::function& function);

void define_materials(py::module_& module);

}  // namespace farfield::python
