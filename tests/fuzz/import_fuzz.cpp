// SPDX-License-Identifier: Apache-2.0
// The readers of foreign files on arbitrary bytes. FARFIELD_FUZZ_READER is the one under test:
//   build/fuzz/bin/ply_fuzz -max_total_time=60 -rss_limit_mb=2048 CORPUS tests/data/nasty
#include "import/read_formats.h"

#ifdef FARFIELD_FUZZ_GLTF
static auto read(std::span<const unsigned char> bytes) { return farfield::read_gltf(bytes, "fuzz.glb", -1, -1); }
#else
static auto read(std::span<const unsigned char> bytes) { return farfield::FARFIELD_FUZZ_READER(bytes, "fuzz"); }
#endif

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const auto mesh = read({data, size});
  if (!mesh) return 0;
  // What the import relies on without looking again.
  if (mesh->face_begin.size() != mesh->face_count() + 1 || mesh->face_begin.back() != mesh->corner_count())
    __builtin_trap();
  for (const uint32_t vertex : mesh->corner_position) {
    if (vertex >= mesh->positions.size()) __builtin_trap();
  }
  for (const uint32_t material : mesh->face_material) {
    if (material >= mesh->materials.size()) __builtin_trap();
  }
  if (!mesh->corner_uv.empty() && mesh->corner_uv.size() != mesh->corner_count()) __builtin_trap();
  if (!mesh->corner_color.empty() && mesh->corner_color.size() != mesh->corner_count()) __builtin_trap();
  return 0;
}
