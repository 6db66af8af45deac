// SPDX-License-Identifier: Apache-2.0
#include "import/resample_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"

namespace farfield {
namespace {

constexpr int kPoints = 4;        ///< along each edge of a cube
constexpr double kSliver = 1e-6;  ///< of a cube, that the last one along an axis need not cover
constexpr size_t kBatch = 1024;   ///< bricks in memory before they join the volume
constexpr uint32_t kManyBricks = kEmptyBrick - 1;

/// A brick of cubes before its place is known.
struct NewBrick {
  DensityBrick densities{};
  AlbedoBrick albedos{};
  ShapeBrick shapes{};
  NumberBrick anisotropies{}, self_shadowing{};
  struct Flakes {
    ColorBrick diffuse{}, specular{}, transmission{}, emission{};
    NumberBrick roughness{};
  };
  std::unique_ptr<Flakes> flakes;  ///< of fog none
};

class Resampler {
 public:
  Resampler(const SourceVolume& source, const VoxelShape& shape, const Job& job)
      : source_(source), edges_(shape.edges), to_index_(glm::inverse(shape.edges)), job_(job) {
    out_.voxel_size = shape.size;
    out_.rotation = shape.rotation;
    out_.albedo = source.albedo;
    out_.anisotropy = source.anisotropy;
    out_.warnings = source.warnings;
    out_.source_hash = source.source_hash;
    if (source.flakes) {
      const SourceFlakes& of_source = *source.flakes;
      SourceFlakes& flakes = out_.flakes.emplace();
      flakes.hot_spot = of_source.hot_spot;
      flakes.highlight_lean = of_source.highlight_lean;
      flakes.open_side = of_source.open_side;
    }
  }

  Result<SourceVolume> run() {
    FARFIELD_TRY(place());
    for (size_t i = 0; i < source_.bricks.size(); ++i) is_even_.push_back(is_even(source_.bricks[i]));
    FARFIELD_TRY(fill());
    keep_sum();
    return std::move(out_);
  }

 private:
  /// Where the cubes are, and whether a level can hold them.
  Result<void> place() {
    dvec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
    for (int i = 0; i < 8; ++i) {  // of the voxels' box; with shears there may be empty cubes at the border
      const dvec3 corner = edges_ * dvec3(source_.dims * ivec3(i & 1, i >> 1 & 1, i >> 2));
      lower = glm::min(lower, corner);
      upper = glm::max(upper, corner);
    }
    const double size = out_.voxel_size, cubes_per_voxel = glm::determinant(edges_) / (size * size * size);
    if (cubes_per_voxel * static_cast<double>(source_.active_voxels) > static_cast<double>(kMostVolumeVoxels)) {
      return make_error(
          ErrorCode::Unsupported,
          fmt::format("as cubes of {:.6g} it has more than {} million voxels; resample it to coarser ones", size,
                      kMostVolumeVoxels / 1000000));
    }
    lower_ = lower;
    out_.origin = source_.origin + source_.rotation * lower;
    const dvec3 dims = glm::max(glm::ceil((upper - lower) / size - kSliver), dvec3(1.0));
    const dvec3 bricks = glm::ceil(dims / double{kVolumeBrickSide});
    if (!(bricks.x * bricks.y * bricks.z <= static_cast<double>(kMostTableBricks))) {
      return make_error(
          ErrorCode::Unsupported,
          fmt::format("as cubes of {:.6g} it extends over {} x {} x {} voxels, {} million blocks of 8^3 are "
                      "possible; resample it to coarser ones",
                      size, dims.x, dims.y, dims.z, kMostTableBricks >> 20));
    }
    out_.dims = ivec3(dims);
    out_.brick_dims = ivec3(bricks);
    out_.brick_table.assign(out_.table_index(out_.brick_dims - 1) + 1, kEmptyBrick);
    return {};
  }

  static bool is_even(const DensityBrick& brick) {
    return brick[0] > 0 && std::ranges::all_of(brick, [&](float density) { return density == brick[0]; });
  }

  /// In front of the source it is -1, behind it `dims`: with shears a point may be further than integers go.
  static ivec3 floor_to(const dvec3& point, const ivec3& dims) {
    return ivec3(glm::clamp(glm::floor(point), dvec3(-1.0), dvec3(dims)));
  }

  /// A point of the new grid, in its voxels, in voxels of the source.
  dvec3 source_point(const dvec3& point) const { return to_index_ * (lower_ + out_.voxel_size * point); }

