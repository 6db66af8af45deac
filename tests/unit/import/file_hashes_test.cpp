// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "import/read_source.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

TEST(FileHashes, AreOfWhatWasReadFirst) {
  const test::TemporaryFolder folder;
  const auto source = folder.write("scene.gltf", "one");
  FileHashes hashes;
  ImportOptions asked;
  asked.mesh = 3;
  asked.known_hashes = &hashes;
  const uint64_t first = hash_source(source, {}, asked).value();
  folder.write("scene.gltf", "two");
  EXPECT_EQ(hash_source(source, {}, asked).value(), first) << "the file was read again";
  asked.known_hashes = nullptr;
  EXPECT_NE(hash_source(source, {}, asked).value(), first);
}

TEST(FileHashes, TellMeshesAndFilesApart) {
  const test::TemporaryFolder folder;
  const auto a = folder.write("a.gltf", "one"), b = folder.write("b.gltf", "two");
  FileHashes hashes;
  ImportOptions first, second;
  first.known_hashes = second.known_hashes = &hashes;
  first.mesh = 0;
  second.mesh = 1;
  EXPECT_NE(hash_source(a, {}, first).value(), hash_source(a, {}, second).value());
  EXPECT_NE(hash_source(a, {}, first).value(), hash_source(b, {}, first).value());
}

TEST(FileHashes, OfAFileThatIsNotThereAreAnError) {
  FileHashes hashes;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(hashes.of("/nowhere/scene.glb").error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace farfield
