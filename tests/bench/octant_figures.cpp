// SPDX-License-Identifier: Apache-2.0
// Do shapes inside voxels pay, against finer voxels in the same bytes?
//
//   build/release/bin/octant_figures SOURCE GRID...
//
// All of the source becomes a volume at each grid; then, with the same pixels and computed transmittances
// (volume_comparison.h):
// * voxels as they are, matched as long as the others are;
// * 1 bit for each of a voxel's 8 octants: empty, or of the voxel's density;
// * 2 bits: one of four shares of the voxel's density;
// * 8 bits: a density of its own;
// * voxels of a finer lattice.
// Bytes: bricks, SGGX, one colour; and the bits.
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <map>
#include <set>
#include <tuple>

#include "bake/pack_level.h"
#include "prefilter/condition.h"
#include "prefilter/density.h"
#include "prefilter/fixed_sum.h"
#include "prefilter/line_scene.h"
#include "prefilter/measure_volume.h"
#include "prefilter/place_lattice.h"
#include "prefilter/resolve.h"
#include "tests/bench/volume_comparison.h"

namespace farfield {
namespace {

/// Shares of a voxel's density that 2 bits stand for: about even in what they stop.
constexpr std::array<float, 4> kShares = {0, 0.12f, 0.4f, 1};

/// A volume in parts: those of one group have one factor when densities are matched.
struct Parts {
  SparseVolume volume;
  std::vector<uint32_t> group;  ///< of each voxel of the volume
  size_t groups = 0;
};

Parts each_alone(SparseVolume volume) {
  Parts parts{std::move(volume), {}, 0};
  for (; parts.groups < parts.volume.voxels.size(); ++parts.groups)
    parts.group.push_back(static_cast<uint32_t>(parts.groups));
  return parts;
}

struct FileOrder {
  bool operator()(const ivec3& a, const ivec3& b) const { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); }
};

/// The octants of the lattice's voxels that triangles pass through, to an eighth of a voxel.
std::set<ivec3, FileOrder> touched_octants(const Surface& geometry, const VoxelLattice& lattice) {
  std::set<ivec3, FileOrder> octants;
  const VoxelSet eighths = mark_voxels(geometry, {lattice.origin, lattice.voxel_size / 8});
  for (size_t b = 0; b < eighths.masks.size(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (is_set(eighths.masks[b], i)) octants.insert(voxel_of_brick(eighths.coordinates[b], i) >> 2);
  return octants;
}

/// The touched octants of all voxels, which keep their voxel's optical depth; their groups are the voxels.
Parts split(const SparseVolume& volume, const Surface& geometry) {
  const auto touched = touched_octants(geometry, volume.lattice);
  struct Octant {
    uint32_t voxel;
    float share;
  };
  std::map<ivec3, std::map<int, Octant>, FileOrder> bricks;
  for (const VoxelBrick& brick : volume.bricks) {
    auto number = static_cast<uint32_t>(brick.first_voxel);
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!is_set(brick.mask, i)) continue;
      std::vector<ivec3> octants;
      for (int o = 0; o < 8; ++o) {
        const ivec3 octant = 2 * voxel_of_brick(brick.coordinate, i) + ivec3(o & 1, o >> 1 & 1, o >> 2);
        if (touched.contains(octant)) octants.push_back(octant);
      }
      for (const ivec3& at : octants) {
        const ivec3 in_brick = at & 7;
        bricks[at >> 3][in_brick.x + 8 * in_brick.y + 64 * in_brick.z] = {number,
                                                                          8.0f / static_cast<float>(octants.size())};
      }
      ++number;
    }
  }
  Parts parts{{{volume.lattice.origin, volume.lattice.voxel_size / 2}, {}, {}}, {}, volume.voxels.size()};
  for (const auto& [coordinate, octants] : bricks) {
    parts.volume.bricks.push_back({coordinate, {}, parts.volume.voxels.size()});
    for (const auto& [i, octant] : octants) {
      parts.volume.bricks.back().mask[static_cast<size_t>(i >> 6)] |= uint64_t{1} << (i & 63);
      parts.volume.voxels.push_back(volume.voxels[octant.voxel]);
      parts.volume.voxels.back().density *= octant.share;
      parts.group.push_back(octant.voxel);
    }
  }
  return parts;
}

void scale(double factor, const SparseVolume& volume, Voxel& voxel) {
  const double most = kMaxDensityLength / volume.lattice.voxel_size;
  voxel.density = static_cast<float>(std::min(static_cast<double>(voxel.density) * factor, most));
}

/// As visible_density.cpp matches, with the sums of all parts of a group in one, and no prior but a hit.
Result<void> match_groups(const LineScene& scene, Parts& parts, const LinePass& pass) {
  struct Sums {
    FixedSum source, medium;
  };
  std::vector<Sums> sums(parts.groups);
  FARFIELD_TRY(for_lines(scene, pass, [&](const SeenLine& line, SplitMix&) {
    const double passing = std::exp(-optical_depth(parts.volume, scene.grid(), line.ray));
    visit_depths(parts.volume, scene.grid(), line.ray, [&](uint32_t v, double depth) {
      Sums& of_group = sums[parts.group[v]];
      if (line.hit) of_group.source.add(depth * passing);
      of_group.medium.add(depth * passing * (1 - passing));
    });
  }));
  for (size_t v = 0; v < parts.group.size(); ++v) {
    const Sums& of_group = sums[parts.group[v]];
    const double ratio = (of_group.source.value() + 1) / (of_group.medium.value() + 1);
    scale(std::clamp(ratio, 1 / 1.5, 1.5), parts.volume, parts.volume.voxels[v]);
  }
  return {};
}

Result<void> match_whole(const LineScene& scene, SparseVolume& volume, const LinePass& pass) {
  FixedSum missing, slope;
  FARFIELD_TRY(for_lines(scene, pass, [&](const SeenLine& line, SplitMix&) {
    const double depth = optical_depth(volume, scene.grid(), line.ray);
    missing.add((line.hit ? 1 : 0) + std::expm1(-depth));
    slope.add(depth * std::exp(-depth));
  }));
  if (!(slope.value() > 0)) return {};
  for (Voxel& voxel : volume.voxels) scale(std::clamp(1 + missing.value() / slope.value(), 0.5, 2.0), volume, voxel);
  return {};
}

Result<void> match(const OpacityScene& source, Parts& parts) {
  constexpr uint64_t kPasses = 10;
  const double lines = std::max(2e5, 60.0 * static_cast<double>(parts.groups));
  FARFIELD_TRY_LET(const auto scene, LineScene::build(source, Surface{}, parts.volume));
  for (uint64_t p = 0; p < kPasses; ++p) FARFIELD_TRY(match_groups(scene, parts, {lines, 1000 + p, {}}));
  for (uint64_t p = 0; p < 2; ++p) FARFIELD_TRY(match_whole(scene, parts.volume, {lines, 2000 + p, {}}));
  return {};
}

/// Every density becomes one of kShares of the largest in its voxel.
void round_to_shares(SparseVolume& octants, const std::vector<uint32_t>& voxel_of, size_t voxels) {
  std::vector<float> most(voxels, 0);
  for (size_t i = 0; i < voxel_of.size(); ++i) {
    float& of_voxel = most[voxel_of[i]];
    of_voxel = std::max(of_voxel, octants.voxels[i].density);
  }
  for (size_t i = 0; i < voxel_of.size(); ++i) {
    float& density = octants.voxels[i].density;
    const float share = density / most[voxel_of[i]];
    density = most[voxel_of[i]] * *std::min_element(kShares.begin(), kShares.end(), [&](float a, float b) {
                return std::abs(a - share) < std::abs(b - share);
              });
  }
}

/// Without surface and without bits.
uint64_t bytes_of(const SparseVolume& volume) {
  const LevelData packed = pack_volume(volume);
  const LevelView view = view_of(packed);
  return view.bricks.size_bytes() + view.voxel_sggx.size_bytes() + volume.voxels.size() * sizeof(PackedColor);
}

struct Judge {
  const OpacityScene& source;
  Box3 bounds;
  float pixel_size;

