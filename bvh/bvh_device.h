// SPDX-License-Identifier: Apache-2.0
// Our own Embree device, which counts every byte that Embree holds for levels.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "base/embree.h"
#include "base/result.h"
#include "cache/load_terms.h"

namespace farfield {

/// An Embree device with a memory monitor. Not the host's: a device has one monitor slot, and the host may use its own.
/// Any threads may build scenes of it at the same time.
class BvhDevice {
 public:
  /// Keeps the number of TBB threads that the process is limited to now: a default device would lift the limit.
  /// Errors: Unsupported (Embree does not start).
  static Result<std::unique_ptr<BvhDevice>> create();
  BvhDevice(const BvhDevice&) = delete;
  BvhDevice& operator=(const BvhDevice&) = delete;

  EmbreeDeviceRef handle() const { return device_.get(); }
  /// Bytes that Embree has reported for this device and not given back.
  uint64_t bytes() const { return static_cast<uint64_t>(bytes_.load(std::memory_order_relaxed)); }

 private:
  BvhDevice() = default;
  static bool on_memory(void* self, ssize_t bytes, bool post);

  std::atomic<int64_t> bytes_{0};  // relaxed: only a counter
  EmbreeDevice device_;            // last, so released first: what it gives back is still counted
};

/// What Embree does not report: scene objects, geometry objects and malloc's rounding, measured on 3.13.5.
inline constexpr uint64_t kSceneOverheadBytes = 3072;
inline constexpr uint64_t kGeometryOverheadBytes = 300;

/// A committed scene and what it takes; nothing at all without geometries. Movable.
struct MeasuredScene {
  EmbreeScene scene;
  uint64_t bytes = 0;             ///< that the scene holds, overheads included
  uint64_t build_peak_bytes = 0;  ///< further ones at the worst moment of the build
};

/// Builds a scene of what `make` makes (see build_static_scene) on the calling thread alone, so that the same
/// geometries always take the same bytes, and those bytes can be told from what other threads build meanwhile. what:
/// for messages, "the BVH of 8 quads". Errors: OutOfBudget (most_bytes are not enough), Cancelled, Io (out of memory,
/// or what else Embree says).
Result<MeasuredScene> build_measured_scene(BvhDevice& device, const std::function<std::vector<EmbreeGeometry>()>& make,
                                           const LoadTerms& terms, std::string_view what, unsigned first_id = 0);

}  // namespace farfield
