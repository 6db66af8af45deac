// SPDX-License-Identifier: Apache-2.0
// Random bits from a seed: for rays that are numbered, so that none depends on what was drawn before it.
#pragma once

#include <cstdint>

#include "base/hash.h"

namespace farfield {

/// A stream of random bits [Steele, Lea and Flood 2014].
class SplitMix {
 public:
  explicit SplitMix(uint64_t seed) : state_(seed) {}
  uint64_t next() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }
  /// Uniform in [0, 1): 53 bits.
  double next_unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

}  // namespace farfield
