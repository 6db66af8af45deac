// SPDX-License-Identifier: Apache-2.0
// The models that occur in products: scattering/channels.h.
#include "scattering/surface_bsdf_impl.h"

namespace farfield {

template class SurfaceModel<kSurfaceChannels>;
template class SurfaceModel<kFlatChannels>;

static_assert(sizeof(SurfaceBsdf) <= 160);
static_assert(sizeof(SurfaceModel<kDiffuse>) <= 64);

}  // namespace farfield
