// SPDX-License-Identifier: Apache-2.0
// Two rules for a medium between two levels, measured in pictures: superposing both media in part (what morphs do), and
// interpolating them into one on the finer lattice. Figures of docs/decisions/0028.
//
//   build/release/bin/medium_blends ASSET.farfield FINE_LEVEL WORK_FOLDER
//
// Volumes alone, without octants: surfaces are left out. As blend_figures has it: one view at one pixel per r of the
// coarser level, sun and sky; coverage and brightness at t = 1/4, 1/2, 3/4 against the straight line between the
// levels, noise and CPU time at t = 1/2 against the finer level alone. "resampled": the interpolated medium at t = 1,
// which is the coarser level on the finer lattice.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "bake/level_writer.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "scattering/carlson.h"
#include "scattering/sggx.h"
#include "tests/bench/blend_pictures.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

constexpr int kRepeats = 5;
constexpr std::array<float, 4> kBlends = {0.25f, 0.5f, 0.75f, 1.0f};

void set_bounds(LevelData& volume) {
  volume.header.bounds = {};
  for_each_brick(volume, [&](const Brick& brick, const ivec3& place) {
    const Box3 active = active_box(brick);
    for (const vec3& corner : {active.lower, active.upper}) {
      volume.header.bounds.extend(volume.header.volume_origin +
                                  volume.header.resolution * (vec3(kBrickSide * place) + corner));
    }
  });
}

/// A level without its surface, its morph maps and the shapes inside its voxels.
LevelData volume_of(const LevelView& level) {
  LevelData volume;
  volume.header = level.header;
  const auto copy = [](auto& to, const auto& from) { to.assign(from.begin(), from.end()); };
  copy(volume.brick_table, level.brick_table), copy(volume.bricks, level.bricks);
  copy(volume.voxel_sggx, level.voxel_sggx), copy(volume.voxel_diffuse, level.voxel_diffuse);
  copy(volume.voxel_specular, level.voxel_specular), copy(volume.voxel_roughness2, level.voxel_roughness2);
  copy(volume.voxel_transmission, level.voxel_transmission);
  copy(volume.voxel_self_shadowing, level.voxel_self_shadowing);
  copy(volume.voxel_albedo, level.voxel_albedo), copy(volume.voxel_anisotropy, level.voxel_anisotropy);
  set_bounds(volume);
  return volume;
}

/// What a level has at a point.
struct Voxel {
  float density = 0;
  uint32_t payload = 0;
};
Voxel voxel_at(const LevelData& level, const vec3& point) {
  const ivec3 voxel(glm::floor((point - level.header.volume_origin) / level.header.resolution));
  const ivec3 brick = voxel >> 3, dims = level.header.brick_dims;
  if (glm::any(glm::lessThan(voxel, ivec3(0))) || glm::any(glm::greaterThanEqual(brick, dims))) return {};
  const uint32_t number = level.brick_table[brick_table_index(dims, brick)];
  if (number == kNoBrick) return {};
  const Brick& found = level.bricks[number];
  const ivec3 inside = voxel & 7;
  const int i = inside.x + kBrickSide * (inside.y + kBrickSide * inside.z);
  const uint8_t density = found.density[static_cast<size_t>(i)];
  if (density == 0) return {};
  return {static_cast<float>(density) / 255.0f * found.density_scale, found.payload_index(i)};
}

/// Two levels' voxels at one place, and how much of their flakes' area is the coarser's.
struct Mixture {
  Voxel fine, coarse;
  SymMat3 sggx = SymMat3::identity();
  float density = 0;
  float coarse_share = 0;
};

SymMat3 sggx_of(const LevelData& level, const Voxel& voxel) {
  return level.voxel_sggx.empty() ? SymMat3::identity() : unpack(level.voxel_sggx[voxel.payload]);
}
float mean_area(const SymMat3& s) {
  const dvec3 values = eigenvalues(s);
  return static_cast<float>(carlson_rg(values.x, values.y, values.z));
}

/// S weighted by density, which is such that the mean projected area interpolates.
Mixture mix_at(const LevelData& fine, const LevelData& coarse, const vec3& point, float t) {
  Mixture mixture{voxel_at(fine, point), voxel_at(coarse, point)};
  const float a = (1 - t) * mixture.fine.density, b = t * mixture.coarse.density;
  if (a + b <= 0) return mixture;
  const SymMat3 of_fine = a > 0 ? sggx_of(fine, mixture.fine) : SymMat3::identity();
  const SymMat3 of_coarse = b > 0 ? sggx_of(coarse, mixture.coarse) : SymMat3::identity();
  const NormalisedSggx mean = normalise_sggx((of_fine * a + of_coarse * b) * (1 / (a + b)));
  const float area_a = a * mean_area(of_fine), area_b = b * mean_area(of_coarse);
  mixture.sggx = mean.sggx;
  mixture.density = (area_a + area_b) / mean_area(mean.sggx);
  mixture.coarse_share = area_b / (area_a + area_b);
  return mixture;
}

