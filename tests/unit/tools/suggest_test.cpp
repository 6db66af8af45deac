// SPDX-License-Identifier: Apache-2.0
#include "tools/suggest.h"

#include <gtest/gtest.h>

#include <vector>

namespace farfield::tool {
namespace {

const std::vector<std::string> kCommands = {"bake", "info", "verify", "evaluate", "render", "shot", "sky"};
const std::vector<std::string> kOptions = {"-o", "--output", "--budget", "--spp", "--seed"};

TEST(NearestName, IsAtMostTwoLettersAway) {
  EXPECT_EQ(nearest_name("bkae", kCommands), "bake");           // two replaced
  EXPECT_EQ(nearest_name("bak", kCommands), "bake");            // left out
  EXPECT_EQ(nearest_name("evalluate", kCommands), "evaluate");  // added
  EXPECT_EQ(nearest_name("veri", kCommands), "verify");
  EXPECT_EQ(nearest_name("ver", kCommands), std::nullopt);
  EXPECT_EQ(nearest_name("frobnicate", kCommands), std::nullopt);
  EXPECT_EQ(nearest_name("", kCommands), std::nullopt);
  EXPECT_EQ(nearest_name("bake", {}), std::nullopt);
  EXPECT_EQ(nearest_name(std::string(1 << 20, 'b'), kCommands), std::nullopt);
}

TEST(NearestName, OfOptionsKeepsTheirDashesAndDoesNotCountThem) {
  EXPECT_EQ(nearest_name("--bugdet", kOptions), "--budget");
  EXPECT_EQ(nearest_name("-budget", kOptions), "--budget");
  EXPECT_EQ(nearest_name("--sp", kOptions), "--spp");
  EXPECT_EQ(nearest_name("-z", kOptions), std::nullopt);  // every letter is one letter away from -o
  EXPECT_EQ(nearest_name("--", kOptions), std::nullopt);
}

TEST(NearestName, IsTheNearestAndOfEqualOnesTheFirst) {
  const std::vector<std::string> names = {"brake", "bike", "bake", "cake"};
  EXPECT_EQ(nearest_name("bake", names), "bake");
  EXPECT_EQ(nearest_name("fake", names), "bake");
}

}  // namespace
}  // namespace farfield::tool
