// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace farfield::python {

/// render() of the module.
void define_render(pybind11::module_& module);

}  // namespace farfield::python
