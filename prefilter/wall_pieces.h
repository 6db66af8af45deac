// SPDX-License-Identifier: Apache-2.0
// The pieces of a wall: where they are, and what rays see of them.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/vec.h"
#include "prefilter/ray_scene.h"
#include "prefilter/surface.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {

/// The same triangles in pieces: rays find their way through long planks ten times as fast.
Surface in_pieces(const Surface& wall, double longest);

/// The wall's triangles in pieces no longer than a cell, by the cell of their middle. Points are in cells.
class NearestPoint {
 public:
  NearestPoint(const Surface& wall, const dvec3& origin, double cell_size);
  /// The wall's nearest point to this one; itself if there is none within three cells.
  dvec3 to(const dvec3& point) const;

 private:
  struct Neighbour {
    ivec3 offset;
    double distance;
  };

  std::unordered_map<uint64_t, std::vector<TrianglePiece>> pieces_;
  std::vector<Neighbour> around_;  ///< cells around a corner, near ones first
};

/// What a ray meets, and what becomes of its light.
struct PieceSeen {
  const FaceMaterial* material = nullptr;
  vec3 normal{0.0f};     ///< unit, on the side that the ray came from; 0 of a piece without area
  bool escapes = false;  ///< whether light that goes on from there, cosine distributed, gets away at once
};

/// Looks at pieces from around them.
class PieceViewer {
 public:
  PieceViewer(const OpacityScene& pieces, double resolution)
      : pieces_(pieces), resolution_(static_cast<float>(resolution)) {}

  /// direction: unit.
  std::optional<PieceSeen> look(const vec3& origin, const vec3& direction, float far, SplitMix& random) const;

 private:
  const OpacityScene& pieces_;
  float resolution_;
};

/// Nothing of anything: what sums start from.
const FaceMaterial& no_material();

/// The share of a material's light that does not stay between the pieces when they catch a share `caught` of it: of
/// light that meets others of them, as much comes back as cluster_albedo() says where a share of `usual_escape` gets
/// away at once. Linear in `caught`, so that the noise of few rays does no harm.
vec3 kept_light(const FaceMaterial& m, float caught, float usual_escape);

}  // namespace farfield
