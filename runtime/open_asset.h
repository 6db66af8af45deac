// SPDX-License-Identifier: Apache-2.0
// An open asset: its manifest reduced to what the runtime needs, and how its levels are loaded.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bvh/traced_asset.h"
#include "bvh/traced_morph.h"
#include "cache/level_file.h"
#include "cache/residency.h"
#include "farfield/runtime.h"
#include "runtime/close_up.h"

namespace farfield {

/// A level in memory: its file's bytes and what rays need of it.
struct LoadedLevel : Resident {
  std::unique_ptr<LevelFile> file;  ///< first, so that it outlives the BVH over its arrays
  std::unique_ptr<TracedLevel> traced;
};

/// A morph in memory.
struct LoadedMorph : Resident {
  std::unique_ptr<TracedMorph> traced;
};

inline constexpr size_t kNoItem = ~size_t{0};

/// An asset whose manifest was read and whose files are there. Its address does not change: rays hold it.
struct OpenAsset {
  std::string name;              ///< of its folder, for messages
  std::filesystem::path folder;  ///< canonical
  dvec3 origin{0.0};             ///< of local space in the source's space
  glm::dmat3 rotation{1.0};      ///< of local space there
  Box3 bounds_source;            ///< in the source's space
  TracedAsset traced;
  std::unique_ptr<CloseUp> close_up;  ///< of level 0
  std::vector<LevelInfo> levels;
  std::vector<uint64_t> build_peak_bytes;             ///< per level, from the manifest
  std::vector<float> ray_cost;                        ///< per level, from the manifest; 0: not recorded
  std::vector<std::optional<LevelCost>> morph_costs;  ///< per level, from the manifest: of the morph to the next
  std::vector<std::string> file_names;                ///< per level, inside the folder
  std::vector<uint64_t> file_hashes;                  ///< per level, of the whole file
  std::vector<size_t> items;                          ///< per level: its number in the ResidentSet
  /// Per level: visits of rays that asked for it, or its morph, and that another one served. Any thread.
  std::unique_ptr<std::atomic<uint64_t>[]> fallbacks;
  std::vector<size_t> morph_items;  ///< per level: of its morph to the next; kNoItem. Empty: levels dissolve

  /// Heap bytes of the tables above.
  uint64_t table_bytes() const;
};

/// Reads and checks the manifest and sees that every level's file is there with the size it should have. Loads nothing.
/// Its textures are known to the cache from then on. Errors: those of read_manifest; NotFound, BadFile (a level file,
/// or sizes that cannot be), Unsupported (more than 256 levels).
Result<std::unique_ptr<OpenAsset>> read_asset(const std::filesystem::path& folder, MaterialFunction materials,
                                              TextureCache& textures);

/// What loads level `slot` of `asset`: reads the file, checks all of it, builds the BVH and gives back what only that
/// needed. Refers to the arguments.
ResidencyItem make_level_item(const OpenAsset& asset, uint32_t slot, BvhDevice& device);
/// What loads the morph from level `slot` to the next, which the manifest has the cost of; both levels are loaded
/// before. Refers to the arguments.
ResidencyItem make_morph_item(const OpenAsset& asset, uint32_t slot, BvhDevice& device);

}  // namespace farfield
