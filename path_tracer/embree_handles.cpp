// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/embree_handles.h"

#include <fmt/format.h>

#include "base/parallel.h"
#include "base/result.h"

namespace farfield {

Result<DeviceHandle> make_device() {
  DeviceHandle device(rtcNewDevice(fmt::format("threads={}", thread_count()).c_str()));
  if (device) return device;
  return make_error(ErrorCode::Unsupported,
                    fmt::format("Embree does not start (error {})", static_cast<int>(rtcGetDeviceError(nullptr))));
}

Result<SceneHandle> make_scene(const DeviceHandle& device, Runtime& runtime) {
  SceneHandle scene(rtcNewScene(device.get()));
  FARFIELD_TRY(runtime.attach(scene.get()));
  rtcCommitScene(scene.get());
  if (const RTCError error = rtcGetDeviceError(device.get()); error != RTC_ERROR_NONE)
    return make_error(ErrorCode::Io, fmt::format("Embree cannot build the scene (error {})", static_cast<int>(error)));
  return scene;
}

}  // namespace farfield
