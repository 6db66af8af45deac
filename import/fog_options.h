// SPDX-License-Identifier: Apache-2.0
// What a caller says of a volume file that the file does not say itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/vec.h"

namespace farfield {

/// The largest of either sign: nearer to 1 all light would go straight on.
inline constexpr double kMostAnisotropy = 0.98;

/// Of a fibre whose normals are all but upright to it.
inline constexpr double kFibreRoughness = 0.1;

struct FogOptions {
  std::string density_grid{};    ///< name; empty: "density", or the only fog volume that there is
  double density_scale = 1;      ///< density 1 of the grid is this attenuation coefficient, in 1 / scene unit; > 0
  std::optional<vec3> albedo{};  ///< single scattering, linear RGB in [0, 1]; none: the file's, or kDefaultAlbedo
  double anisotropy = 0;         ///< g, the mean cosine of scattering, within kMostAnisotropy (Henyey-Greenstein)
  bool level_set = false;        ///< take a level set for the fog inside it; else it is refused
  double fibre_roughness = kFibreRoughness;  ///< what a fibre stops along itself by what it stops across; in [0, 1]
};

/// Of water droplets in daylight, about: bright, and no path goes on for ever.
inline constexpr float kDefaultAlbedo = 0.99f;

/// Equal texts mean equal volumes from equal files. Empty for the defaults.
std::string canonical_text(const FogOptions& options);

/// A number for those texts, 0 for the defaults.
uint64_t hash_of(const FogOptions& options);

}  // namespace farfield
