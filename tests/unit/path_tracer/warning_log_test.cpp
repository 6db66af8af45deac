// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/warning_log.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

using Lines = std::vector<std::string>;

TEST(WarningLog, SaysEachLineOnceAndRemembersAllInOrder) {
  Lines said;
  WarningLog log([&](const std::string& line) { said.push_back(line); });
  for (const char* line : {"b", "a", "b", "a", "c"}) log.add(line);
  EXPECT_EQ(said, (Lines{"b", "a", "c"}));
  EXPECT_EQ(log.lines(), said);
}

TEST(WarningLog, WithoutASinkItRemembers) {
  WarningLog log({});
  log.add("a");
  EXPECT_EQ(log.lines(), Lines{"a"});
}

TEST(AddNewLines, KeepsTheOrderOfBoth) {
  Lines lines{"b", "a"};
  add_new_lines(lines, {"c", "b", "c"});
  EXPECT_EQ(lines, (Lines{"b", "a", "c"}));
}

}  // namespace
}  // namespace farfield
