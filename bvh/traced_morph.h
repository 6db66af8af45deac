// SPDX-License-Identifier: Apache-2.0
// What lies between a level and the next coarser stored one (thesis 6.4, 10.1.2), for any t in (0, 1) from the finer to
// the coarser: vertices move, faces that do not reach the coarser level fade out, those that do not come from the finer
// one fade in, and of either volume's flakes a share is there. Why so: docs/decisions/0028.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "bvh/brick_volume.h"
#include "bvh/bvh_device.h"
#include "bvh/traced_asset.h"

namespace farfield {

/// Where a ray met a morph.
struct MorphHit {
  bool is_volume;
  bool is_coarser;        ///< `element` is of the coarser level, else of the finer
  uint32_t element;       ///< 2 * quad + side, or payload of a voxel
  vec2 barycentric;       ///< weights of the face's second and third corner
  float attenuation = 0;  ///< VolumeHit::attenuation; volumes only
};

/// A morph in memory. Immutable; any thread. Does not move: its scene refers to it.
class TracedMorph {
 public:
  /// Builds the BVH from whole levels, of whose arrays it copies what it needs. `fine` and `coarse` are the same levels
  /// as rays see them, and outlive this. most_bytes, errors: those of build_measured_scene().
  static Result<std::unique_ptr<TracedMorph>> build(BvhDevice& device, const LevelView& fine_level,
                                                    const LevelView& coarse_level, const TracedLevel& fine,
                                                    const TracedLevel& coarse, uint64_t most_bytes = kAnyBytes);
  TracedMorph(const TracedMorph&) = delete;
  TracedMorph& operator=(const TracedMorph&) = delete;

  const TracedLevel& fine() const { return *fine_; }
  const TracedLevel& coarse() const { return *coarse_; }
  /// The face of the coarser level that a face of the finer one becomes; kMorphVoxelized, kMorphCollapsed.
  uint32_t coarse_face(uint32_t fine_face) const { return coarse_face_[fine_face]; }

  /// The nearest hit of a ray in local space at t, with ray_hit's tfar and normal set; none: ray_hit is as before, but
  /// for geomID and primID. ray_bits: see flight_seed().
  std::optional<MorphHit> intersect(EmbreeRayHit& ray_hit, EmbreeContext& context, float t, uint64_t ray_bits) const;
  /// Whether there is any hit; the ray's tfar is -infinity then.
  /// transmittance: null, or what takes the share of light that the volumes let through, instead of their collisions.
  bool occluded(EmbreeRay& ray, EmbreeContext& context, float t, uint64_t ray_bits,
                float* transmittance = nullptr) const;

  /// What the BVH and the tables hold, and what else making them from the files of these levels takes.
  LevelCost cost(const LevelView& fine_level, const LevelView& coarse_level) const;

 private:
  enum Geometry : unsigned { kStaying, kMoving, kFadingOut, kFadingIn, kGeometryCount };
  struct SortedFaces;
  TracedMorph() = default;
  static Result<std::unique_ptr<TracedMorph>> make(BvhDevice& device, const LevelView& fine_level,
                                                   const LevelView& coarse_level, uint64_t most_bytes);
  friend Result<LevelCost> measure_morph(const LevelView& fine, const LevelView& coarse);

  std::optional<VolumeHit> first_collision(const LocalRay& ray, float t, uint64_t ray_bits, bool& is_coarser) const;
  struct FaceHit {
    uint32_t element;
    vec2 barycentric;
  };
  FaceHit face_of(const EmbreeHit& hit) const;
  bool stops(const EmbreeFilterArguments& args) const;
  static void filter(const EmbreeFilterArguments* args);

  const TracedLevel* fine_ = nullptr;
  const TracedLevel* coarse_ = nullptr;
  MeasuredScene built_;
  bool are_opaque_ = false;  ///< both levels: a face that is there stops every ray
  uint64_t making_bytes_ = 0;
  std::vector<uint32_t> coarse_face_;
  std::array<std::vector<uint32_t>, kGeometryCount> elements_;  ///< per geometry and primitive
};

/// What a morph between two levels costs beside them, by building its BVH once. Errors: as build().
Result<LevelCost> measure_morph(const LevelView& fine, const LevelView& coarse);

}  // namespace farfield
