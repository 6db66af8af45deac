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

uint32_t TextureCache::add(const std::filesystem::path& file, Wrap wrap_u, Wrap wrap_v) {
  if (!lookup_ && !is_missing_) {
    if (const auto module = texture_module()) {
      lookup_ = (*module)->make_lookup();
    } else {
      is_missing_ = true;
      messages_.report(Severity::Warning,
                       fmt::format("close-ups have one colour per face: {}", module.error().message));
    }
  }
  if (!lookup_) return 0;
  files_.push_back(file.string());
  return lookup_->add(files_.back(), wrap_u, wrap_v);
}

uint64_t TextureCache::wanted_bytes(uint64_t budget_bytes) const {
  if (!lookup_ || texture_bytes_ == 0) return 0;
  return std::min(texture_bytes_, std::max(budget_bytes / kLargestShare, kSmallestTextureCache)) + kOverheadBytes;
}

void TextureCache::set_bytes(uint64_t bytes) {
  if (!lookup_) return;
  const bool was_open = is_open_;
  is_open_ = bytes > 0;
  if (is_open_) {
    lookup_->set_cache_bytes(std::max(bytes - std::min(bytes, kOverheadBytes), kSmallestTextureCache));
  } else if (was_open) {
    lookup_->clear();
  }
}

bool TextureCache::look_up(uint32_t texture, const TextureFootprint& footprint, int channels, float* values) const {
  if (!is_open_) return false;
  if (lookup_->look_up(texture, footprint, channels, values)) return true;
  messages_.report_once(said_unreadable_, Severity::Error,
                        fmt::format("{} cannot be read, its faces have one colour each; bake the asset again: {}",
                                    files_[texture], lookup_->error()));
  return false;
}

}  // namespace farfield
