// SPDX-License-Identifier: Apache-2.0
#include "bvh/bvh_device.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <limits>
#include <thread>
#include <utility>

#include "base/bytes.h"

namespace farfield {

namespace {

/// What Embree takes for the build that this thread does, and the most that it may.
class BuildMeter {
 public:
  explicit BuildMeter(uint64_t most_bytes) : most_bytes_(static_cast<int64_t>(std::min(most_bytes, kNoLimit))) {
    of_this_thread = this;
  }
  ~BuildMeter() { of_this_thread = nullptr; }
  BuildMeter(const BuildMeter&) = delete;
  BuildMeter& operator=(const BuildMeter&) = delete;

  /// False: it must not take them.
  bool take(int64_t bytes) {
    if (bytes > 0 && bytes_ + bytes > most_bytes_) {
      is_limit_exceeded_ = true;
      return false;
    }
    bytes_ += bytes;
    peak_bytes_ = std::max(peak_bytes_, bytes_);
    return true;
  }
  uint64_t bytes() const { return static_cast<uint64_t>(std::max<int64_t>(bytes_, 0)); }
  /// Further ones at the worst moment.
  uint64_t peak_bytes() const { return static_cast<uint64_t>(peak_bytes_) - std::min<uint64_t>(peak_bytes_, bytes()); }
  bool is_limit_exceeded() const { return is_limit_exceeded_; }

  static thread_local BuildMeter* of_this_thread;

 private:
  static constexpr uint64_t kNoLimit = std::numeric_limits<int64_t>::max();
  const int64_t most_bytes_;
  int64_t bytes_ = 0, peak_bytes_ = 0;
  bool is_limit_exceeded_ = false;
};

thread_local BuildMeter* BuildMeter::of_this_thread = nullptr;

}  // namespace

bool BvhDevice::on_memory(void* self, ssize_t bytes, bool /*post*/) {
  // A build takes and gives back memory on its own thread: see build_static_scene.
  BuildMeter* meter = BuildMeter::of_this_thread;
  if (meter && !meter->take(bytes)) return false;  // Embree does not take it, and does not give it back
  static_cast<BvhDevice*>(self)->bytes_.fetch_add(bytes, std::memory_order_relaxed);
  return true;
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
                                           const LoadTerms& terms, std::string_view what, unsigned first_id) {
  forget_embree_error(device.handle());  // not ours

  BuildMeter meter(terms.most_bytes);
  MeasuredScene result;
  const std::vector<EmbreeGeometry> geometries = make();
  result.scene = build_static_scene(device.handle(), geometries, terms.cancel, first_id);
  const auto count = static_cast<uint64_t>(
      std::ranges::count_if(geometries, [](const EmbreeGeometry& geometry) { return geometry != nullptr; }));
  const uint64_t overheads = kSceneOverheadBytes + count * kGeometryOverheadBytes;  // what it does not report is small
  result.bytes = meter.bytes() + overheads;
  result.build_peak_bytes = meter.peak_bytes();
  if (terms.is_cancelled()) {
    forget_embree_error(device.handle());
    return make_error(ErrorCode::Cancelled, fmt::format("{} is no longer wanted", what));
  }
  if (meter.is_limit_exceeded() || result.bytes > terms.most_bytes) {
    forget_embree_error(device.handle());
    return make_error(ErrorCode::OutOfBudget,
                      fmt::format("{} takes more than {}", what, format_bytes(terms.most_bytes)));
  }
  FARFIELD_TRY(check_embree(device.handle(), fmt::format("build {}", what)));
  return result;
}

}  // namespace farfield
