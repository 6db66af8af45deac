// SPDX-License-Identifier: Apache-2.0
#include "base/bytes.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

TEST(FormatBytes, UsesBinaryUnits) {
  EXPECT_EQ(format_bytes(0), "0 B");
  EXPECT_EQ(format_bytes(1023), "1023 B");
  EXPECT_EQ(format_bytes(1536), "1.50 KiB");
  EXPECT_EQ(format_bytes(uint64_t{5} << 40), "5.00 TiB");
}

TEST(ParseBytes, ReadsWhatPeopleWrite) {
  EXPECT_EQ(parse_bytes("1536").value(), 1536u);
  EXPECT_EQ(parse_bytes("300K").value(), 300u * 1024);
  EXPECT_EQ(parse_bytes("1.5m").value(), 1536u * 1024);
  EXPECT_EQ(parse_bytes("4GiB").value(), uint64_t{4} << 30);
  EXPECT_EQ(parse_bytes("12B").value(), 12u);
}

TEST(ParseBytes, ReadsWhatFormatBytesWrites) {
  for (const uint64_t bytes : {uint64_t{0}, uint64_t{1023}, uint64_t{1536}, uint64_t{1} << 30, uint64_t{5} << 40})
    EXPECT_EQ(parse_bytes(format_bytes(bytes)).value_or(1), bytes) << format_bytes(bytes);
}

TEST(ParseBytes, RefusesTheRest) {
  for (const char* text : {"", "x", "-1", "12Q", "1KK", "1e300", "nan", "inf", " 5", "G", "5 ", "5  M", "5 M B"}) {
    const Result<uint64_t> result = parse_bytes(text);
    ASSERT_FALSE(result) << text;
    EXPECT_EQ(result.error().code, ErrorCode::InvalidArgument);
  }
}

}  // namespace
}  // namespace farfield
