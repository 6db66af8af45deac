// SPDX-License-Identifier: Apache-2.0
#include "import/read_file.h"

#include <gtest/gtest.h>

#include "tests/support/files.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

using namespace test;

std::string text(const std::vector<unsigned char>& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(ReadFile, GivesPlainAndGzippedContentAlike) {
  const TemporaryFolder folder;
  const std::string content(100000, 'x');
  EXPECT_EQ(text(*read_file(folder.write("plain.txt", content))), content);
  EXPECT_EQ(text(*read_file(folder.write("packed.gz", gzip(content)))), content);
  EXPECT_EQ(text(*read_file(folder.write("unmarked.txt", gzip(content)))), content);
  EXPECT_EQ(text(*read_file(folder.write("joined.gz", gzip("one ") + gzip("two")))), "one two");
  EXPECT_EQ(text(*read_file(folder.write("padded.gz", gzip("one") + std::string(7, '\0')))), "one");
  EXPECT_EQ(text(*read_file(folder.write("empty.txt", ""))), "");
  EXPECT_EQ(text(*read_file(folder.write("nothing.gz", gzip("")))), "");
}

TEST(ReadFile, EveryTruncationOfGzipIsAnError) {
  const TemporaryFolder folder;
  std::string content;
  for (int i = 0; i < 200; ++i) content += std::to_string(i * i) + " ";
  const std::string packed = gzip(content);
  for (size_t length = 3; length < packed.size(); ++length) {
    const auto bytes = read_file(folder.write("cut.gz", packed.substr(0, length)));
    ASSERT_FALSE(bytes) << length;
    EXPECT_EQ(bytes.error().code, ErrorCode::BadFile);
  }
}

TEST(ReadFile, FlippedBitsInGzipNeverChangeTheContentUnnoticed) {
  const TemporaryFolder folder;
  const std::string content = std::string(3000, 'a') + "some end", packed = gzip(content);
  for (size_t bit = 8 * 10; bit < 8 * packed.size(); ++bit) {  // behind the header, whose fields may mean nothing
    std::string broken = packed;
    broken[bit / 8] = static_cast<char>(broken[bit / 8] ^ (1 << (bit % 8)));
    const auto bytes = read_file(folder.write("flipped.gz", broken));
    EXPECT_EQ(bytes ? text(*bytes) : content, content) << bit;  // bits without a meaning may pass
  }
}

TEST(ReadFile, BombIsRefusedBeforeItUnpacks) {
  const TemporaryFolder folder;
  // 300 MB of zeros pack to 0.3 MB; beyond 256 MiB that is no mesh.
  const std::string bomb = gzip(std::string(300'000'000, '\0'));
  ASSERT_LT(bomb.size(), 500'000u);
  const auto bytes = read_file(folder.write("bomb.gz", bomb));
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::Unsupported);
  EXPECT_NE(bytes.error().message.find("bomb.gz"), std::string::npos);
}

TEST(ReadFile, WhatIsNoRegularFileIsAnError) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_file(folder.path() / "missing.obj").error().code, ErrorCode::NotFound);
  EXPECT_EQ(read_file(folder.path()).error().code, ErrorCode::Io);
  EXPECT_EQ(read_file("/dev/zero").error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace farfield
