// SPDX-License-Identifier: Apache-2.0
// Writes the generated volumes of docs/results/volumes.md into a folder: make_volumes FOLDER [VOXELS [NAME]]
//
//   noise.vdb      a ball of noise with thin filaments: high frequencies with a mean (thesis 11.2)
//   smoke.vdb      a column that thins upwards, in tongues
//   hair.vdb       opaque strands, a voxel wide, in empty space
//   opaque.vdb     one opaque voxel in each block of 8^3: what no mean density can say
//   haze.vdb       smooth and thin: where every method is right
//   fur.vdb        a ball with a coat of hairs thinner than a voxel that lie in whorls: a grid "fibre" has directions
//   slices.vdb     the smoke in slices three times as far apart as voxels are wide, and slanted: it is resampled
//   cotton.vdb     a ball of tangled fibres with their directions, denser inside
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

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

using Density = std::function<double(const dvec3&, const ivec3&)>;

/// Of fibres: across the direction, none where it is (0, 0, 0).
struct Fibre {
  double density = 0;
  dvec3 direction{0.0};
};

/// Writes volumes with `side` voxels along an edge; of a name other than `only`, if that is one, none.
struct Writer {
  std::filesystem::path folder;
  int side;
  std::string only;

  bool is_wanted(const std::string& name) const { return only.empty() || name == only; }

  void save(const std::string& name, const std::vector<test::VdbGrid>& grids) const {
    const std::filesystem::path path = folder / (name + ".vdb");
    test::write_vdb(path, grids);
    fmt::print("{}: {} voxels\n", path.string(), grids[0].voxels.size());
  }

  /// voxel: voxel (i, j, k) is where this puts its cube, in units of 8 / side.
  void write(const std::string& name, const Density& density, const glm::dmat3& voxel = glm::dmat3(1.0)) const {
    if (!is_wanted(name)) return;
    test::VdbGrid grid;
    grid.index_to_source = glm::dmat4(voxel * (8.0 / side));
    const glm::dmat3 to_unit = voxel * (2.0 / side);
    const auto value = [&](const ivec3& v) { return density(to_unit * (dvec3(v - side / 2) + 0.5), v); };
    grid.voxels = test::filled_cube(ivec3(-side / 2), side, value);
    save(name, {grid});
  }

  /// The same with a grid "fibre".
  void write_fibres(const std::string& name, const std::function<Fibre(const dvec3&)>& fibre) const {
    if (!is_wanted(name)) return;
    test::VdbGrid density, directions;
    density.index_to_source = directions.index_to_source = glm::dmat4(glm::dmat3(8.0 / side));
    directions.name = "fibre";
    directions.kind = test::VdbGrid::Kind::Color;
    for (int z = 0; z < side; ++z)
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          const Fibre here = fibre((dvec3(x, y, z) + 0.5) / static_cast<double>(side) * 2.0 - 1.0);
          if (!(here.density > 0)) continue;
          density.voxels.push_back({ivec3(x, y, z) - side / 2, here.density, vec3(0.0f)});
          directions.voxels.push_back({density.voxels.back().at, 1, vec3(here.direction)});
        }
    save(name, {density, directions});
  }
};

/// The gradient of turbulence.
dvec3 slope(const dvec3& p, int octaves) {
  constexpr double kStep = 1e-3;
  dvec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    dvec3 step(0.0);
    step[axis] = kStep;
    result[axis] = (turbulence(p + step, octaves) - turbulence(p - step, octaves)) / (2 * kStep);
  }
  return result;
}

void write_fibre_volumes(const Writer& to) {
  to.write_fibres("fur", [](const dvec3& p) {
    const double radius = glm::length(p);
    if (radius < 0.5 || radius > 0.95) return Fibre{};
    const dvec3 outwards = p / radius, around = glm::cross(dvec3(0.2, 1, 0.1), outwards);
    const double height = (radius - 0.5) / 0.45;
    const double tuft = noise(24.0 * (outwards - 0.3 * height * around) + 40.0);
    return Fibre{30 * std::max(0.0, tuft - 0.3 - 0.3 * height), outwards + 1.5 * height * around};
  });
  // A fibre is where two noises have a certain value each; it runs along both.
  to.write_fibres("cotton", [](const dvec3& p) {
    const double radius = glm::length(p);
    if (radius > 0.95) return Fibre{};
    const dvec3 a = 6.0 * p + 11.0, b = 6.0 * p + 57.0;
    const double from_fibre = std::hypot(turbulence(a, 2) - 0.37, turbulence(b, 2) - 0.37);
    const double density = 25 * std::max(0.0, 1 - from_fibre / 0.12) * std::min(1.0, 4 * (0.95 - radius));
    return density > 0 ? Fibre{density, glm::cross(slope(a, 2), slope(b, 2))} : Fibre{};
  });
}

void write_all(const Writer& to) {
  const double voxel = 8.0 / to.side;
  to.write("noise", [](const dvec3& p, const ivec3&) {
    const double ridge = 1 - std::abs(2 * turbulence(8.0 * p + 7.0, 4) - 0.95);
    return glm::length(p) < 0.9 && ridge > 0.93 ? 20 * (ridge - 0.9) / 0.1 : 0;
  });
  const Density smoke = [](const dvec3& p, const ivec3&) {
    if (std::abs(p.y) > 1) return 0.0;
    const double height = 0.5 * (p.y + 1), width = 0.15 + 0.6 * height;
    const double edge = 1 - glm::length(dvec3(p.x, 0, p.z)) / width;
    return std::max(0.0, 6 * (1 - height) * (edge + 1.6 * (turbulence(5.0 * p + 3.0, 5) - 0.55)));
  };
  to.write("smoke", smoke);
  to.write("slices", smoke, {dvec3(1, 0, 0), dvec3(0.2, 3, 0), dvec3(0, 0, 1)});
  to.write("hair", [&](const dvec3& p, const ivec3& v) {
    const double bend = 0.15 * std::sin(3 * p.y);
    const ivec3 at(static_cast<int>(std::floor((p.x + bend + 2) / voxel * 2)), 0,
                   static_cast<int>(std::floor((p.z + 0.5 * bend + 2) / voxel * 2)));
    return at.x % 8 == 0 && at.z % 10 < 2 && v.y > 2 ? 100 : 0;
  });
  to.write("opaque", [](const dvec3&, const ivec3& v) { return v % 8 == ivec3(3, 5, 2) ? 1000 : 0; });
  to.write("haze", [](const dvec3& p, const ivec3&) {
    return std::max(0.0, 0.3 * (1 - glm::length(p)) * (0.5 + turbulence(2.0 * p + 9.0, 2)));
  });
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  const int side = argc > 2 ? std::atoi(argv[2]) : 96;
  if (argc < 2 || argc > 4 || side < 8 || side > 1024) {
    fmt::print(stderr, "usage: make_volumes FOLDER [VOXELS [NAME]], 8 to 1024 along an edge\n");
    return 2;
  }
  std::filesystem::create_directories(argv[1]);
  const farfield::Writer to{argv[1], side, argc > 3 ? argv[3] : ""};
  farfield::write_all(to);
  farfield::write_fibre_volumes(to);
}
