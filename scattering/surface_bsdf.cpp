// SPDX-License-Identifier: Apache-2.0
// The model that occurs in products: scattering/channels.h.
#include "scattering/surface_bsdf_impl.h"

namespace farfield {

template class SurfaceModel<kSurfaceChannels>;

static_assert(sizeof(SurfaceBsdf) <= 176);
static_assert(sizeof(SurfaceModel<kDiffuse>) <= 64);

}  // namespace farfield
