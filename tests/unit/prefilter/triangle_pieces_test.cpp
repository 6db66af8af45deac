// SPDX-License-Identifier: Apache-2.0
#include "prefilter/triangle_pieces.h"

#include <gtest/gtest.h>

#include <vector>

namespace farfield {
namespace {

std::vector<TrianglePiece> pieces_of(const TrianglePiece& t, double longest) {
  std::vector<TrianglePiece> pieces;
  for_each_piece(t, longest, [&](const TrianglePiece& piece) { pieces.push_back(piece); });
  return pieces;
}

/// Fat, flat, needles of several widths, without area, and a point.
const std::vector<TrianglePiece> kTriangles = {
    {dvec3(0, 0, 0), dvec3(10, 0, 0), dvec3(0, 9, 3)},      {dvec3(0, 0, 0), dvec3(100, 0, 0), dvec3(50, 0.01, 0)},
    {dvec3(0, 0, 0), dvec3(100, 0, 0), dvec3(100, 0, 0.1)}, {dvec3(0, 0, 0), dvec3(100, 3, 0), dvec3(101, 0, 0)},
    {dvec3(7, 0, 0), dvec3(-100, 9, 5), dvec3(9, 2, 0)},    {dvec3(0, 0, 0), dvec3(40, 0, 0), dvec3(40, 0, 0)},
    {dvec3(1, 2, 3), dvec3(1, 2, 3), dvec3(1, 2, 3)},       {dvec3(0, 0, 0), dvec3(0.5, 0, 0), dvec3(0, 0.5, 0)}};

TEST(TrianglePieces, HaveNoLongEdge) {
  for (const TrianglePiece& t : kTriangles) {
    for (const TrianglePiece& piece : pieces_of(t, 1)) {
      for (size_t c = 0; c < 3; ++c) EXPECT_LE(glm::length(piece[(c + 1) % 3] - piece[c]), 1 + 1e-12);
    }
  }
}

TEST(TrianglePieces, MakeUpTheTriangle) {
  // Area, first moments and winding: what overlapped or was left out would show in one of them.
  for (const TrianglePiece& t : kTriangles) {
    dvec3 area(0.0), moment(0.0);
    for (const TrianglePiece& piece : pieces_of(t, 1)) {
      area += area_vector_of(piece);
      moment += glm::length(area_vector_of(piece)) * middle_of(piece);
      EXPECT_GE(glm::dot(area_vector_of(piece), area_vector_of(t)), -1e-9);
    }
    EXPECT_LT(glm::length(area - area_vector_of(t)), 1e-9 * (1 + glm::length(area)));
    EXPECT_LT(glm::length(moment - glm::length(area_vector_of(t)) * middle_of(t)), 1e-9 * (1 + glm::length(moment)));
  }
}

TEST(TrianglePieces, OfANeedleGrowWithItsLength) {
  for (const double length : {10.0, 100.0, 1000.0, 10'000.0}) {
    for (const double width : {0.0, 0.01, 0.5, 2.0}) {
      const auto pieces = pieces_of({dvec3(0, 0, 0), dvec3(length, 0, 0), dvec3(length, width, 0)}, 1);
      EXPECT_LT(static_cast<double>(pieces.size()), 8 * length * std::max(1.0, width * width))
          << length << " " << width;
    }
  }
}

}  // namespace
}  // namespace farfield
