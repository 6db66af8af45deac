// SPDX-License-Identifier: Apache-2.0
#include "prefilter/self_shadowing.h"

#include <algorithm>
#include <cmath>

namespace farfield {

void EscapeSums::add(const vec3& direction, float weight, bool gets_away) {
  if (!(weight > 0)) return;
  light_.push_back({direction, weight});
  if (gets_away) away_ += weight;
}

double EscapeSums::ratio(const SymMat3& s, double density, double length) const {
  if (light_.empty()) return 1;
  double away_in_medium = 0;
  for (const Light& light : light_) {
    const double sigma = std::sqrt(std::max(0.0f, s.quadratic(light.direction)));
    away_in_medium += light.weight * std::exp(-density * sigma * length);
  }
  if (!(away_ > 0)) return kLeastEscape;
  return away_ < kMostEscape * away_in_medium ? std::max(away_ / away_in_medium, kLeastEscape) : kMostEscape;
}

}  // namespace farfield
