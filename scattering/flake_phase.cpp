// SPDX-License-Identifier: Apache-2.0
// The model that occurs in products: scattering/channels.h.
#include "scattering/flake_phase_impl.h"

namespace farfield {

template class FlakeModel<kFlakeChannels>;

static_assert(sizeof(FlakePhase) <= 160);
static_assert(sizeof(FlakeModel<kDiffuse>) <= 80);

}  // namespace farfield
