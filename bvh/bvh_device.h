// SPDX-License-Identifier: Apache-2.0
// Our own Embree device, which counts every byte that Embree holds for levels.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "base/embree.h"
#include "base/result.h"

namespace farfield {

/// An Embree device with a memory monitor. Not the host's: a device has one monitor slot, and the host may use its own.
/// Builds are serialised by build_mutex(), so that bytes can be told apart and only one build peak exists at a time.
class BvhDevice {
 public:
  /// Keeps the number of TBB threads that the process is limited to now: a default device would lift the limit.
  /// Errors: Unsupported (Embree does not start).
  static Result<std::unique_ptr<BvhDevice>> create();
  BvhDevice(const BvhDevice&) = delete;
  BvhDevice& operator=(const BvhDevice&) = delete;

  EmbreeDeviceRef handle() const { return device_.get(); }
  std::mutex& build_mutex() { return build_mutex_; }

  /// Bytes that Embree has reported for this device and not given back.
  uint64_t bytes() const { return static_cast<uint64_t>(bytes_.load(std::memory_order_relaxed)); }
  /// The largest bytes() since reset_peak().
  uint64_t peak_bytes() const { return static_cast<uint64_t>(peak_bytes_.load(std::memory_order_relaxed)); }
  void reset_peak() { peak_bytes_.store(bytes_.load(std::memory_order_relaxed), std::memory_order_relaxed); }

  /// Embree gets no memory that would take bytes() above this: the build in progress then fails. For builds, under
  /// build_mutex().
  void set_limit(uint64_t bytes);
  /// Takes the limit away. True: Embree has asked for more than one of the limits since the last call.
  bool end_limit();

 private:
  BvhDevice() = default;
  static constexpr int64_t kNoLimit = std::numeric_limits<int64_t>::max();
  static bool on_memory(void* self, ssize_t bytes, bool post);

  std::mutex build_mutex_;
  // relaxed: only counters; whoever compares them holds build_mutex_ and has joined the build's threads.
  std::atomic<int64_t> bytes_{0};
  std::atomic<int64_t> peak_bytes_{0};
  std::atomic<int64_t> limit_bytes_{kNoLimit};
  std::atomic<bool> is_limit_exceeded_{false};
  EmbreeDevice device_;  // last, so released first: what it gives back is still counted
};

/// As much memory as there is.
inline constexpr uint64_t kAnyBytes = std::numeric_limits<uint64_t>::max();

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
/// geometries always take the same bytes. Embree gets no more than `most_bytes`, at the worst moment. Holds
/// device.build_mutex(). what: for messages, "the BVH of 8 quads". Errors: OutOfBudget (most_bytes are not enough), Io
/// (out of memory, or what else Embree says).
Result<MeasuredScene> build_measured_scene(BvhDevice& device, const std::function<std::vector<EmbreeGeometry>()>& make,
                                           uint64_t most_bytes, std::string_view what);

}  // namespace farfield
