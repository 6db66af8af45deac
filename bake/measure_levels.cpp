// SPDX-License-Identifier: Apache-2.0
#include "bake/measure_levels.h"

#include "bvh/level_scene.h"
#include "bvh/traced_morph.h"

namespace farfield {

VerifyResult verify_and_measure_asset(const std::filesystem::path& asset_dir) {
  return verify_asset(asset_dir, {[](const LevelView& level) { return measure_level_scene(level); }, measure_morph});
}

}  // namespace farfield
