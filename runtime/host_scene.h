// SPDX-License-Identifier: Apache-2.0
// The host's Embree scene, and our one geometry in it.
#pragma once

#include "base/result.h"
#include "bvh/instance_geometry.h"

namespace farfield {

/// One thread, with no ray in flight.
class HostScene {
 public:
  /// The device is retained.
  explicit HostScene(RTCDevice device);
  ~HostScene();
  HostScene(const HostScene&) = delete;
  HostScene& operator=(const HostScene&) = delete;

  /// See Runtime::attach.
  Result<unsigned> attach(RTCScene scene, InstanceGeometry& instances);
  unsigned geometry_id() const { return geometry_id_; }

 private:
  const RTCDevice device_;
  RTCGeometry geometry_ = nullptr;  ///< null until attach()
  RTCScene scene_ = nullptr;        ///< that geometry_ is attached to; retained
  unsigned geometry_id_ = RTC_INVALID_GEOMETRY_ID;
};

}  // namespace farfield
