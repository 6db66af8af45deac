// SPDX-License-Identifier: Apache-2.0
#include "base/file_io.h"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "cache/level_file.h"
#include "cache/manifest.h"
#include "tests/support/asset_writer.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

using test::FileSizeLimit;
using test::TemporaryFolder;

Result<void> write_one(const std::filesystem::path& path, std::string_view text) {
  const std::span<const std::byte> piece = std::as_bytes(std::span(text));
  return write_file_atomically(path, std::span(&piece, 1));
}

void expect_io_error(const Result<void>& result, const std::filesystem::path& path, const std::string& remedy) {
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::Io);
  EXPECT_NE(result.error().message.find(path.string()), std::string::npos) << result.error().message;
  EXPECT_NE(result.error().message.find(remedy), std::string::npos) << result.error().message;
  EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
}

TEST(WriteFileAtomically, WritesThePiecesInOrderAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const std::string first = "one ", second = "two", empty;
  const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(first)), std::as_bytes(std::span(empty)),
                                               std::as_bytes(std::span(second))};
  ASSERT_TRUE(write_file_atomically(folder.path() / "a", pieces));
  EXPECT_EQ(*read_small_file(folder.path() / "a", 100), "one two");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
  ASSERT_TRUE(write_file_atomically(folder.path() / "a", {}));
  EXPECT_EQ(*read_small_file(folder.path() / "a", 100), "");
}

TEST(WriteFileAtomically, PassesOverWhatAKilledProcessOfTheSameIdLeft) {
  const TemporaryFolder folder;
  constexpr int kLeft = 3000;  // more than this program has written before
  for (int i = 0; i < kLeft; ++i) {
    test::write_text(folder.path() / ("a.tmp-" + std::to_string(::getpid()) + "-" + std::to_string(i)), "half");
  }
  const Result<void> written = write_one(folder.path() / "a", "whole");
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(*read_small_file(folder.path() / "a", 100), "whole");
  EXPECT_EQ(folder.names().size(), kLeft + 1u);
}

TEST(WriteFileAtomically, NamesTheFolderThatIsMissing) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "missing" / "a";
  expect_io_error(write_one(path, "x"), path, "create the folder " + (folder.path() / "missing").string());
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFileAtomically, RefusesAFileAsFolder) {
  const TemporaryFolder folder;
  test::write_text(folder.path() / "file", "x");
  const auto path = folder.path() / "file" / "a";
  expect_io_error(write_one(path, "x"), path, "Not a directory");
}

TEST(WriteFileAtomically, DoesNotReplaceAFolder) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "a";
  std::filesystem::create_directory(path);
  test::write_text(path / "inside", "x");
  expect_io_error(write_one(path, "x"), path, "folder");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
}

/// Root may write everywhere, so root becomes "nobody" while this is alive.
class NoRoot {
 public:
  NoRoot() : was_root_(::geteuid() == 0) {
    if (was_root_ && ::seteuid(65534) != 0) std::abort();
  }
  ~NoRoot() {
    if (was_root_ && ::seteuid(0) != 0) std::abort();
  }

 private:
  bool was_root_;
};

TEST(WriteFileAtomically, TellsOfMissingPermission) {
  const TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec |
                                                  std::filesystem::perms::others_exec);
  const auto path = folder.path() / "a";
  {
    const NoRoot no_root;
    expect_io_error(write_one(path, "x"), path,
                    "Permission denied; check the permissions of " + folder.path().string());
  }
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFileAtomically, AFolderThatCannotBeSyncedIsAnErrorBeforeAnythingIsReplaced) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "a";
  test::write_text(path, "old");
  // Files may be made and renamed in it, but it cannot be opened.
  ASSERT_EQ(::chmod(folder.path().c_str(), 0333), 0);
  {
    const NoRoot no_root;
    expect_io_error(write_one(path, "new"), path, "check the permissions of " + folder.path().string());
  }
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
  EXPECT_EQ(*read_small_file(path, 100), "old");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
}

TEST(OpenRegularFile, TellsOfMissingPermission) {
  const TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
  const auto path = folder.path() / "a";
  test::write_text(path, "x");
  std::filesystem::permissions(path, std::filesystem::perms::none);
  const NoRoot no_root;
  const Result<RegularFile> file = open_regular_file(path);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::Io);
  EXPECT_NE(file.error().message.find("Permission denied"), std::string::npos);
}

