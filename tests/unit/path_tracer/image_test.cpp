// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/image.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <fstream>

#include "base/random.h"
#include "base/texture_module.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

Image noise_image(int width, int height, std::vector<std::string> channels) {
  Image image(width, height, std::move(channels));
  Rng rng(7);
  for (float& value : image.values) value = 100 * (rng.next() - 0.3f);
  return image;
}

std::vector<uint8_t> read_png(const std::filesystem::path& path, int& width, int& height, int& channels) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&png, path.c_str())) return {};
  width = static_cast<int>(png.width), height = static_cast<int>(png.height);
  channels = PNG_IMAGE_SAMPLE_CHANNELS(png.format);
  if (png.format != PNG_FORMAT_RGB) return {};  // 8-bit RGB is read as it is stored
  std::vector<uint8_t> values(PNG_IMAGE_SIZE(png));
  if (!png_image_finish_read(&png, nullptr, values.data(), 0, nullptr)) return {};
  return values;
}

TEST(Exr, ReturnsEveryChannelBitForBitInOrder) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> names = {"R", "G", "B", "A", "lod.blend", "lod.footprint", "lod.level", "lod.volume"};
  Image image = noise_image(37, 19, names);
  image.values[3] = std::numeric_limits<float>::infinity();
  image.values[5] = -0.0f;
  image.values[8] = 1e-42f;
  ASSERT_TRUE(write_exr(folder.path() / "a.exr", image));
  const auto file = read_exr(folder.path() / "a.exr");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->image.width, 37);
  EXPECT_EQ(file->image.height, 19);
  EXPECT_EQ(file->image.channels, names);
  EXPECT_EQ(std::memcmp(file->image.values.data(), image.values.data(), image.values.size() * sizeof(float)), 0);
}

TEST(Exr, OtherReadersFindTheChannelsByName) {
  const test::TemporaryFolder folder;
  const Image image = noise_image(5, 4, {"lod.level", "B", "A", "G", "R"});
  ASSERT_TRUE(write_exr(folder.path() / "a.exr", image));
  const auto module = texture_module();
  ASSERT_TRUE(module) << module.error().message;
  const auto theirs = (*module)->read_file((folder.path() / "a.exr").string());
  ASSERT_TRUE(theirs) << theirs.error().message;
  ASSERT_EQ(theirs->channels, 4);  // R, G, B, A, whatever the order in the file
  ASSERT_EQ(theirs->values.size(), 80u);
  const int at[] = {4, 3, 1, 2};
  for (int i = 0; i < 20; ++i) {
    for (int c = 0; c < 4; ++c)
      EXPECT_EQ(theirs->values[static_cast<size_t>(4 * i + c)], image.pixel(i % 5, i / 5)[at[c]]);
  }
  const auto ours = read_exr(folder.path() / "a.exr");
  EXPECT_EQ(ours->image.channels, (std::vector<std::string>{"R", "G", "B", "A", "lod.level"}));
}

TEST(Exr, ReturnsMetadata) {
  const test::TemporaryFolder folder;
  const Metadata metadata = {{"camera.position", vec3(1.5f, -2.0f, 1e7f)},
                             {"farfield.frame", 42},
                             {"farfield.pixel_error", 0.1f},
                             {"farfield.scene", std::string("forest \"x\" \u00e4.glb")},
                             {"empty", std::string()}};
  ASSERT_TRUE(write_exr(folder.path() / "a.exr", noise_image(2, 2, {"R", "G", "B"}), metadata));
  EXPECT_EQ(read_exr(folder.path() / "a.exr")->metadata, metadata);
}

TEST(Exr, BytesDependOnTheArgumentsAlone) {
  const test::TemporaryFolder folder;
  const Image image = noise_image(20, 10, {"R", "G", "B", "A"});
  ASSERT_TRUE(write_exr(folder.path() / "a.exr", image, {{"x", 1}}));
  ASSERT_TRUE(write_exr(folder.path() / "b.exr", image, {{"x", 1}}));
  EXPECT_EQ(test::read_bytes(folder.path() / "a.exr"), test::read_bytes(folder.path() / "b.exr"));
}

