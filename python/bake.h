// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace farfield::python {

/// bake_meshes() and bake_file() of the module.
void define_bake(pybind11::module_& module);

}  // namespace farfield::python