  /// The brick of the source that all of a new brick lies in or that is the same all around it; kManyBricks if there is
  /// none.
  uint32_t only_brick(const ivec3& brick) const {
    dvec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
    for (int i = 0; i < 8; ++i) {
      const dvec3 corner = source_point(dvec3((brick + ivec3(i & 1, i >> 1 & 1, i >> 2)) * kVolumeBrickSide));
      lower = glm::min(lower, corner);
      upper = glm::max(upper, corner);
    }
    const ivec3 first = floor_to(lower / double{kVolumeBrickSide}, source_.brick_dims);
    const ivec3 last = floor_to(upper / double{kVolumeBrickSide}, source_.brick_dims);
    std::optional<uint32_t> only;
    ivec3 at;
    for (at.z = first.z; at.z <= last.z; ++at.z)
      for (at.y = first.y; at.y <= last.y; ++at.y)
        for (at.x = first.x; at.x <= last.x; ++at.x) {
          const uint32_t here = source_.brick_at(at);
          if (only && *only != here) return kManyBricks;
          only = here;
        }
    return only.value_or(kEmptyBrick);
  }

  Result<void> fill() {
    const size_t entries = out_.brick_table.size();
    std::vector<std::optional<NewBrick>> batch(std::min(kBatch, entries));
    std::vector<uint32_t> only(batch.size());
    for (size_t first = 0; first < entries; first += kBatch) {
      if (job_.is_cancelled()) return make_error(ErrorCode::Cancelled, "read volume: cancelled");
      if (is_much_in_memory()) rest(source_), rest(out_);
      const size_t count = std::min(kBatch, entries - first);
      parallel_for(count, 4, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          const ivec3 brick = out_.brick_of_entry(first + i);
          only[i] = only_brick(brick);
          const bool is_known = only[i] == kEmptyBrick || is_shared(only[i]);
          batch[i] = is_known ? std::nullopt : new_brick(brick);
        }
      });
      for (size_t i = 0; i < count; ++i) {
        if (batch[i])
          out_.brick_table[first + i] = add(std::move(*batch[i]));
        else if (only[i] != kEmptyBrick && is_shared(only[i]))
          out_.brick_table[first + i] = shared_brick(only[i]);
      }
    }
    return {};
  }

  /// What else is in even bricks may differ.
  bool is_shared(uint32_t brick) const {
    const bool is_density_alone = !source_.flakes && source_.albedos.empty() && source_.shapes.empty() &&
                                  source_.anisotropies.empty() && source_.self_shadowing.empty();
    return brick < kManyBricks && is_even_[brick] && is_density_alone;
  }

  uint32_t add(NewBrick&& brick) {
    out_.bricks.push_back(brick.densities);
    if (!source_.albedos.empty()) out_.albedos.push_back(brick.albedos);
    if (!source_.shapes.empty()) out_.shapes.push_back(brick.shapes);
    if (!source_.anisotropies.empty()) out_.anisotropies.push_back(brick.anisotropies);
    if (!source_.self_shadowing.empty()) out_.self_shadowing.push_back(brick.self_shadowing);
    if (brick.flakes) add(*brick.flakes);
    return static_cast<uint32_t>(out_.bricks.size() - 1);
  }

  void add(const NewBrick::Flakes& brick) {
    const SourceFlakes& from = *source_.flakes;
    SourceFlakes& to = *out_.flakes;
    if (!from.diffuse.empty()) to.diffuse.push_back(brick.diffuse);
    if (!from.specular.empty()) to.specular.push_back(brick.specular);
    if (!from.transmission.empty()) to.transmission.push_back(brick.transmission);
    if (!from.emission.empty()) to.emission.push_back(brick.emission);
    if (!from.roughness.empty()) to.roughness.push_back(brick.roughness);
  }

  uint32_t shared_brick(uint32_t of_source) {
    const auto [shared, is_new] = shared_.try_emplace(source_.bricks[of_source][0], 0);
    if (is_new) {
      NewBrick even;
      even.densities.fill(source_.bricks[of_source][0]);
      shared->second = add(std::move(even));
    }
    return shared->second;
  }

  std::optional<NewBrick> new_brick(const ivec3& brick) const {
    NewBrick made;
    if (source_.flakes) made.flakes = std::make_unique<NewBrick::Flakes>();
    bool is_empty = true;
    for (int i = 0; i < kVolumeBrickVoxels; ++i) {
      const ivec3 voxel = brick * kVolumeBrickSide + voxel_in_brick(i);
      if (glm::any(glm::greaterThanEqual(voxel, out_.dims))) continue;
      is_empty = !sample(voxel, static_cast<size_t>(i), made) && is_empty;
    }
    return is_empty ? std::nullopt : std::optional(std::move(made));
  }

  /// A point of a cube that has a density.
  struct Hit {
    uint32_t brick;
    size_t voxel;  ///< in it
    double share;  ///< of the cube's density
  };

