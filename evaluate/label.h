// SPDX-License-Identifier: Apache-2.0
// Small text in pictures, with a font of our own, so that contact sheets look the same on every machine; and what is
// behind it.
#pragma once

#include <string_view>

#include "base/vec.h"
#include "path_tracer/image.h"

namespace farfield {

inline constexpr int kGlyphWidth = 6;              ///< pixels from one letter to the next
inline constexpr int kGlyphHeight = 8;             ///< pixels from one line to the next
inline constexpr float kSheetBackground = 0.214f;  ///< linear grey behind text and pictures; mid-grey on the screen

/// Writes `text` with its upper left corner at (x, y) into the first three channels, in linear `color`. Letters are
/// drawn as capitals; what the font lacks is a blank. Pixels outside the image are dropped.
void draw_text(Image& image, int x, int y, std::string_view text, const vec3& color);

}  // namespace farfield
