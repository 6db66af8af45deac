// SPDX-License-Identifier: Apache-2.0
// All sets but 7, which scattering/surface_bsdf.cpp has.
#include "scattering/surface_bsdf_impl.h"

namespace farfield {

template class SurfaceModel<0>;
template class SurfaceModel<1>;
template class SurfaceModel<2>;
template class SurfaceModel<3>;
template class SurfaceModel<4>;
template class SurfaceModel<5>;
template class SurfaceModel<6>;

}  // namespace farfield
