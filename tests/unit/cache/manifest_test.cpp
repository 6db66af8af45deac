// SPDX-License-Identifier: Apache-2.0
#include "cache/manifest.h"

#include <gtest/gtest.h>

#include "sample_asset.h"

namespace farfield {
namespace {

using test::sample_manifest;
using test::TemporaryFolder;

TEST(Manifest, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  const Manifest manifest = sample_manifest();
  const Result<void> written = write_manifest(folder.path(), manifest);
  ASSERT_TRUE(written) << written.error().message;
  const Result<Manifest> read = read_manifest(folder.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(manifest_to_json(*read), manifest_to_json(manifest));
  EXPECT_EQ(read->source_hash, manifest.source_hash);
  EXPECT_EQ(read->origin, manifest.origin);
  EXPECT_EQ(read->bounds.lower, manifest.bounds.lower);
  EXPECT_EQ(read->bounds.upper, manifest.bounds.upper);
  EXPECT_EQ(read->hull, manifest.hull);
  ASSERT_EQ(read->levels.size(), 3u);
  EXPECT_EQ(read->levels[1].file_hash, manifest.levels[1].file_hash);
  EXPECT_EQ(read->levels[1].errors->occlusion_error, -0.01);
  EXPECT_FALSE(read->levels[2].errors);
}

}  // namespace
}  // namespace farfield
