// SPDX-License-Identifier: Apache-2.0
// A level's file in memory, for tests and fuzzers of its reader.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "cache/level.h"

namespace farfield::test {

/// The bytes of a level's file, 64-byte aligned. Unlike write_level() this takes any level, sound or not.
class FileImage {
 public:
  explicit FileImage(const LevelView& level);
  explicit FileImage(std::span<const std::byte> bytes);
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(storage_.data()), size_}; }

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> storage_;
  size_t size_ = 0;
};

/// Reads everything a ray or a build may read of a level, through its indices, as the bricks' and quads' documentation
/// allows. Returns a digest. Under ASan this fails if a view leads out of its file.
uint64_t walk(const LevelView& level);

}  // namespace farfield::test