/// One channel of the mixed voxels; `missing` stands for a channel that a level has not.
template <typename T, typename Unpack, typename Pack>
void mix_channel(const std::vector<Mixture>& voxels, const std::vector<T>& fine, const std::vector<T>& coarse,
                 T missing, std::vector<T>& out, const Unpack& unpack_one, const Pack& pack_one) {
  if (fine.empty() && coarse.empty()) return;
  const auto value = [&](const std::vector<T>& channel, const Voxel& voxel) {
    return unpack_one(channel.empty() || voxel.density <= 0 ? missing : channel[voxel.payload]);
  };
  for (const Mixture& voxel : voxels) {
    const float share = voxel.coarse_share;
    out.push_back(pack_one(value(fine, voxel.fine) * (1 - share) + value(coarse, voxel.coarse) * share));
  }
}

LevelData interpolate(const LevelData& fine, const LevelData& coarse, float t) {
  const float r = fine.header.resolution, brick = r * kBrickSide;
  LevelData out;
  out.header = fine.header;
  for (float LevelHeader::*value : {&LevelHeader::hot_spot, &LevelHeader::highlight_lean, &LevelHeader::fog_anisotropy})
    out.header.*value = (1 - t) * fine.header.*value + t * coarse.header.*value;
  out.header.fog_albedo = (1 - t) * fine.header.fog_albedo + t * coarse.header.fog_albedo;
  out.header.open_side = (1 - t) * fine.header.open_side + t * coarse.header.open_side;
  // The finer lattice, continued over the coarser volume.
  const vec3 end_fine = fine.header.volume_origin + brick * vec3(fine.header.brick_dims);
  const vec3 end_coarse = coarse.header.volume_origin + 2 * brick * vec3(coarse.header.brick_dims);
  const ivec3 before(glm::ceil(glm::max((fine.header.volume_origin - coarse.header.volume_origin) / brick, vec3(0))));
  const ivec3 behind(glm::ceil(glm::max((end_coarse - end_fine) / brick, vec3(0))));
  const vec3 origin = fine.header.volume_origin - brick * vec3(before);
  const auto mixture = [&](int x, int y, int z) {
    return mix_at(fine, coarse, origin + r * (vec3(x, y, z) + 0.5f), t);
  };
  std::vector<Mixture> voxels;
  test::set_volume(
      out, fine.header.brick_dims + before + behind, origin,
      [&](int x, int y, int z) { return mixture(x, y, z).density; },
      [&](int x, int y, int z) {  // called for the voxels that are not empty, in their order
        voxels.push_back(mixture(x, y, z));
        return voxels.back().sggx;
      });
  const PackedColor black = pack_color(vec3(0));
  mix_channel(voxels, fine.voxel_diffuse, coarse.voxel_diffuse, black, out.voxel_diffuse, unpack_color, pack_color);
  mix_channel(voxels, fine.voxel_specular, coarse.voxel_specular, black, out.voxel_specular, unpack_color, pack_color);
  mix_channel(voxels, fine.voxel_transmission, coarse.voxel_transmission, black, out.voxel_transmission, unpack_color,
              pack_color);
  mix_channel(voxels, fine.voxel_roughness2, coarse.voxel_roughness2, uint8_t{0}, out.voxel_roughness2, unpack_unorm8,
              pack_unorm8);
  mix_channel(voxels, fine.voxel_self_shadowing, coarse.voxel_self_shadowing, uint8_t{255}, out.voxel_self_shadowing,
              unpack_unorm8, pack_unorm8);
  mix_channel(voxels, fine.voxel_albedo, coarse.voxel_albedo, pack_albedo(out.header.fog_albedo), out.voxel_albedo,
              unpack_albedo, pack_albedo);
  mix_channel(voxels, fine.voxel_anisotropy, coarse.voxel_anisotropy, pack_anisotropy(out.header.fog_anisotropy),
              out.voxel_anisotropy, unpack_anisotropy, pack_anisotropy);
  if (out.header.medium == Medium::Fog && fine.voxel_sggx.empty() && coarse.voxel_sggx.empty()) out.voxel_sggx.clear();
  set_bounds(out);
  return out;
}

