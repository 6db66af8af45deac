// SPDX-License-Identifier: Apache-2.0
#include "runtime/host_scene.h"

namespace farfield {

Result<unsigned> HostScene::attach(EmbreeSceneRef scene, InstanceGeometry& instances) {
  if (!scene) return make_error(ErrorCode::InvalidArgument, "attach() needs a scene");
  if (device_of(scene) != device_) {
    return make_error(ErrorCode::InvalidArgument, "attach() needs a scene of the device that create() was given");
  }
  if (!geometry_) {
    geometry_ = instances.create(device_.get());
  } else {
    instances.update(geometry_.get());
  }
  if (scene == scene_.get()) return geometry_id_;

  const unsigned id = attach_geometry(scene, geometry_.get());
  if (id == kNoGeometry) {
    FARFIELD_TRY(check_embree(device_.get(), "attach the geometry"));
    return make_error(ErrorCode::Io, "Embree cannot attach the geometry");  // another thread has asked for the reason
  }
  if (scene_) detach_geometry(scene_.get(), geometry_id_);
  scene_ = retain(scene);  // so that its address stays its own
  geometry_id_ = id;
  return id;
}

}  // namespace farfield
