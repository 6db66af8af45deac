// SPDX-License-Identifier: Apache-2.0
// All sets but 7 and 7 | kNormals, which scattering/surface_bsdf.cpp has.
#include "scattering/surface_bsdf_impl.h"

namespace farfield {

#define FARFIELD_SURFACE_MODELS(normals)      \
  template class SurfaceModel<0 | (normals)>; \
  template class SurfaceModel<1 | (normals)>; \
  template class SurfaceModel<2 | (normals)>; \
  template class SurfaceModel<3 | (normals)>; \
  template class SurfaceModel<4 | (normals)>; \
  template class SurfaceModel<5 | (normals)>; \
  template class SurfaceModel<6 | (normals)>;
FARFIELD_SURFACE_MODELS(0)
FARFIELD_SURFACE_MODELS(kNormals)

}  // namespace farfield
