// SPDX-License-Identifier: Apache-2.0
// The host's Embree scene, and our one geometry in it.
#pragma once

#include "base/embree.h"
#include "base/result.h"
#include "bvh/instance_geometry.h"

namespace farfield {

/// One thread, with no ray in flight.
class HostScene {
 public:
  /// The device is retained.
  explicit HostScene(EmbreeDeviceRef device) : device_(retain(device)) {}
  HostScene(const HostScene&) = delete;
  HostScene& operator=(const HostScene&) = delete;

  /// See Runtime::attach.
  Result<unsigned> attach(EmbreeSceneRef scene, InstanceGeometry& instances);
  unsigned geometry_id() const { return geometry_id_; }

 private:
  const EmbreeDevice device_;
  EmbreeScene scene_;        ///< that geometry_ is attached to
  EmbreeGeometry geometry_;  ///< null until attach()
  unsigned geometry_id_ = kNoGeometry;
};

}  // namespace farfield
