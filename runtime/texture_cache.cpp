// SPDX-License-Identifier: Apache-2.0
#include "runtime/texture_cache.h"

#include <fmt/format.h>

#include <algorithm>

namespace farfield {
namespace {

constexpr uint64_t kLargestShare = 4;  ///< of the budget, as 1 / this
// What OpenImageIO holds beside tiles: names and headers of files, tables of its threads [measured:
// docs/results/textures.md].
constexpr uint64_t kOverheadBytes = uint64_t{1} << 20;

}  // namespace

uint32_t TextureCache::add(const std::filesystem::path& folder, const AssetTexture& texture, Wrap wrap_u, Wrap wrap_v) {
  const auto [first, is_new] =
      first_with_.try_emplace({texture.file_hash, texture.file_bytes}, (folder / texture.file).string());
  if (is_new) texture_bytes_ += texture.cache_bytes;
  files_.push_back({first->second, wrap_u, wrap_v});
  return static_cast<uint32_t>(files_.size() - 1);
}

uint64_t TextureCache::wanted_bytes(uint64_t budget_bytes) const {
  if (texture_bytes_ == 0 || is_missing_) return 0;
  return std::min(texture_bytes_, std::max(budget_bytes / kLargestShare, kSmallestTextureCache)) + kOverheadBytes;
}

void TextureCache::set_bytes(uint64_t bytes) {
  if (bytes > 0 && !lookup_) open();
  const bool had_room = has_room_;
  has_room_ = bytes > 0 && lookup_;
  if (has_room_) {
    for (; known_files_ < files_.size(); ++known_files_) {
      const File& file = files_[known_files_];
      lookup_->add(file.path, file.wrap_u, file.wrap_v);
    }
    lookup_->set_cache_bytes(std::max(bytes - std::min(bytes, kOverheadBytes), kSmallestTextureCache));
  } else if (had_room) {
    lookup_->clear();
  }
}

void TextureCache::open() {
  if (const auto module = texture_module()) {
    lookup_ = (*module)->make_lookup();
  } else if (!is_missing_) {
    is_missing_ = true;
    messages_.report(Severity::Warning, fmt::format("close-ups have one colour per face: {}", module.error().message));
  }
}

bool TextureCache::look_up(uint32_t texture, const TextureFootprint& footprint, int channels, float* values) const {
  if (!has_room_) return false;
  if (lookup_->look_up(texture, footprint, channels, values)) return true;
  messages_.report_once(said_unreadable_, Severity::Error,
                        fmt::format("{} cannot be read, its faces have one colour each; bake the asset again: {}",
                                    files_[texture].path, lookup_->error()));
  return false;
}

}  // namespace farfield