TEST(WriteFileAtomically, FailureInTheMiddleKeepsTheOldFileAndRemovesTheNew) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "level_1.ffl";
  const LevelData level = test::random_level(1, 3000, 30);
  ASSERT_TRUE(write_level(path, test::full_level()));
  const auto before = test::read_bytes(path);
  for (const rlim_t bytes : {0, 1, 100, 5000, 100000}) {
    const FileSizeLimit limit(bytes);
    const Result<uint64_t> written = write_level(path, level);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::Io);
    EXPECT_NE(written.error().message.find("ulimit -f"), std::string::npos) << written.error().message;
    EXPECT_FALSE(write_manifest(folder.path(), test::sample_manifest()) && bytes < 1000);
    std::filesystem::remove(folder.path() / kManifestName);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"level_1.ffl"});
    EXPECT_EQ(test::read_bytes(path), before);
  }
}

TEST(WriteFileAtomically, FullDiskNamesTheSizeAndLeavesNothing) {
  const TemporaryFolder folder;
  if (::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=64k") != 0) {
    GTEST_SKIP() << "mounting a small disk needs root; FailureInTheMiddle tests the same path";
  }
  const auto path = folder.path() / "level_1.ffl";
  const LevelData level = test::random_level(1, 3000, 300);
  const Result<uint64_t> written = write_level(path, level);
  const auto names = folder.names();
  const Result<uint64_t> small = write_level(path, test::full_level());
  ::umount(folder.path().c_str());

  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::Io);
  EXPECT_NE(written.error().message.find(path.string() + ": No space left on device"), std::string::npos);
  EXPECT_NE(written.error().message.find("it needs 1.15 MiB: free some space"), std::string::npos)
      << written.error().message;
  EXPECT_TRUE(names.empty());
  EXPECT_TRUE(small) << "the space was given back";
}

TEST(WriteFileAtomically, ConcurrentWritersOfOnePathLeaveOneWholeFile) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "a";
  std::vector<std::thread> threads;
  for (char c = 'a'; c < 'e'; ++c) {
    threads.emplace_back([&, c] {
      for (int i = 0; i < 5; ++i) EXPECT_TRUE(write_one(path, std::string(100000, c)));
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::string text = *read_small_file(path, 1 << 20);
  EXPECT_EQ(text, std::string(100000, text[0]));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
}

TEST(OpenRegularFile, RefusesWhatIsNotAPlainFile) {
  const TemporaryFolder folder;
  const auto refuse = [](const std::filesystem::path& path, ErrorCode code, const std::string& words) {
    const Result<RegularFile> file = open_regular_file(path);
    ASSERT_FALSE(file) << path;
    EXPECT_EQ(file.error().code, code) << path;
    EXPECT_NE(file.error().message.find(words), std::string::npos) << file.error().message;
  };
  test::write_text(folder.path() / "file", "x");
  std::filesystem::create_symlink(folder.path() / "file", folder.path() / "link");
  std::filesystem::create_symlink("/dev/zero", folder.path() / "endless");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  refuse(folder.path() / "missing", ErrorCode::NotFound, "No such file");
  refuse(folder.path() / "file" / "a", ErrorCode::NotFound, "Not a directory");
  refuse(folder.path() / "link", ErrorCode::BadFile, "symbolic link");
  refuse(folder.path() / "endless", ErrorCode::BadFile, "symbolic link");
  refuse(folder.path() / "pipe", ErrorCode::BadFile, "not a regular file");
  refuse(folder.path(), ErrorCode::BadFile, "not a regular file");
  refuse("/dev/zero", ErrorCode::BadFile, "not a regular file");
  EXPECT_TRUE(open_regular_file(folder.path() / "file"));
}

TEST(ReadSmallFile, RefusesLargeFilesBeforeReadingThem) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "sparse";
  test::write_text(path, "x");
  std::filesystem::resize_file(path, uint64_t{1} << 40);
  const Result<std::string> text = read_small_file(path, 1 << 20);
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, ErrorCode::BadFile);
  EXPECT_NE(text.error().message.find("1.00 TiB"), std::string::npos) << text.error().message;
}

}  // namespace
}  // namespace farfield
