// SPDX-License-Identifier: Apache-2.0
// Functions that take any bytes and must neither crash nor break a promise of the reader behind them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace farfield {

void fuzz_level_file(std::span<const uint8_t> data);
void fuzz_manifest(std::span<const uint8_t> data);

}  // namespace farfield

#ifdef FARFIELD_LIBFUZZER
extern "C" inline __attribute__((used)) int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  farfield::FARFIELD_LIBFUZZER({data, size});
  return 0;
}
#endif
