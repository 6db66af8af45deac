// SPDX-License-Identifier: Apache-2.0
#include "tools/console.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace farfield::tool {
namespace {

namespace fs = std::filesystem;

fs::path fresh_folder(const char* name) {
  const fs::path folder = fs::path(testing::TempDir()) / "farfield_console_test" / name;  // names differ per test
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::string contents(const fs::path& path) {
  std::stringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST(FormatTable, AlignsColumnsToTheRight) {
  EXPECT_EQ(format_table({{"level", "x"}, {"1", "1000"}}), "level     x\n    1  1000\n");
  EXPECT_EQ(format_table({}), "");
}

TEST(OneLine, HasNoControlCharacters) {
  EXPECT_EQ(one_line("a\nb\tc\x1b[31m\n\n"), "a; b?c?[31m");
  EXPECT_EQ(one_line(""), "");
  EXPECT_EQ(one_line("Eiche \xc3\xa4"), "Eiche \xc3\xa4");
}

TEST(CheckCanWrite, FindsOutBeforeTheWorkIsDone) {
  const fs::path folder = fresh_folder("check");
  EXPECT_TRUE(check_can_write({}, Output::Text));
  EXPECT_TRUE(check_can_write(folder / "new.json", Output::Text));
  EXPECT_TRUE(check_can_write("beside.json", Output::Text));
  for (const fs::path& bad : {folder / "missing" / "new.json", folder}) {
    const auto checked = check_can_write(bad, Output::Text);
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::Io);
    EXPECT_NE(checked.error().message.find(bad.string()), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(folder / "new.json"));
}

TEST(CheckCanWrite, NeverLetsAPictureReplaceADevice) {
  EXPECT_TRUE(check_can_write("/dev/null", Output::Text));
  EXPECT_FALSE(check_can_write("/dev/null", Output::Png));
}

TEST(CheckCanWrite, WantsPicturesNamedByTheirKind) {
  EXPECT_TRUE(check_can_write("a.exr", Output::Exr));
  EXPECT_TRUE(check_can_write("a.png", Output::Png));
  for (const char* name : {"a.png", "a.jpg", "a", ".exr"}) EXPECT_FALSE(check_can_write(name, Output::Exr)) << name;
  EXPECT_FALSE(check_can_write("a.exr", Output::Png));
}

TEST(CheckCanWrite, NeverReplacesWhatIsRead) {
  const fs::path folder = fresh_folder("inputs");
  ASSERT_TRUE(write_text_file(folder / "oak.obj", "v"));
  const std::vector<fs::path> inputs = {folder / "oak.obj", folder / "oak.farfield", ""};
  EXPECT_TRUE(check_can_write(folder / "oak.json", Output::Text, inputs));
  for (const fs::path& bad :
       {folder / "oak.obj", folder / "." / "oak.obj", folder / "oak.farfield" / "manifest.json"}) {
    const auto checked = check_can_write(bad, Output::Text, inputs);
    ASSERT_FALSE(checked) << bad;
    EXPECT_EQ(checked.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(WriteTextFile, WritesIntoDevicesWithoutReplacingThem) {
  ASSERT_TRUE(write_text_file("/dev/null", "text"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  const auto full = write_text_file("/dev/full", "text");
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().message.find("No space left"), std::string::npos);
}

TEST(WriteTextFile, ReplacesTheWholeFileAndLeavesNothingElse) {
  const fs::path folder = fresh_folder("write");
  ASSERT_TRUE(write_text_file(folder / "a.json", "first, longer"));
  ASSERT_TRUE(write_text_file(folder / "a.json", "second"));
  EXPECT_EQ(contents(folder / "a.json"), "second");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST(WriteTextFile, SaysWhyItCannot) {
  const fs::path folder = fresh_folder("fail");
  const auto written = write_text_file(folder / "missing" / "a.json", "text");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::Io);
  EXPECT_NE(written.error().message.find("No such file"), std::string::npos);
  fs::create_directory(folder / "taken");
  EXPECT_FALSE(write_text_file(folder / "taken", "text"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

}  // namespace
}  // namespace farfield::tool
