// SPDX-License-Identifier: Apache-2.0
// The parts of the module farfield_textures: see TextureModule for what they do.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "base/texture_module.h"

namespace farfield {

Result<void> write_mip_map(const std::string& path, std::span<const MipLevel> levels, int channels, bool as_bytes);
std::unique_ptr<TextureLookup> make_texture_lookup();

}  // namespace farfield
