// SPDX-License-Identifier: Apache-2.0
// A level on its way to a file. Internal to the room.
#pragma once

#include "cache/level.h"
#include "cache/manifest.h"

namespace farfield {

/// Valid while the level's file and the manifest live. The level is checked: LevelCheck::Values.
struct LevelOfAsset {
  const LevelView& level;
  const LevelEntry& entry;
  const Manifest& manifest;

  /// A position of the level in the source's space.
  dvec3 to_source(const vec3& position) const { return manifest.origin + manifest.rotation * dvec3(position); }
  /// Whether that is the position itself.
  bool is_in_place() const { return manifest.origin == dvec3(0.0) && manifest.rotation == glm::dmat3(1.0); }
};

/// "farfield 0.1.0": this one.
inline constexpr const char* kExportGenerator = "farfield " FARFIELD_VERSION;

}  // namespace farfield
