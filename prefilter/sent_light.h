// SPDX-License-Identifier: Apache-2.0
// One ray of the light that goes on from what a line sees first, in the geometry and in its medium: with the lobes that
// are rendered, so that the two can be compared.
#pragma once

#include <optional>

#include "prefilter/line_scene.h"

namespace farfield {

/// How far from the face that it leaves light starts.
inline float sent_clearance(const LineScene& scene) { return 1e-3f * static_cast<float>(scene.lattice().voxel_size); }

/// Light that goes on from what a line sees first.
struct SentOn {
  vec3 direction{0.0f};
  float weight = 0;  ///< how much light
  vec3 color{0.0f};  ///< of the base's light: its weight by channel
  vec3 light{0.0f};  ///< the weight by channel, of the highlight, too
  enum class Kind { Highlight, Reflected, Through } kind = Kind::Highlight;
  bool is_lost = false;  ///< into the surface itself
  float contrast = 0;  ///< of reflected light, how much it is on the viewer's side: L less its mean; the phase's cosine
  float slope = 0;     ///< what the hot spot's strength, or the highlight's lean, multiplies, to first order
  vec3 side{0.0f};     ///< the normal on the line's side
  vec3 opening{0.0f};  ///< what the open side multiplies: scattering/open_side.h, to first order
};

/// From the line's hit. Nothing for black faces and those too small to have a normal.
std::optional<SentOn> scattered_by_source(const LineScene& scene, const SeenLine& line, SplitMix& random);

/// From a collision of the line in a voxel. Nothing for black ones.
std::optional<SentOn> scattered_by_medium(const Voxel& voxel, const SeenLine& line, SplitMix& random);

}  // namespace farfield