TEST(Exr, FailuresNameTheFile) {
  const test::TemporaryFolder folder;
  const Image image = noise_image(2, 2, {"R", "G", "B"});
  const auto nowhere = write_exr(folder.path() / "no" / "such" / "a.exr", image);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, ErrorCode::Io);
  EXPECT_NE(nowhere.error().message.find("a.exr"), std::string::npos);
  EXPECT_EQ(write_exr(folder.path() / "a.exr", Image()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(read_exr(folder.path() / "none.exr").error().code, ErrorCode::NotFound);
  EXPECT_TRUE(folder.names().empty());
}

TEST(Exr, FullDiskIsAnErrorAndKeepsTheOldFile) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.exr";
  const Image image = noise_image(40, 40, {"R", "G", "B", "A"});
  ASSERT_TRUE(write_exr(path, image));
  const std::vector<std::byte> bytes = test::read_bytes(path);
  for (size_t size = 0; size < bytes.size(); size += 509) {
    const test::FileSizeLimit limit(size);
    const auto written = write_exr(path, image);
    ASSERT_FALSE(written) << size << " of " << bytes.size();
    EXPECT_EQ(written.error().code, ErrorCode::Io);
    EXPECT_NE(written.error().message.find(path.string() + ": File too large"), std::string::npos);
    EXPECT_EQ(test::read_bytes(path), bytes);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.exr"});
  }
}

TEST(Png, FullDiskIsAnErrorAndKeepsTheOldFile) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.png";
  const Image image = noise_image(60, 60, {"R", "G", "B"});
  ASSERT_TRUE(write_png(path, image));
  const std::vector<std::byte> bytes = test::read_bytes(path);
  for (size_t size = 0; size < bytes.size(); size += 509) {
    const test::FileSizeLimit limit(size);
    const auto written = write_png(path, image);
    ASSERT_FALSE(written) << size << " of " << bytes.size();
    EXPECT_EQ(written.error().code, ErrorCode::Io);
    EXPECT_NE(written.error().message.find("File too large"), std::string::npos) << written.error().message;
    EXPECT_EQ(test::read_bytes(path), bytes);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.png"});
  }
}

TEST(Exr, EveryTruncationIsAnError) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.exr";
  ASSERT_TRUE(write_exr(path, noise_image(8, 8, {"R", "G", "B", "A"})));
  const std::vector<std::byte> bytes = test::read_bytes(path);
  for (size_t size = 0; size < bytes.size(); size += size < 400 ? 1 : 37) {
    test::write_bytes(path, std::span(bytes).first(size));
    const auto file = read_exr(path);
    ASSERT_FALSE(file) << size << " of " << bytes.size();
    EXPECT_EQ(file.error().code, ErrorCode::BadFile);
  }
}

TEST(Exr, FlippedBitsNeverCrash) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.exr";
  ASSERT_TRUE(write_exr(path, noise_image(8, 8, {"R", "G", "B", "A"}), {{"x", 1}}));
  const std::vector<std::byte> bytes = test::read_bytes(path);
  Rng rng(3);
  for (int i = 0; i < 400; ++i) {
    std::vector<std::byte> broken = bytes;
    const size_t at = rng.next_uint() % std::min<size_t>(broken.size(), 400);  // header and tables
    broken[at] ^= static_cast<std::byte>(1u << (rng.next_uint() % 8));
    test::write_bytes(path, broken);
    const auto file = read_exr(path);  // either is fine
    if (!file) {
      EXPECT_FALSE(file.error().message.empty());
    }
  }
}