Result<std::filesystem::path> write(const std::filesystem::path& folder, const Manifest& source,
                                    const std::vector<const LevelData*>& levels) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  Manifest manifest = source;
  manifest.levels.clear(), manifest.textures.clear(), manifest.bounds = {};
  LevelWriter writer(folder, {}, manifest);
  for (const LevelData* level : levels) FARFIELD_TRY(writer.write(view_of(*level), 1, ~uint64_t{0}));
  FARFIELD_TRY(writer.finish());
  return folder;
}

struct Sums {
  double coverage = 0, brightness = 0, deviation = 0;
};

Result<void> run(const std::filesystem::path& asset, uint32_t number, const std::filesystem::path& work) {
  FARFIELD_TRY_LET(const Manifest manifest, read_manifest(asset));
  std::vector<LevelData> levels;
  for (const LevelEntry& entry : manifest.levels) {
    if (entry.level != number && entry.level != number + 1) continue;
    FARFIELD_TRY_LET(const auto file, LevelFile::open(asset / entry.file, LevelCheck::Full));
    levels.push_back(volume_of(file->view()));
  }
  if (levels.size() != 2 || !levels[0].has_volume() || !levels[1].has_volume())
    return tl::unexpected(Error{ErrorCode::InvalidArgument, "that level and the next are not two stored volumes"});

  const auto k = static_cast<float>(number);
  const auto pixel = static_cast<double>(levels[1].header.resolution);
  Box3 shown = levels[0].header.bounds;
  shown.extend(levels[1].header.bounds);
  FARFIELD_TRY_LET(const auto pair, write(work / "pair", manifest, {&levels[0], &levels[1]}));
  std::vector<Renderer> renderers;
  renderers.emplace_back(pair, k, Blend::Dissolve, pixel, shown);
  renderers.emplace_back(pair, k + 1, Blend::Dissolve, pixel, shown);
  for (size_t i = 0; i < 3; ++i) renderers.emplace_back(pair, k + kBlends[i], Blend::Morph, pixel, shown);
  for (const float t : kBlends) {
    const LevelData mixed = interpolate(levels[0], levels[1], t);
    FARFIELD_TRY_LET(const auto folder, write(work / fmt::format("mixed_{}", t), manifest, {&mixed}));
    renderers.emplace_back(folder, k, Blend::Dissolve, pixel, shown);
  }
  std::vector<Sums> sums(renderers.size());
  for (int repeat = 0; repeat <= kRepeats; ++repeat) {
    for (size_t i = 0; i < renderers.size(); ++i) {
      FARFIELD_TRY_LET(const Picture picture, renderers[i].render());
      sums[i].coverage += picture.coverage;
      sums[i].brightness += picture.brightness;
      sums[i].deviation += picture.deviation;
    }
  }
  const auto print = [&](const char* rule, size_t first, size_t count) {
    std::string coverage, brightness;
    for (size_t i = 0; i < count; ++i) {
      const double t = count == 1 ? 1 : kBlends[i];
      const auto off = [&](double Sums::*value) {
        return 100 * (sums[first + i].*value / ((1 - t) * sums[0].*value + t * sums[1].*value) - 1);
      };
      coverage += fmt::format("{}{:+.1f}", i ? " / " : "", off(&Sums::coverage));
      brightness += fmt::format("{}{:+.1f}", i ? " / " : "", off(&Sums::brightness));
    }
    const size_t middle = first + count / 2;
    fmt::print("| {} to {} | {} | {} | {} | {:.2f} | {:.2f} |\n", number, number + 1, rule, coverage, brightness,
               sums[middle].deviation / sums[0].deviation,
               renderers[middle].median_seconds() / renderers[0].median_seconds());
  };
  print("superpose", 2, 3);
  print("interpolate", 5, 3);
  print("resampled", 8, 1);
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  unsigned level = 0;
  const std::string text = argc == 4 ? argv[2] : "";
  if (text.empty() || std::from_chars(text.data(), text.data() + text.size(), level).ec != std::errc()) {
    fmt::print(stderr, "usage: medium_blends ASSET.farfield FINE_LEVEL WORK_FOLDER\n");
    return 2;
  }
  if (auto done = farfield::run(argv[1], level, argv[3]); !done) {
    fmt::print(stderr, "medium_blends: {}\n", done.error().message);
    return 1;
  }
  return 0;
}
