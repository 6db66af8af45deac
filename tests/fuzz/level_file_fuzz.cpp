// SPDX-License-Identifier: Apache-2.0
// Level files: whatever the structure check accepts may be read through all its indices, and writing it again gives the
// same layout.
#include "base/check.h"
#include "cache/level_check.h"
#include "cache/level_file.h"
#include "cache/level_format.h"
#include "fuzz_targets.h"
#include "tests/support/level_image.h"

namespace farfield {

namespace {

/// Makes the parts that a fuzzer cannot guess agree: magic, version, size and checksum of the head.
void repair_head(std::span<std::byte> file) {
  if (file.size() < sizeof(FileHeader)) return;
  auto& header = *reinterpret_cast<FileHeader*>(file.data());  // images are aligned
  header.magic = kLevelFileMagic;
  header.version = kLevelFileVersion;
  header.file_bytes = file.size();
  seal_head(file);
}

void use(test::FileImage& image) {
  (void)parse_level(image.bytes(), LevelCheck::Full, "fuzz");
  const Result<LevelView> view = parse_level(image.bytes(), LevelCheck::Structure, "fuzz");
  if (!view) return;
  test::walk(*view);
  (void)find_value_problem(*view);
  FARFIELD_CHECK(layout_of(*view).file_bytes == image.bytes().size());
}

}  // namespace

void fuzz_level_file(std::span<const uint8_t> data) {
  test::FileImage image(std::as_bytes(data));
  use(image);
  repair_head(image.bytes());
  use(image);
}

}  // namespace farfield
