// SPDX-License-Identifier: Apache-2.0
#include "prefilter/vertex_fan.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

bool is_ring(std::vector<LinkEdge> link) { return is_one_fan(link, false); }
bool is_line(std::vector<LinkEdge> link) { return is_one_fan(link, true); }

TEST(VertexFan, InsideIsARingInAnyOrder) {
  EXPECT_TRUE(is_ring({{0, 1}, {1, 2}, {2, 0}}));
  EXPECT_TRUE(is_ring({{3, 2}, {0, 1}, {3, 0}, {1, 2}}));
  EXPECT_FALSE(is_line({{0, 1}, {1, 2}, {2, 0}}));
}

TEST(VertexFan, AtABorderIsALine) {
  EXPECT_TRUE(is_line({{0, 1}}));
  EXPECT_TRUE(is_line({{4, 2}, {0, 1}, {1, 2}}));
  EXPECT_FALSE(is_ring({{4, 2}, {0, 1}, {1, 2}}));
}

TEST(VertexFan, IsNotOneWhereTrianglesCoincidePinchOrBranch) {
  EXPECT_FALSE(is_ring({}));
  EXPECT_FALSE(is_ring({{0, 1}, {1, 0}}));                                  // the same triangle twice
  EXPECT_FALSE(is_ring({{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}}));  // two cones, tip to tip
  EXPECT_FALSE(is_ring({{0, 1}, {1, 2}, {2, 0}, {0, 3}, {3, 4}, {4, 0}}));  // two rings that share a corner
  EXPECT_FALSE(is_line({{0, 1}, {1, 2}, {1, 3}}));                          // three faces at an edge
  EXPECT_FALSE(is_line({{0, 1}, {2, 3}}));                                  // two fans
}

}  // namespace
}  // namespace farfield
