// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace farfield::python {

/// read_scene() of the module.
void define_scene(pybind11::module_& module);

}  // namespace farfield::python
