// SPDX-License-Identifier: Apache-2.0
#include "base/embree.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <string>

namespace farfield {

namespace {

const char* words_for(RTCError error) {
  switch (error) {
    case RTC_ERROR_NONE:
      return "no error";
    case RTC_ERROR_UNKNOWN:
      return "unknown error";
    case RTC_ERROR_INVALID_ARGUMENT:
      return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION:
      return "invalid operation";
    case RTC_ERROR_OUT_OF_MEMORY:
      return "out of memory";
    case RTC_ERROR_UNSUPPORTED_CPU:
      return "this processor is not supported (it needs SSE2)";
    case RTC_ERROR_CANCELLED:
      return "cancelled";
  }
  return "unknown error";
}

}  // namespace

Result<EmbreeDevice> make_embree_device(int threads) {
  std::string config = threads > 0 ? fmt::format("threads={},", threads) : std::string();
  if (__builtin_cpu_supports("avx")) config += "tri_accel_mb=bvh8.triangle4vmb";
  if (EmbreeDevice device(rtcNewDevice(config.c_str())); device) return device;
  return make_error(ErrorCode::Unsupported,
                    fmt::format("Embree does not start on this machine: {}", words_for(rtcGetDeviceError(nullptr))));
}

Result<void> check_embree(EmbreeDeviceRef device, std::string_view task) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return {};
  return make_error(ErrorCode::Io, fmt::format("Embree cannot {}: {}", task, words_for(error)));
}

EmbreeScene build_static_scene(EmbreeDeviceRef device, std::span<const EmbreeGeometry> geometries,
                               const std::atomic<bool>* cancel, unsigned first_id) {
  EmbreeScene scene = new_scene(device);
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  for (unsigned i = 0; i < geometries.size(); ++i) {
    const EmbreeGeometryRef geometry = geometries[i].get();
    if (!geometry) continue;
    rtcSetGeometryMask(geometry, 0xffffffffu);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene.get(), geometry, first_id + i);
  }
  if (cancel) {
    const auto may_go_on = [](void* flag, double) {
      return !static_cast<const std::atomic<bool>*>(flag)->load(std::memory_order_relaxed);
    };
    rtcSetSceneProgressMonitorFunction(scene.get(), may_go_on, const_cast<std::atomic<bool>*>(cancel));
  }
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene.get()); });
  if (cancel) rtcSetSceneProgressMonitorFunction(scene.get(), nullptr, nullptr);  // the flag may go before the scene
  return scene;
}

}  // namespace farfield
