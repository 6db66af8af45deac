// SPDX-License-Identifier: Apache-2.0
// The parts of a level (PartPlacement) as rays see them: a scene for each part, and within the level's own scene one
// user geometry with a primitive for each place. Embree's own instances would take 300 bytes more each, and Debian's
// Embree has one level of them, which is the host's.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/embree.h"
#include "base/result.h"
#include "bvh/bvh_device.h"
#include "cache/level.h"

namespace farfield {

/// A geometry of some of a level's quads. Arrays, filter: as LevelScene::build().
EmbreeGeometry make_quads(BvhDevice& device, const LevelView& level, std::span<const Quad> quads, EmbreeFilter filter,
                          void* user);

/// The scenes of a level's parts. Does not move once it has made its geometry; any thread may trace it.
class PartScenes {
 public:
  /// Builds the parts' scenes. Arrays, filter, errors: as LevelScene::build().
  static Result<PartScenes> build(BvhDevice& device, const LevelView& level, const LoadTerms& terms,
                                  EmbreeFilter filter, void* user);

  /// A geometry with all places, for single rays. A hit has the geomID and primID of the part's scene (LevelScene says
  /// which quad that is), its normal in the part's space, and the number of the place as instID[0].
  EmbreeGeometry make_geometry(EmbreeDeviceRef device) const;
  /// What only the build of that geometry's scene needs: once it is committed, this gives it back.
  void forget_points();

  uint64_t bytes() const { return bytes_ + point_bytes_; }
  uint64_t most_held_bytes() const { return most_held_bytes_; }  ///< at the worst moment of the builds

 private:
  static void bounds_callback(const RTCBoundsFunctionArguments* args);
  static void intersect_callback(const RTCIntersectFunctionNArguments* args);
  static void occluded_callback(const RTCOccludedFunctionNArguments* args);

  ArrayView<PartPlacement> placements_;
  std::vector<EmbreeScene> scenes_;        ///< per part
  std::vector<std::vector<vec3>> points_;  ///< per part: its vertices, until forget_points()
  uint64_t bytes_ = 0, point_bytes_ = 0, most_held_bytes_ = 0;
};

}  // namespace farfield
