// SPDX-License-Identifier: Apache-2.0
#include "base/temporary_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(TemporaryFile, IsThereOnlyOnceCommitted) {
  const test::TemporaryFolder folder;
  {
    TemporaryFile dropped(folder.path() / "a");
    EXPECT_TRUE(dropped.write(bytes_of("text")));
    EXPECT_FALSE(fs::exists(folder.path() / "a"));
  }
  EXPECT_TRUE(folder.names().empty());
  TemporaryFile kept(folder.path() / "a");
  EXPECT_TRUE(kept.write(bytes_of("text")) && kept.seek(0) && kept.write(bytes_of("n")));
  EXPECT_EQ(kept.position(), 1u);
  ASSERT_TRUE(kept.commit());
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
  EXPECT_EQ(test::read_bytes(folder.path() / "a").size(), 4u);
}

TEST(TemporaryFile, NeverReplacesADeviceAPipeOrAFolder) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  fs::create_directory(folder.path() / "folder");
  for (const fs::path& target : {folder.path() / "pipe", folder.path() / "folder", fs::path("/dev/null")}) {
    const fs::file_type before = fs::status(target).type();
    TemporaryFile file(target);
    EXPECT_FALSE(file.is_good());
    EXPECT_FALSE(file.write(bytes_of("text")));
    const auto done = file.commit();
    ASSERT_FALSE(done) << target;
    EXPECT_EQ(done.error().code, ErrorCode::Io);
    EXPECT_NE(done.error().message.find(target.string()), std::string::npos) << done.error().message;
    EXPECT_EQ(fs::status(target).type(), before) << target;
  }
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"folder", "pipe"}));
}

TEST(TemporaryFile, SaysWhatItNeedsAndWhereThereIsNoFolder) {
  const test::TemporaryFolder folder;
  TemporaryFile file(folder.path() / "missing" / "a", 1 << 20);
  const auto done = file.commit();
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("create the folder"), std::string::npos) << done.error().message;
}

TEST(TemporaryFolder, GoesWithAllInIt) {
  fs::path path;
  {
    const auto folder = TemporaryFolder::create();
    ASSERT_TRUE(folder);
    path = folder->path();
    test::write_text(path / "a", "text");
  }
  EXPECT_FALSE(fs::exists(path));
}

}  // namespace
}  // namespace farfield
