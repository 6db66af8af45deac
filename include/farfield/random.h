// SPDX-License-Identifier: Apache-2.0
// The stream of random numbers that samplers draw from. Hosts seed it from their own sampler.
#pragma once

#include <cstdint>

namespace farfield {

/// A small random stream (PCG32) [O'Neill 2014]. Copyable value; one thread at a time.
/// Two streams with different `sequence` never overlap.
class Rng {
 public:
  explicit Rng(uint64_t seed, uint64_t sequence = 0) : increment_((sequence << 1u) | 1u) {
    next_uint();
    state_ += seed;
    next_uint();
  }

  uint32_t next_uint() {
    const uint64_t old = state_;
    state_ = old * 6364136223846793005ull + increment_;
    const auto shifted = static_cast<uint32_t>(((old >> 18u) ^ old) >> 27u);
    const auto rotation = static_cast<uint32_t>(old >> 59u);
    return (shifted >> rotation) | (shifted << ((32u - rotation) & 31u));
  }

  /// Uniform in [0, 1): 24 bits, so 1 is never returned.
  float next() { return static_cast<float>(next_uint() >> 8) * 0x1p-24f; }

 private:
  uint64_t state_ = 0;
  uint64_t increment_;
};

}  // namespace farfield