  /// Whether there is anything in the cube.
  bool sample(const ivec3& voxel, size_t i, NewBrick& made) const {
    constexpr int kAll = kPoints * kPoints * kPoints;
    std::array<Hit, kAll> hits;
    size_t count = 0;
    double sum = 0;
    for (int point = 0; point < kAll; ++point) {
      const dvec3 offset(point % kPoints, point / kPoints % kPoints, point / (kPoints * kPoints));
      const ivec3 at = floor_to(source_point(dvec3(voxel) + (offset + 0.5) / double{kPoints}), source_.dims);
      if (glm::any(glm::lessThan(at, ivec3(0)))) continue;
      const uint32_t brick = source_.brick_at(at / kVolumeBrickSide);
      if (brick == kEmptyBrick) continue;
      const auto density = static_cast<double>(source_.bricks[brick][index_in_brick(at)]);
      if (!(density > 0)) continue;
      hits[count++] = {brick, index_in_brick(at), density};
      sum += density;
    }
    if (count == 0) return false;
    for (Hit& hit : std::span(hits.data(), count)) hit.share /= sum;
    made.densities[i] = static_cast<float>(sum / kAll);
    mix(std::span(hits.data(), count), i, made);
    return true;
  }

  void mix(std::span<const Hit> hits, size_t i, NewBrick& made) const {
    const auto mean = [&](const auto& value) {
      double sum = 0;
      for (const Hit& hit : hits) sum += hit.share * static_cast<double>(value(hit));
      return sum;
    };
    for (size_t c = 0; c < 3 && !source_.albedos.empty(); ++c) {
      made.albedos[i][c] =
          static_cast<uint16_t>(std::lround(mean([&](const Hit& h) { return source_.albedos[h.brick][h.voxel][c]; })));
    }
    for (size_t e = 0; e < 6 && !source_.shapes.empty(); ++e) {
      made.shapes[i][e] = static_cast<float>(mean([&](const Hit& h) { return source_.shapes[h.brick][h.voxel][e]; }));
    }
    if (!source_.anisotropies.empty()) {
      made.anisotropies[i] =
          static_cast<float>(mean([&](const Hit& h) { return source_.anisotropies[h.brick][h.voxel]; }));
    }
    if (!source_.self_shadowing.empty()) {
      made.self_shadowing[i] =
          static_cast<float>(mean([&](const Hit& h) { return source_.self_shadowing[h.brick][h.voxel]; }));
    }
    if (made.flakes) mix_flakes(hits, i, *made.flakes);
  }

  void mix_flakes(std::span<const Hit> hits, size_t i, NewBrick::Flakes& made) const {
    const auto mean = [&](const auto& bricks, auto& brick) {
      if (bricks.empty()) return;
      for (const Hit& hit : hits) brick[i] += static_cast<float>(hit.share) * bricks[hit.brick][hit.voxel];
    };
    const SourceFlakes& flakes = *source_.flakes;
    mean(flakes.diffuse, made.diffuse);
    mean(flakes.specular, made.specular);
    mean(flakes.transmission, made.transmission);
    mean(flakes.emission, made.emission);
    mean(flakes.roughness, made.roughness);
  }

  /// The sum of all densities, and in `active` how many there are.
  static double sum_of(const SourceVolume& volume, uint64_t& active, uint64_t& bricks) {
    std::vector<double> sums(volume.bricks.size(), 0);
    std::vector<uint32_t> counts(volume.bricks.size(), 0);
    for (size_t i = 0; i < volume.bricks.size(); ++i)
      for (const float density : volume.bricks[i]) sums[i] += static_cast<double>(density), counts[i] += density > 0;
    double sum = 0;
    for (const uint32_t brick : volume.brick_table) {
      if (brick == kEmptyBrick) continue;
      sum += sums[brick];
      active += counts[brick];
      ++bricks;
    }
    return sum;
  }

  void keep_sum() {
    uint64_t ignored = 0;
    const double size = out_.voxel_size, of_source = sum_of(source_, ignored, ignored) * glm::determinant(edges_);
    const double of_cubes = sum_of(out_, out_.active_voxels, out_.filled_bricks) * size * size * size;
    const double factor = of_source / of_cubes;
    for (DensityBrick& brick : out_.bricks)
      for (float& density : brick) {
        density = static_cast<float>(static_cast<double>(density) * factor);
        out_.densest = std::max(out_.densest, density);
      }
  }

  const SourceVolume& source_;
  const glm::dmat3 edges_, to_index_;
  const Job& job_;
  dvec3 lower_{0.0};           ///< of the new grid, in the frame of the rotation, from the source's origin
  std::vector<bool> is_even_;  ///< of the source's bricks: one density in all voxels
  std::map<float, uint32_t> shared_;
  SourceVolume out_;
};

}  // namespace

Result<SourceVolume> resample_to_cubes(const SourceVolume& stretched, const VoxelShape& shape, const Job& job) {
  return Resampler(stretched, shape, job).run();
}

std::string resampling_text(const VoxelShape& shape) {
  return fmt::format("voxels are {}: resampled onto cubes of {:.6g}", shape.other_shape, shape.size);
}

}  // namespace farfield
