// SPDX-License-Identifier: Apache-2.0
#include "prefilter/match_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/hash.h"
#include "prefilter/fixed_sum.h"
#include "prefilter/self_shadowing.h"
#include "prefilter/sent_light.h"
#include "scattering/albedo.h"

namespace farfield {
namespace {

constexpr double kLines = 1 << 16;    ///< of one pass: the mean of twenty thousand hits is right to half a percent
constexpr int kPasses = 2;            ///< the first goes most of the way
constexpr int kSureBounces = 3;       ///< after which paths end by chance
constexpr int kMostBounces = 256;     ///< what is left then is nothing
constexpr float kMostLight = 16;      ///< that goes on of a channel: rare facets send many times what they meet
constexpr double kMostChange = 1.25;  ///< of what one pass makes a hit brighter
constexpr double kLeastRate = 0.1;    ///< that light changes with the odds of albedos: of white none does

/// Of light that comes from hits, per channel. Any thread may add.
struct SkyLight {
  std::array<FixedSum, 3> light;
  std::array<FixedSum, 3> scatterings;  ///< light by how often it was scattered
  std::array<FixedSum, 3> albedo;       ///< of the first scattering
  FixedSum hits;

  void add(const dvec3& of_path, int bounces) {
    for (size_t c = 0; c < 3; ++c) {
      light[c].add(of_path[static_cast<int>(c)]);
      scatterings[c].add(of_path[static_cast<int>(c)] * bounces);
    }
  }
  void add_hit(const vec3& goes_on) {
    hits.add(1);
    for (size_t c = 0; c < 3; ++c) albedo[c].add(goes_on[static_cast<int>(c)]);
  }
};

/// What a line meets, and how its light goes on from there.
struct Meeting {
  vec3 from{0.0f}, direction{0.0f};
  vec3 light{0.0f};  ///< what goes on of each channel; 0: all is absorbed
};

class LightPaths {
 public:
  LightPaths(const LineScene& scene, const SparseVolume& volume) : scene_(scene), volume_(volume) {}

  void add(const SeenLine& line, SkyLight& source, SkyLight& medium, SplitMix& random) const {
    follow(line, source, random, [&](const SeenLine& at) { return meet_source(at, random); });
    follow(line, medium, random, [&](const SeenLine& at) { return meet_medium(at, random); });
  }

 private:
  std::optional<Meeting> meet_source(const SeenLine& line, SplitMix& random) const {
    if (!line.hit) return {};
    const auto sent = scattered_by_source(scene_, line, random);
    if (!sent || sent->is_lost) return Meeting{};
    return Meeting{line.point(), sent->direction, sent->light};
  }

  /// As rendered, but that what the hot spot, the lean and the open side do counts to first order.
  std::optional<Meeting> meet_medium(const SeenLine& line, SplitMix& random) const {
    const auto collision = first_collision(volume_, scene_.grid(), line.ray, random);
    if (!collision) return {};
    const Voxel& voxel = volume_.voxels[collision->voxel];
    const auto sent = scattered_by_medium(voxel, line, random);
    if (!sent) return Meeting{};
    const bool is_highlight = sent->kind == SentOn::Kind::Highlight;
    const float of_direction = (is_highlight ? volume_.highlight_lean : volume_.hot_spot) * sent->slope +
                               glm::dot(volume_.open_side, sent->opening);
    const vec3 albedo = glm::min(layered_albedo(voxel.specular, voxel.diffuse + voxel.transmission), vec3(1.0f));
    return Meeting{scene_.point_along(line.ray, collision->at), sent->direction,
                   std::max(1 + of_direction, 0.0f) * odds_gain(albedo, voxel.self_shadowing) * sent->light};
  }

  /// Adds the light of a sky of radiance 1 that comes back along a line. meet(line): nothing where it gets away.
  template <typename Meet>
  void follow(SeenLine line, SkyLight& sums, SplitMix& random, const Meet& meet) const {
    dvec3 light(1.0);
    for (int bounces = 0; bounces < kMostBounces; ++bounces) {
      const std::optional<Meeting> met = meet(line);
      if (!met) {
        const bool is_walled = std::isfinite(line.ray.far);
        if (bounces > 0 && !is_walled) sums.add(light, bounces);
        return;
      }
      const vec3 goes_on = glm::min(met->light, kMostLight);
      if (bounces == 0) sums.add_hit(goes_on);
      light *= dvec3(goes_on);
      const double most = std::max({light.x, light.y, light.z});
      if (!(most > 0)) return;
      if (bounces >= kSureBounces) {
        if (!(random.next_unit() < most)) return;
        light /= std::min(most, 1.0);
      }
      line = scene_.cast_on(met->from, met->direction, sent_clearance(scene_), random);
    }
  }

  const LineScene& scene_;
  const SparseVolume& volume_;
};

/// What the odds of a channel's albedos must be multiplied by. Light that was scattered n times changes with the n-th
/// power of the albedo, and an albedo a with the power 1 - a of its odds.
float odds_wanted(const SkyLight& source, const SkyLight& medium, size_t c) {
  const double of_source = source.light[c].value(), of_medium = medium.light[c].value();
  if (!(of_source > 0 && of_medium > 0)) return 1;
  const double brighter =
      std::clamp((of_source / source.hits.value()) / (of_medium / medium.hits.value()), 1 / kMostChange, kMostChange);
  const double bounces = medium.scatterings[c].value() / of_medium;
  const double albedo = medium.albedo[c].value() / medium.hits.value();
  return static_cast<float>(std::pow(brighter, 1 / std::max(bounces * (1 - albedo), kLeastRate)));
}

}  // namespace

Result<void> match_sky(const LineScene& scene, SparseVolume& volume, const MatchSkyOptions& options) {
  if (volume.voxels.empty()) return {};
  for (int pass = 0; pass < kPasses; ++pass) {
    SkyLight source, medium;
    const LightPaths paths(scene, volume);
    const double begin = static_cast<double>(pass) / kPasses;
    const LinePass lines{kLines, mix64(options.seed, static_cast<uint64_t>(pass)),
                         options.job.step("match", begin, begin + 1.0 / kPasses)};
    FARFIELD_TRY(for_lines(scene, lines,
                           [&](const SeenLine& line, SplitMix& random) { paths.add(line, source, medium, random); }));
    vec3 odds;
    for (int c = 0; c < 3; ++c) odds[c] = odds_wanted(source, medium, static_cast<size_t>(c));
    for (Voxel& voxel : volume.voxels) recolor(odds, voxel);
  }
  return {};
}

}  // namespace farfield
