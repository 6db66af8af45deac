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

}  // namespace
}  // namespace farfield::tool
