// SPDX-License-Identifier: Apache-2.0
#include "tools/args.h"

#include <gtest/gtest.h>

namespace farfield::tool {
namespace {

TEST(ParsePixelSize, ReadsWidthAndHeight) {
  const auto size = parse_pixel_size("640x360");
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 640);
  EXPECT_EQ(size->height, 360);
  EXPECT_TRUE(parse_pixel_size("1x1"));
  EXPECT_TRUE(parse_pixel_size("65536x65536"));
}

TEST(ParsePixelSize, RefusesEverythingElseInOneLineThatQuotesIt) {
  for (const char* text : {"", "x", "640", "640x", "x360", "640X360", "640x360x1", "0x10", "10x0", "-4x4", "4x-4",
                           "65537x1", "1x99999999999999999999", "640 x 360", "6.4x4", " 4x4", "4x4 ", "+4x4", "0x1f"}) {
    const auto size = parse_pixel_size(text);
    ASSERT_FALSE(size) << text;
    EXPECT_EQ(size.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(size.error().message.find('"' + std::string(text) + '"'), std::string::npos);
    EXPECT_EQ(size.error().message.find('\n'), std::string::npos);
  }
}

TEST(ParsePixelPlace, ReadsAPlaceInAPicture) {
  const auto place = parse_pixel_place("320,0");
  ASSERT_TRUE(place);
  EXPECT_EQ(place->x, 320);
  EXPECT_EQ(place->y, 0);
  for (const char* text : {"", ",", "3", "3,", "-1,2", "1,65536", "1x2", "1,2,3", "1.5,2"})
    EXPECT_FALSE(parse_pixel_place(text)) << text;
}

TEST(ParseLevelRange, ReadsARangeOrOneLevel) {
  const auto range = parse_level_range("2-5");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 2u);
  EXPECT_EQ(range->last, 5u);
  const auto one = parse_level_range("3");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->first, 3u);
  EXPECT_EQ(one->last, 3u);
  EXPECT_TRUE(parse_level_range("0-0"));
}

TEST(ParseLevelRange, RefusesEverythingElse) {
  for (const char* text : {"", "-", "2-", "-5", "5-2", "2-5-7", "a-b", "2..5", "2 - 5", "0-1001", "99999999999", "1.5"})
    EXPECT_FALSE(parse_level_range(text)) << text;
}

TEST(ParsePixelError, ReadsNumbersAboveZero) {
  EXPECT_EQ(parse_pixel_error("0.5").value(), 0.5f);
  EXPECT_EQ(parse_pixel_error("1e3").value(), 1000.0f);
  for (const char* text : {"", "0", "-1", "nan", "inf", "2x", " 1", "1e7", "1,5"})
    EXPECT_FALSE(parse_pixel_error(text)) << text;
}

TEST(ParseFinestGrid, ReadsPowersOfTwo) {
  EXPECT_EQ(parse_finest_grid("8").value(), 8u);
  EXPECT_EQ(parse_finest_grid("1024").value(), 1024u);
  for (const char* text : {"", "0", "4", "100", "-64", "64.0", "131072", "many"})
    EXPECT_FALSE(parse_finest_grid(text)) << text;
}

TEST(ParseBudget, RefusesNothing) {
  EXPECT_EQ(parse_budget("2K").value(), 2048u);
  for (const char* text : {"0", "-1", "lots", ""}) EXPECT_FALSE(parse_budget(text)) << text;
}

TEST(ParseRaysPerVoxel, ReadsCounts) {
  EXPECT_EQ(parse_rays_per_voxel("200").value(), 200u);
  for (const char* text : {"0", "-1", "1.5", "", "1000001"}) EXPECT_FALSE(parse_rays_per_voxel(text)) << text;
}

TEST(ParsePart, ReadsANumberBelowACount) {
  EXPECT_EQ(parse_part("3/8")->number, 3u);
  EXPECT_EQ(parse_part("3/8")->count, 8u);
  EXPECT_TRUE(parse_part("0/1"));
  for (const char* text : {"", "/", "8/8", "9/8", "-1/8", "0/0", "1", "1/", "a/b", "1/2/3"})
    EXPECT_FALSE(parse_part(text)) << text;
}

TEST(ParseList, ReadsEachValueAndRefusesTheSameTwice) {
  EXPECT_EQ(parse_list(std::string_view("1,0.5,2"), parse_pixel_error).value(), (std::vector<float>{1, 0.5f, 2}));
  EXPECT_EQ(parse_list(std::string_view("2G"), parse_budget).value(), (std::vector<uint64_t>{uint64_t{2} << 30}));
  for (const char* text : {"", "1,", ",1", "1,,2", "1;2", "1,1.0", "1,x"})
    EXPECT_FALSE(parse_list(std::string_view(text), parse_pixel_error)) << text;
  EXPECT_NE(parse_list(std::string_view("1,2,1"), parse_pixel_error).error().message.find("twice"), std::string::npos);
}

TEST(ParseLevels, ReadsNumbersOrAll) {
  EXPECT_EQ(parse_levels("3").value(), (std::vector<uint32_t>{3}));
  EXPECT_EQ(parse_levels("5,0,2").value(), (std::vector<uint32_t>{5, 0, 2}));
  EXPECT_TRUE(parse_levels("all").value().empty());
  for (const char* text : {"", "all,1", "1,", "-1", "1001", "2-5", "two", "2,2"})
    EXPECT_FALSE(parse_levels(text)) << text;
}

}  // namespace
}  // namespace farfield::tool
