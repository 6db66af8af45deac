// SPDX-License-Identifier: Apache-2.0
#include "bvh/bvh_device.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "base/bytes.h"

namespace farfield {

bool BvhDevice::on_memory(void* self, ssize_t bytes, bool /*post*/) {
  auto& device = *static_cast<BvhDevice*>(self);
  const int64_t now = device.bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  if (bytes > 0 && now > device.limit_bytes_.load(std::memory_order_relaxed)) {
    device.bytes_.fetch_sub(bytes, std::memory_order_relaxed);  // Embree does not take it, and does not give it back
    device.is_limit_exceeded_.store(true, std::memory_order_relaxed);
    return false;
  }
  int64_t peak = device.peak_bytes_.load(std::memory_order_relaxed);
  while (now > peak && !device.peak_bytes_.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
  return true;
}

void BvhDevice::set_limit(uint64_t bytes) {
  is_limit_exceeded_.store(false, std::memory_order_relaxed);
  limit_bytes_.store(static_cast<int64_t>(std::min<uint64_t>(bytes, kNoLimit)), std::memory_order_relaxed);
}

bool BvhDevice::end_limit() {
  limit_bytes_.store(kNoLimit, std::memory_order_relaxed);
  return is_limit_exceeded_.load(std::memory_order_relaxed);
}

Result<std::unique_ptr<BvhDevice>> BvhDevice::create() {
  // Embree installs a TBB limit of the largest "threads" among live devices, and none at all if one has the default.
  const size_t limit = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const bool is_limited = limit < std::thread::hardware_concurrency();

  std::unique_ptr<BvhDevice> device(new BvhDevice);
  FARFIELD_TRY_LET(device->device_, make_embree_device(is_limited ? static_cast<int>(limit) : 0));
  set_memory_monitor(device->handle(), on_memory, device.get());
  return device;
}

Result<MeasuredScene> build_measured_scene(BvhDevice& device, const std::function<std::vector<EmbreeGeometry>()>& make,
                                           uint64_t most_bytes, std::string_view what) {
  const std::lock_guard lock(device.build_mutex());
  const uint64_t bytes_before = device.bytes();
  device.reset_peak();
  forget_embree_error(device.handle());  // not ours

  // Up to here Embree may go; what it does not report is small.
  device.set_limit(bytes_before + std::min(most_bytes, kAnyBytes - bytes_before));
  MeasuredScene result;
  const std::vector<EmbreeGeometry> geometries = make();
  result.scene = build_static_scene(device.handle(), geometries);
  const auto count = static_cast<uint64_t>(
      std::ranges::count_if(geometries, [](const EmbreeGeometry& geometry) { return geometry != nullptr; }));
  const uint64_t overheads = kSceneOverheadBytes + count * kGeometryOverheadBytes;
  const uint64_t bytes_after = device.bytes();
  result.bytes = bytes_after - std::min(bytes_before, bytes_after) + overheads;
  result.build_peak_bytes = device.peak_bytes() - std::min(device.peak_bytes(), bytes_after);
  if (device.end_limit() || result.bytes > most_bytes) {
    forget_embree_error(device.handle());
    return make_error(ErrorCode::OutOfBudget, fmt::format("{} takes more than {}", what, format_bytes(most_bytes)));
  }
  FARFIELD_TRY(check_embree(device.handle(), fmt::format("build {}", what)));
  return result;
}

}  // namespace farfield
