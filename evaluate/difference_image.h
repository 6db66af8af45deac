// SPDX-License-Identifier: Apache-2.0
// Two pictures side by side are hard to tell apart; their difference is not. Pure; any thread.
#pragma once

#include "path_tracer/image.h"

namespace farfield {

/// level - source, twofold, on mid-grey, as the eye sees it: R, G, B, linear, for display. Both have one size and R, G,
/// B first.
Image difference_image(const Image& source, const Image& level);

}  // namespace farfield
