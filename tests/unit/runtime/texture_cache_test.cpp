// SPDX-License-Identifier: Apache-2.0
#include "runtime/texture_cache.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

TEST(TextureCache, CountsFilesOfTheSameContentOnce) {
  constexpr uint64_t kBytes = uint64_t{100} << 20, kPlenty = uint64_t{8} << 30;
  Messages silent({});
  TextureCache cache(silent);
  AssetTexture texture;
  texture.file = "texture_0.tif";
  texture.file_hash = 7;
  texture.file_bytes = 1000;
  texture.cache_bytes = kBytes;
  EXPECT_EQ(cache.add("tile_0", texture, Wrap::Repeat, Wrap::Repeat), 0u);
  const uint64_t of_one = cache.wanted_bytes(kPlenty);
  EXPECT_GE(of_one, kBytes);
  EXPECT_EQ(cache.add("tile_1", texture, Wrap::Clamp, Wrap::Repeat), 1u) << "it may continue otherwise";
  EXPECT_EQ(cache.wanted_bytes(kPlenty), of_one);
  texture.file_hash = 8;
  cache.add("tile_2", texture, Wrap::Repeat, Wrap::Repeat);
  EXPECT_EQ(cache.wanted_bytes(kPlenty), of_one + kBytes);
}

}  // namespace
}  // namespace farfield