TEST(Png, IsSrgbAndClipped) {
  const test::TemporaryFolder folder;
  Image image(5, 1, {"R", "G", "B", "A"});
  const float values[] = {0.0f, 0.2158605f, 1.0f, 7.0f, std::numeric_limits<float>::quiet_NaN()};
  for (int x = 0; x < 5; ++x) std::fill_n(image.pixel(x, 0), 3, values[x]);
  ASSERT_TRUE(write_png(folder.path() / "a.png", image));
  int width = 0, height = 0, channels = 0;
  const std::vector<uint8_t> bytes = read_png(folder.path() / "a.png", width, height, channels);
  EXPECT_EQ(channels, 3);
  ASSERT_EQ(bytes.size(), 15u);
  const std::vector<uint8_t> red = {bytes[0], bytes[3], bytes[6], bytes[9], bytes[12]};
  EXPECT_EQ(red, (std::vector<uint8_t>{0, 128, 255, 255, 0}));  // 0.2158605 is sRGB 128 / 255
}

TEST(Png, ExposureIsInStops) {
  const test::TemporaryFolder folder;
  Image image(1, 1, {"R", "G", "B"});
  image.values = {0.2158605f / 4, 0.2158605f / 4, 0.2158605f / 4};
  ASSERT_TRUE(write_png(folder.path() / "a.png", image, {2.0f}));
  int width = 0, height = 0, channels = 0;
  EXPECT_EQ(read_png(folder.path() / "a.png", width, height, channels)[0], 128);
}

TEST(Png, OneChannelIsGrey) {
  const test::TemporaryFolder folder;
  Image image(1, 1, {"depth"});
  image.values = {1.0f};
  ASSERT_TRUE(write_png(folder.path() / "a.png", image));
  int width = 0, height = 0, channels = 0;
  EXPECT_EQ(read_png(folder.path() / "a.png", width, height, channels), (std::vector<uint8_t>{255, 255, 255}));
}

TEST(Png, FailuresNameTheFileAndLeaveNothing) {
  const test::TemporaryFolder folder;
  const auto nowhere = write_png(folder.path() / "no" / "a.png", noise_image(2, 2, {"R", "G", "B"}));
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, ErrorCode::Io);
  EXPECT_NE(nowhere.error().message.find("a.png"), std::string::npos);
  EXPECT_EQ(write_png(folder.path() / "a.png", Image()).error().code, ErrorCode::InvalidArgument);
  EXPECT_TRUE(folder.names().empty());
}

TEST(Downsample, KeepsTheMeanAndHandlesPartialBlocks) {
  Image image(5, 3, {"R"});
  for (int i = 0; i < 15; ++i) image.values[static_cast<size_t>(i)] = static_cast<float>(i);
  const Image half = downsample(image, 2);
  EXPECT_EQ(half.width, 3);
  EXPECT_EQ(half.height, 2);
  EXPECT_EQ(half.values, (std::vector<float>{3, 5, 6.5f, 10.5f, 12.5f, 14}));
  EXPECT_EQ(downsample(image, 1).values, image.values);
  EXPECT_EQ(downsample(image, 100).values, (std::vector<float>{7}));
}

TEST(SelectChannels, ReordersAndFillsWithZero) {
  Image image(2, 1, {"A", "R"});
  image.values = {1, 2, 3, 4};
  EXPECT_EQ(select_channels(image, {"R", "G", "A"}).values, (std::vector<float>{2, 0, 1, 4, 0, 3}));
}

TEST(ContactSheet, PutsImagesRowByRowAndScalesThemDown) {
  ContactSheet sheet(3, 2, 2, 2, 1);
  EXPECT_EQ(sheet.image().width, 5);
  EXPECT_EQ(sheet.image().height, 5);
  Image large(4, 4, {"R", "G", "B", "A"});
  std::fill(large.values.begin(), large.values.end(), 8.0f);
  Image small(1, 1, {"R", "G", "B"});
  small.values = {1, 2, 3};
  sheet.set(0, large);
  sheet.set(2, small);
  EXPECT_EQ(sheet.image().pixel(1, 1)[0], 8.0f);
  EXPECT_EQ(sheet.image().pixel(2, 0)[0], 0.0f);  // the gap
  EXPECT_EQ(sheet.image().pixel(3, 0)[0], 0.0f);  // an empty cell
  EXPECT_EQ(sheet.image().pixel(0, 3)[2], 3.0f);
  EXPECT_EQ(sheet.image().pixel(1, 3)[2], 0.0f);  // beside the small image
}

}  // namespace
}  // namespace farfield
