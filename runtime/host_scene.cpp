// SPDX-License-Identifier: Apache-2.0
#include "runtime/host_scene.h"

#include <fmt/format.h>

namespace farfield {

namespace {

bool is_scene_of(RTCScene scene, RTCDevice device) {
  const RTCDevice of_scene = rtcGetSceneDevice(scene);  // retained for us
  rtcReleaseDevice(of_scene);
  return of_scene == device;
}

}  // namespace

HostScene::HostScene(RTCDevice device) : device_(device) { rtcRetainDevice(device_); }

HostScene::~HostScene() {
  if (geometry_) rtcReleaseGeometry(geometry_);
  if (scene_) rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

Result<unsigned> HostScene::attach(RTCScene scene, InstanceGeometry& instances) {
  if (!scene) return make_error(ErrorCode::InvalidArgument, "attach() needs a scene");
  if (!is_scene_of(scene, device_)) {
    return make_error(ErrorCode::InvalidArgument, "attach() needs a scene of the device that create() was given");
  }
  if (!geometry_) {
    geometry_ = instances.create(device_);
  } else {
    instances.update(geometry_);
  }
  if (scene == scene_) return geometry_id_;

  const unsigned id = rtcAttachGeometry(scene, geometry_);
  if (id == RTC_INVALID_GEOMETRY_ID) {
    return make_error(ErrorCode::Io, fmt::format("Embree refuses the geometry (error {})",
                                                 static_cast<int>(rtcGetDeviceError(device_))));
  }
  rtcRetainScene(scene);  // so that its address stays its own
  if (scene_) {
    rtcDetachGeometry(scene_, geometry_id_);
    rtcReleaseScene(scene_);
  }
  scene_ = scene;
  geometry_id_ = id;
  return id;
}

}  // namespace farfield
