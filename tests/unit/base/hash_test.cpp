// SPDX-License-Identifier: Apache-2.0
#include "base/hash.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/file_io.h"
#include "base/random.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

TEST(HashBytes, IsXxh3) { EXPECT_EQ(to_hex(hash_bytes({})), "2d06800538d394c2"); }  // the published XXH3 of no bytes

TEST(HashBytes, DependsOnEveryByteAndTheSeed) {
  std::vector<uint32_t> values = {1, 2, 3};
  const uint64_t before = hash_values<uint32_t>(values);
  EXPECT_NE(before, hash_values<uint32_t>(values, 1));
  values[2] ^= 1u << 31;
  EXPECT_NE(before, hash_values<uint32_t>(values));
}

TEST(ToUnitFloat, StaysBelowOne) {
  EXPECT_EQ(to_unit_float(0), 0.0f);
  EXPECT_LT(to_unit_float(~uint64_t{0}), 1.0f);
}

TEST(Rng, IsUniformAndRepeatable) {
  Rng a(7, 3), b(7, 3), other(7, 4);
  double sum = 0;
  int equal = 0;
  for (int i = 0; i < 100000; ++i) {
    const float x = a.next();
    EXPECT_EQ(x, b.next());
    equal += x == other.next();
    ASSERT_TRUE(x >= 0.0f && x < 1.0f);
    sum += x;
  }
  EXPECT_NEAR(sum / 100000, 0.5, 4 * 0.2887 / 316.2);  // 4 standard errors of the mean of 1e5 uniforms
  EXPECT_LT(equal, 10);
}

TEST(HashFile, OfPiecesIsThatOfTheWhole) {
  const test::TemporaryFolder folder;
  for (const size_t size : {0, 1, 16383, 16384, 16385, 100000}) {
    std::vector<std::byte> bytes(size);
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(mix64(i));
    test::write_bytes(folder.path() / "file", bytes);
    const auto hash = hash_file(folder.path() / "file");
    ASSERT_TRUE(hash) << hash.error().message;
    EXPECT_EQ(*hash, hash_bytes(bytes)) << size;
  }
  EXPECT_FALSE(hash_file(folder.path() / "missing"));
}

}  // namespace
}  // namespace farfield
