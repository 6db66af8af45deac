// SPDX-License-Identifier: Apache-2.0
// What rays know of an asset: its levels, those that are loaded, and which of them they may use.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "bvh/brick_volume.h"
#include "bvh/level_scene.h"

namespace farfield {

/// A point on a level's surface as a ray meets it, in the level's local space.
struct SurfacePoint {
  uint32_t quad;
  uint32_t face;     ///< one of the quad's
  vec2 barycentric;  ///< weights of the face's second and third corner
  vec3 direction;    ///< of the ray, any length
  float width;       ///< of what the ray stands for there
};

/// What faces look like up close. Any thread.
class SurfaceLook {
 public:
  virtual ~SurfaceLook() = default;
  /// The share of rays that a face stops there, of one whose face_opacity is neither 0 nor 255.
  virtual float opacity(const LevelView& level, const SurfacePoint& point) const = 0;
};

/// A loaded level. Immutable; any thread. Does not move: its scene refers to it.
struct TracedLevel {
  LevelView view;  ///< the arrays that the BVH and the volume refer to; owned elsewhere, for longer than this
  LevelScene scene;
  BrickVolume volume;
  uint32_t slot = 0;        ///< its index among the asset's stored levels
  uint32_t face_count = 0;  ///< of the surface
  uint32_t voxel_count = 0;
  const SurfaceLook* look = nullptr;  ///< null: faces are on average everywhere what they are on average

  /// Builds the BVH, within terms. Errors: those of LevelScene::build.
  static Result<std::unique_ptr<TracedLevel>> build(BvhDevice& device, const LevelView& level, uint32_t slot,
                                                    const SurfaceLook* look = nullptr, const LoadTerms& terms = {});
  TracedLevel(const TracedLevel&) = delete;
  TracedLevel& operator=(const TracedLevel&) = delete;

  /// The face of a quad on one side (0 or 1) of its diagonal.
  uint32_t face_of(uint32_t quad, uint32_t side) const {
    const ArrayView<uint32_t> first_face = view.quad_first_face;
    const uint32_t next = quad + 1 < first_face.size() ? first_face[quad + 1] : face_count;
    const bool is_pair = next - first_face[quad] == 2;  // not from `quads`: their pages may have been given back
    return first_face[quad] + (is_pair ? side : 0);     // at a lone triangle's edge rounding may have said 1
  }

 private:
  TracedLevel() = default;
};

/// What free flights in a level's volume draw from, for a ray's own random bits. Neighbouring levels have nothing to do
/// with each other, and a morph between two flies in each as rays do that see it alone: a path changes no more than it
/// must.
inline uint64_t flight_seed(uint64_t ray_bits, uint32_t slot) {
  constexpr uint64_t kOddSalt = 0x6f646473;
  return slot % 2 == 0 ? ray_bits : ray_bits ^ kOddSalt;
}

/// The side of a quad's diagonal that Embree's u and v are on, and the weights of that face's second and third corner.
inline uint32_t quad_side(float u, float v) { return u + v > 1.0f ? 1 : 0; }
inline vec2 face_barycentric(float u, float v) { return quad_side(u, v) ? vec2(1 - u, 1 - v) : vec2(u, v); }

class TracedMorph;

/// An asset, as rays see it. Stored levels ("slots") are ordered finest first. Between two plans only `loaded` changes,
/// from null to a level.
struct TracedAsset {
  Box3 bounds;                ///< contains all levels with room to spare (padded_bounds), local space
  float base_resolution = 0;  ///< r_0 > 0
  /// Per slot: its level, null as long as none was asked for. release/acquire: whoever sees the pointer sees the level.
  std::unique_ptr<std::atomic<const TracedLevel*>[]> loaded;
  std::vector<float> level_numbers;   ///< k of each slot, increasing
  std::vector<uint8_t> usable_slots;  ///< the plan: those that rays may use, finest first; the last is the root
  /// Per slot: its morph to the next coarser one, null as long as none was asked for. release/acquire.
  std::unique_ptr<std::atomic<const TracedMorph*>[]> morphs;
  std::vector<uint8_t> morphing_slots;  ///< the plan: usable slots whose morph to the next, usable too, rays may use
  float blend_window = 1;               ///< octaves below a coarser level over which it blends with the finer; (0, 1]
  float finest_blended = 0.5f;          ///< 2^-blend_window: of a coarser level's width, where the window begins
  std::vector<vec3> hull;               ///< points whose convex hull contains all levels; empty: the corners of bounds

  uint32_t slot_count() const { return static_cast<uint32_t>(level_numbers.size()); }
  float coarsest_number() const { return level_numbers.back(); }
  uint32_t finest_slot() const { return usable_slots.front(); }
  bool is_usable(uint32_t slot) const { return std::ranges::find(usable_slots, slot) != usable_slots.end(); }
  bool may_morph(uint32_t slot) const { return std::ranges::find(morphing_slots, slot) != morphing_slots.end(); }
};

/// The box, a little larger: so that rounding does not clip what lies on its border, also where it is flat.
inline Box3 padded_bounds(const Box3& box) {
  const float far = std::max(max_component(glm::abs(box.lower)), max_component(glm::abs(box.upper)));
  const vec3 pad(1e-5f * max_component(box.size()) + 1e-6f * far);
  return {box.lower - pad, box.upper + pad};
}

/// Serves the levels and morphs that rays ask for and that are not loaded.
class LevelSource {
 public:
  virtual ~LevelSource() = default;
  /// The level to use in place of `slot` of `asset` now: waits for it, or gives a coarser one that is there. Null if
  /// there is none at all: the ray then sees nothing. Called from any thread.
  virtual const TracedLevel* serve(uint32_t asset, uint32_t slot) = 0;
  /// The morph from `slot` to the next; null if it or one of its levels is not there: the ray sees one of them then.
  virtual const TracedMorph* serve_morph(uint32_t /*asset*/, uint32_t /*slot*/) { return nullptr; }
  /// Rays came by way of an instance of the scene that holds the geometry, and see nothing. Called from any thread.
  virtual void refuse_nested() {}
};

}  // namespace farfield
