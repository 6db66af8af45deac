// SPDX-License-Identifier: Apache-2.0
// Embree objects that release themselves, and the scene of a renderer whose only geometry is Farfield's.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <type_traits>

#include "base/result.h"
#include "farfield/runtime.h"

namespace farfield {

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DeviceHandle = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseEmbree>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseEmbree>;

/// A device with as many threads as parallel_for uses: a default device would lift a limit on them.
/// Errors: Unsupported (Embree does not start).
Result<DeviceHandle> make_device();

/// A committed scene that holds the runtime's geometry. Errors: those of Runtime::attach, and Io (Embree).
Result<SceneHandle> make_scene(const DeviceHandle& device, Runtime& runtime);

}  // namespace farfield
