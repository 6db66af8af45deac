// SPDX-License-Identifier: Apache-2.0
// All sets but 7 | kSelfShadowing, which scattering/flake_phase.cpp has.
#include "scattering/flake_phase_impl.h"

namespace farfield {

#define FARFIELD_FLAKE_MODELS(shadowing)      \
  template class FlakeModel<0 | (shadowing)>; \
  template class FlakeModel<1 | (shadowing)>; \
  template class FlakeModel<2 | (shadowing)>; \
  template class FlakeModel<3 | (shadowing)>; \
  template class FlakeModel<4 | (shadowing)>; \
  template class FlakeModel<5 | (shadowing)>; \
  template class FlakeModel<6 | (shadowing)>;
FARFIELD_FLAKE_MODELS(0)
FARFIELD_FLAKE_MODELS(kSelfShadowing)
template class FlakeModel<7>;

}  // namespace farfield
