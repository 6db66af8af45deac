// SPDX-License-Identifier: Apache-2.0
// One step towards a medium that stops the lines that its source stops.
//
// Let A be 1 for a line that the geometry stops, T what the medium lets through of it, and d its depth in one part of
// the medium. The sum of squares of A - (1 - T) is least where for each part
//
//    sum d T A  =  sum d T (1 - T),
//
// and the ratio of the two sides says by how much its density is wrong. Expected hits per part, which would make every
// part right as seen from outside, blur silhouettes and empty the inside (measured in docs/decisions/0012).
#pragma once

#include <cmath>
#include <vector>

#include "prefilter/line_scene.h"
#include "prefilter/voxel_ratios.h"

namespace farfield {

/// A step changes a density by no larger factor.
inline constexpr double kMostMatch = 1.5;
/// How much no change counts against what lines say, in units of sum d T A.
inline constexpr double kPriorMatch = 1;

/// Both sides of the equation for every part of a medium. visit_parts(ray, visit) calls visit(number of the part, depth
/// there) for the parts that the ray passes through. Errors: Cancelled.
template <typename VisitParts>
Result<std::vector<SourceAndMedium>> match_lines(const LineScene& scene, size_t part_count, const LinePass& pass,
                                                 const VisitParts& visit_parts) {
  struct Part {
    uint32_t number;
    double depth;
  };
  std::vector<SourceAndMedium> sums(part_count);
  FARFIELD_TRY(for_lines(scene, pass, [&](const SeenLine& line, SplitMix&) {
    thread_local std::vector<Part> parts;
    parts.clear();
    double depth = 0;
    visit_parts(line.ray, [&](uint32_t number, double of_part) {
      parts.push_back({number, of_part});
      depth += of_part;
    });
    const double passing = std::exp(-depth), stopped = -std::expm1(-depth);
    for (const Part& part : parts) {
      if (line.hit) sums[part.number].source.add(part.depth * passing);
      sums[part.number].medium.add(part.depth * passing * stopped);
    }
  }));
  return sums;
}

}  // namespace farfield
