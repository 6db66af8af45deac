// SPDX-License-Identifier: Apache-2.0
// write_test_asset FOLDER: a small asset for tests that run other programs.
#include <cstdio>

#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_test_asset FOLDER\n");
    return 1;
  }
  std::vector<farfield::LevelData> levels = farfield::test::white_sphere();
  for (farfield::LevelData& level : levels) farfield::test::set_diffuse(level, {0.7f, 0.5f, 0.2f});
  farfield::test::write_asset(argv[1], levels);
}
