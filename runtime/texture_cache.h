// SPDX-License-Identifier: Apache-2.0
// The textures of all open assets, behind one cache of tiles whose size the budget pays for.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/texture_module.h"
#include "cache/asset_material.h"
#include "runtime/messages.h"

namespace farfield {

/// look_up() is safe from any thread while rays fly; the rest is for one thread, between frames.
class TextureCache {
 public:
  explicit TextureCache(Messages& messages) : messages_(messages) {}

  /// Handles of an asset's textures. OpenImageIO is loaded with the first one; without it, and where a file cannot be
  /// read, lookups fail, which is said once. `bytes`: what all its textures take in memory.
  uint32_t add(const std::filesystem::path& file, Wrap wrap_u, Wrap wrap_v);
  void add_bytes(uint64_t bytes) { texture_bytes_ += bytes; }

  /// What the cache wants of a budget: all of its textures, or the share that pages them; 0 without textures.
  uint64_t wanted_bytes(uint64_t budget_bytes) const;
  /// How much it may take from now on. 0: nothing; lookups fail, and what it held is given back.
  void set_bytes(uint64_t bytes);

  /// See TextureLookup. False: no such texture can be read now.
  bool look_up(uint32_t texture, const TextureFootprint& footprint, int channels, float* values) const;

 private:
  Messages& messages_;
  std::unique_ptr<TextureLookup> lookup_;
  std::vector<std::string> files_;  ///< per texture, for messages
  bool is_open_ = false;     ///< set_bytes() has given it room
  bool is_missing_ = false;  ///< OpenImageIO's module does not load
  uint64_t texture_bytes_ = 0;
  mutable std::atomic<bool> said_unreadable_{false};
};

}  // namespace farfield
