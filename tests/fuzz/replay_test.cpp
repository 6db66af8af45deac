// SPDX-License-Identifier: Apache-2.0
// Runs the fuzz targets over what fuzzers found before, over the frozen files, and over simple damage of those.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "base/random.h"
#include "fuzz_targets.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

using Target = void (*)(std::span<const uint8_t>);

void run(Target target, const std::vector<std::byte>& bytes) {
  target({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
}

int run_folder(Target target, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    run(target, test::read_bytes(file));
  }
  return static_cast<int>(files.size());
}

void run_damaged(Target target, const std::filesystem::path& file) {
  const std::vector<std::byte> whole = test::read_bytes(file);
  ASSERT_FALSE(whole.empty());
  Rng rng(1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<std::byte> damaged = whole;
    if (trial % 4 == 0) damaged.resize(rng.next_uint() % damaged.size() + 1);
    for (uint32_t change = 0; change <= rng.next_uint() % 3; ++change) {
      damaged[rng.next_uint() % damaged.size()] = static_cast<std::byte>(rng.next_uint());
    }
    run(target, damaged);
  }
}

TEST(FuzzReplay, LevelFile) {
  run(fuzz_level_file, {});
  EXPECT_GT(run_folder(fuzz_level_file, FARFIELD_FUZZ_REGRESSIONS "/level_file"), 0);
  run_damaged(fuzz_level_file, FARFIELD_TEST_DATA "/format_v1/level_3.ffl");
  run_damaged(fuzz_level_file, FARFIELD_TEST_DATA "/format_v4/level_3.ffl");
  run_damaged(fuzz_level_file, FARFIELD_TEST_DATA "/format_v5/level_3.ffl");
  run_damaged(fuzz_level_file, FARFIELD_TEST_DATA "/format_v7/level_3.ffl");
  run_damaged(fuzz_level_file, FARFIELD_TEST_DATA "/format_v8/level_3.ffl");
}

TEST(FuzzReplay, Manifest) {
  run(fuzz_manifest, {});
  EXPECT_GT(run_folder(fuzz_manifest, FARFIELD_FUZZ_REGRESSIONS "/manifest"), 0);
  run_damaged(fuzz_manifest, FARFIELD_TEST_DATA "/format_v1/manifest.json");
}

}  // namespace
}  // namespace farfield