  void operator()(const std::string& name, const SparseVolume& volume, uint64_t bytes) const {
    const VoxelGrid grid(volume);
    const Comparison comparison{source, nullptr, grid, volume};
    fmt::print("  {:14} {:8.1f} KiB", name, static_cast<double>(bytes) / 1024);
    compare_lines(comparison, bounds, 1'000'000);
    compare_any_views(comparison, bounds, pixel_size);
    fmt::print("\n");
    std::fflush(stdout);
  }
};

Result<void> judge_octants(const Surface& geometry, const OpacityScene& source, const SparseVolume& volume,
                           const Judge& judge) {
  const uint64_t bytes = bytes_of(volume), voxels = volume.voxels.size();
  const Parts octants = split(volume, geometry);
  Parts together = octants, alone = each_alone(octants.volume);
  FARFIELD_TRY(match(source, together));
  judge("1 bit", together.volume, bytes + voxels);
  FARFIELD_TRY(match(source, alone));
  judge("8 bits", alone.volume, bytes + 8 * voxels);
  Parts rounded{alone.volume, octants.group, octants.groups};
  round_to_shares(rounded.volume, rounded.group, rounded.groups);
  FARFIELD_TRY(match(source, rounded));
  judge("2 bits", rounded.volume, bytes + 2 * voxels);
  return {};
}

Result<void> run(const char* file, int grid) {
  FARFIELD_TRY_LET(const auto asset, import_asset(file));
  const Box3 bounds = asset.source.bounds();
  const double resolution = static_cast<double>(max_component(bounds.size())) / grid;
  FARFIELD_TRY_LET(const auto resolved, resolve(asset.source, static_cast<float>(resolution)));
  FARFIELD_TRY_LET(const auto source, OpacityScene::build(resolved.surface));
  const auto border = static_cast<float>(1.5 * resolution);
  const Judge judge{source, {bounds.lower - border, bounds.upper + border}, static_cast<float>(resolution)};
  const auto measure = [&](double voxel_size) {
    const VoxelLattice lattice = place_lattice(resolved.surface, dvec3(bounds.center()), voxel_size);
    return measure_volume(resolved.surface, {}, lattice, {.rays_per_voxel = 200, .seed = 1, .job = {}});
  };
  fmt::print("{} {}^3\n", file, grid);
  for (const double factor : {1.0, 0.9, 0.8, 0.707}) {
    FARFIELD_TRY_LET(const auto volume, measure(factor * resolution));
    Parts voxels = each_alone(volume);
    FARFIELD_TRY(match(source, voxels));
    judge(factor == 1 ? "voxels" : fmt::format("finer by {}", factor), voxels.volume, bytes_of(volume));
    if (factor == 1) FARFIELD_TRY(judge_octants(resolved.surface, source, volume, judge));
  }
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc < 3) return fmt::print("usage: octant_figures SOURCE GRID...\n"), 2;
  for (int i = 2; i < argc; ++i) {
    if (const auto done = farfield::run(argv[1], std::atoi(argv[i])); !done) {
      fmt::print(stderr, "{}\n", done.error().message);
      return 1;
    }
  }
}
