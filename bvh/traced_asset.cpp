// SPDX-License-Identifier: Apache-2.0
#include "bvh/traced_asset.h"

#include "bvh/see_through.h"

namespace farfield {

Result<std::unique_ptr<TracedLevel>> TracedLevel::build(BvhDevice& device, const LevelView& level, uint32_t slot,
                                                        const SurfaceLook* look, const LoadTerms& terms) {
  std::unique_ptr<TracedLevel> traced(new TracedLevel);
  traced->view = level;
  traced->volume = BrickVolume(level);
  traced->slot = slot;
  traced->face_count = farfield::face_count(level);
  traced->voxel_count = farfield::voxel_count(level);
  traced->look = look;
  FARFIELD_TRY_LET(traced->scene,
                   LevelScene::build(device, level, terms, is_opaque(level) ? nullptr : opacity_filter, traced.get()));
  return traced;
}

}  // namespace farfield
