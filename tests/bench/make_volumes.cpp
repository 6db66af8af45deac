// SPDX-License-Identifier: Apache-2.0
// Writes the generated volumes of docs/results/volumes.md into a folder: make_volumes FOLDER [VOXELS]
//
//   noise.vdb      a ball of noise with thin filaments: high frequencies with a mean (thesis 11.2)
//   smoke.vdb      a column that thins upwards, in tongues
//   hair.vdb       opaque strands, a voxel wide, in empty space
//   opaque.vdb     one opaque voxel in each block of 8^3: what no mean density can say
//   haze.vdb       smooth and thin: where every method is right
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "tests/support/vdb_files.h"

namespace farfield {
namespace {

/// Value noise with a smooth step between whole points, in [0, 1].
double noise(const dvec3& p) {
  const dvec3 cell = glm::floor(p), f = p - cell, s = f * f * (3.0 - 2.0 * f);
  const auto at = [&](int x, int y, int z) {
    const glm::i64vec3 c = glm::i64vec3(cell) + glm::i64vec3(x, y, z);
    uint64_t h = static_cast<uint64_t>(c.x) * 0x9e3779b97f4a7c15ull ^
                 static_cast<uint64_t>(c.y) * 0xbf58476d1ce4e5b9ull ^
                 static_cast<uint64_t>(c.z) * 0x94d049bb133111ebull;
    h ^= h >> 31, h *= 0xd6e8feb86659fd93ull, h ^= h >> 32;
    return static_cast<double>(h >> 11) * 0x1p-53;
  };
  const auto along_x = [&](int y, int z) { return glm::mix(at(0, y, z), at(1, y, z), s.x); };
  return glm::mix(glm::mix(along_x(0, 0), along_x(1, 0), s.y), glm::mix(along_x(0, 1), along_x(1, 1), s.y), s.z);
}

double turbulence(dvec3 p, int octaves) {
  double sum = 0, weight = 0.5;
  for (int i = 0; i < octaves; ++i, p *= 2.03, weight *= 0.5) sum += weight * noise(p);
  return sum;
}

void write(const std::filesystem::path& folder, const char* name, int side,
           const std::function<double(const dvec3&, const ivec3&)>& density) {
  test::VdbGrid grid;
  grid.index_to_source = glm::dmat4(glm::dmat3(8.0 / side));
  const auto value = [&](const ivec3& v) {
    return density((dvec3(v) + 0.5) / static_cast<double>(side) * 2.0 - 1.0, v);
  };
  grid.voxels = test::filled_cube(ivec3(-side / 2), side, value);
  const std::filesystem::path path = folder / (std::string(name) + ".vdb");
  test::write_vdb(path, {grid});
  fmt::print("{}: {} voxels\n", path.string(), grid.voxels.size());
}

void write_all(const std::filesystem::path& folder, int side) {
  const double voxel = 8.0 / side;
  write(folder, "noise", side, [](const dvec3& p, const ivec3&) {
    const double ridge = 1 - std::abs(2 * turbulence(8.0 * p + 7.0, 4) - 0.95);
    return glm::length(p) < 0.9 && ridge > 0.93 ? 20 * (ridge - 0.9) / 0.1 : 0;
  });
  write(folder, "smoke", side, [](const dvec3& p, const ivec3&) {
    const double height = 0.5 * (p.y + 1), width = 0.15 + 0.6 * height;
    const double edge = 1 - glm::length(dvec3(p.x, 0, p.z)) / width;
    return std::max(0.0, 6 * (1 - height) * (edge + 1.6 * (turbulence(5.0 * p + 3.0, 5) - 0.55)));
  });
  write(folder, "hair", side, [&](const dvec3& p, const ivec3& v) {
    const double bend = 0.15 * std::sin(3 * p.y);
    const ivec3 at(static_cast<int>(std::floor((p.x + bend + 2) / voxel * 2)), 0,
                   static_cast<int>(std::floor((p.z + 0.5 * bend + 2) / voxel * 2)));
    return at.x % 8 == 0 && at.z % 10 < 2 && v.y > 2 ? 100 : 0;
  });
  write(folder, "opaque", side, [](const dvec3&, const ivec3& v) { return v % 8 == ivec3(3, 5, 2) ? 1000 : 0; });
  write(folder, "haze", side, [](const dvec3& p, const ivec3&) {
    return std::max(0.0, 0.3 * (1 - glm::length(p)) * (0.5 + turbulence(2.0 * p + 9.0, 2)));
  });
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  const int side = argc > 2 ? std::atoi(argv[2]) : 96;
  if (argc < 2 || argc > 3 || side < 8 || side > 1024) {
    fmt::print(stderr, "usage: make_volumes FOLDER [VOXELS], 8 to 1024 along an edge\n");
    return 2;
  }
  std::filesystem::create_directories(argv[1]);
  farfield::write_all(argv[1], side);
}
