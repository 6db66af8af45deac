// SPDX-License-Identifier: Apache-2.0
// Images made of images: what MTL says in other words than glTF.
#pragma once

#include "import/source_mesh.h"

namespace farfield {

// A channel is r, g, b, or l (their mean); anything else is r. Images are read as TextureUse::Data.

/// Channels of two images as glTF packs them: g from the one, b from the other, 1 where one is missing (null). As large
/// as the larger one.
Texture pack_metallic_roughness(const Texture* roughness, char roughness_channel, const Texture* metallic,
                                char metallic_channel);

/// White, with a channel as alpha.
Texture mask_of_channel(const Texture& image, char channel);

/// A normal map of heights: white is `scale` texels above black, which leaves the slope that most tools show; MTL gives
/// no unit. Central differences; beyond its edges the image continues as `wrap` says.
Texture normals_of_heights(const Texture& heights, char channel, float scale, Wrap wrap);

/// Whether an image has the colours of a tangent-space normal map: mostly light blue.
bool looks_like_normals(const Texture& image);

}  // namespace farfield
