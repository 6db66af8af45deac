// SPDX-License-Identifier: Apache-2.0
// The textures of all open assets, behind one cache of tiles whose size the budget pays for.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/texture_module.h"
#include "cache/asset_material.h"
#include "runtime/messages.h"

namespace farfield {

/// look_up() is safe from any thread while rays fly; the rest is for one thread, between frames. A texture that cannot
/// be read is said once.
class TextureCache {
 public:
  explicit TextureCache(Messages& messages) : messages_(messages) {}

  /// A texture of the asset in `folder`. Files of the same content, as tiles of a mesh have them, are read and counted
  /// once.
  uint32_t add(const std::filesystem::path& folder, const AssetTexture& texture, Wrap wrap_u, Wrap wrap_v);

  /// What the cache wants of a budget: all of its textures, or the share that pages them; 0 without textures.
  uint64_t wanted_bytes(uint64_t budget_bytes) const;
  /// How much it may take from now on. 0: nothing; lookups fail, and what it held is given back. OpenImageIO is loaded
  /// when it first gets room; without it lookups fail, which is said once.
  void set_bytes(uint64_t bytes);

  /// See TextureLookup. False: no such texture can be read now.
  bool look_up(uint32_t texture, const TextureFootprint& footprint, int channels, float* values) const;

 private:
  void open();

  struct File {
    std::string path;
    Wrap wrap_u, wrap_v;
  };

  Messages& messages_;
  std::vector<File> files_;                                          ///< per texture
  std::map<std::pair<uint64_t, uint64_t>, std::string> first_with_;  ///< hash and bytes of a file: where it is
  std::unique_ptr<TextureLookup> lookup_;                            ///< once it has got room
  uint32_t known_files_ = 0;                                         ///< to lookup_
  bool has_room_ = false;
  bool is_missing_ = false;  ///< OpenImageIO's module does not load
  uint64_t texture_bytes_ = 0;
  mutable std::atomic<bool> said_unreadable_{false};
};

}  // namespace farfield
