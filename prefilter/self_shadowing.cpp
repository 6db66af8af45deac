// SPDX-License-Identifier: Apache-2.0
#include "prefilter/self_shadowing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "prefilter/voxel_ratios.h"
#include "scattering/albedo.h"
#include "scattering/highlight.h"
#include "scattering/hot_spot.h"
#include "scattering/microfacet.h"
#include "scattering/open_side.h"
#include "scattering/sggx.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

/// In voxels: light that goes on starts this far from the face it leaves.
constexpr float kClearance = 1e-3f;
constexpr float kFar = std::numeric_limits<float>::infinity();
/// What the measurement of a brick counts in each of its voxels, as light of weight 1 that is sent on.
constexpr double kPriorLight = 64;
/// Sides of which light shows no spread along an axis say nothing about it: a share of their spread in all.
constexpr double kLeastSpread = 1e-2;

/// Light that goes on from what a line sees first.
struct SentOn {
  vec3 direction{0.0f};
  float weight = 0;      ///< how much light
  bool is_base = false;  ///< not of the highlight: with a contrast, a side and an opening
  float contrast = 0;    ///< L less its mean over the lobe: what the strength of the hot spot multiplies
  vec3 side{0.0f};       ///< the normal on the line's side
  vec3 opening{0.0f};    ///< what the open side multiplies: scattering/open_side.h, to first order
};

/// Of the highlight of a flat piece with normal `seen`.
vec3 mirrored(float roughness2, const vec3& seen, const vec3& wo, float u1, float u2) {
  const vec3 facet = Microfacets(specular_sggx(SymMat3::outer(seen), roughness2), seen).sample_visible(wo, u1, u2);
  const vec3 away = reflect_about(wo, facet);
  return glm::dot(away, seen) > 0 ? away : cosine_lobe(seen, u1, u2);  // over several facets
}

/// Of the base: a cosine lobe on the side that the light came from or, as often as light goes through, on the other.
template <typename Material>
SentOn scattered_by_base(const Material& m, const vec3& seen, const vec3& direction, SplitMix& random) {
  const float through = component_sum(m.transmission), back = component_sum(m.diffuse);
  const vec3 side = static_cast<float>(random.next_unit()) * (through + back) < through ? -seen : seen;
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  SentOn sent{.direction = cosine_lobe(side, u1, u2), .is_base = true, .side = seen};
  sent.contrast = hot_spot_lobe(-glm::dot(direction, sent.direction)) - mean_hot_spot_lobe(-glm::dot(direction, side));
  sent.opening = (1 - std::min((through + back) / 3, 1.0f)) * seen;
  return sent;
}

/// Where light goes on that arrived along `direction`. Material: FaceMaterial or Voxel. Nothing for black ones.
template <typename Material>
std::optional<SentOn> scattered(const Material& m, const vec3& normal, const vec3& direction, SplitMix& random) {
  const vec3 seen = glm::dot(normal, direction) > 0 ? -normal : normal;
  vec3 mirror(0.0f);
  if (const Highlight highlight(m.specular, m.roughness2); highlight.exists())
    mirror = highlight.albedo(highlight.share(-glm::dot(seen, direction)));
  const float of_mirror = component_sum(mirror);
  const float of_base = component_sum((vec3(1.0f) - mirror) * (m.diffuse + m.transmission));
  if (!(of_mirror + of_base > 0)) return {};
  SentOn sent;
  if (static_cast<float>(random.next_unit()) * (of_mirror + of_base) < of_mirror) {
    const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
    sent.direction = mirrored(m.roughness2, seen, -direction, u1, u2);
  } else {
    sent = scattered_by_base(m, seen, direction, random);
  }
  sent.weight = of_mirror + of_base;
  return sent;
}

/// From the hit. Nothing for faces too small to have a normal.
std::optional<SentOn> scattered_by_source(const LineScene& scene, const SeenLine& line, SplitMix& random) {
  const float longest = max_component(glm::abs(line.hit->normal));
  if (!(longest >= std::numeric_limits<float>::min())) return {};
  // In two steps: the square of a tiny face's normal may be no float.
  const vec3 normal = glm::normalize(line.hit->normal / longest);
  return scattered(scene.geometry().materials[line.hit->triangle], normal, line.direction, random);
}

std::optional<SentOn> scattered_by_medium(const Voxel& voxel, const SeenLine& line, SplitMix& random) {
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  const vec3 normal = Sggx(cholesky(voxel.sggx)).sample_visible(-line.direction, u1, u2);
  return scattered(voxel, normal, line.direction, random);
}

/// Where the medium stops a line first.
struct Collision {
  uint32_t voxel = 0;
  double at = 0;  ///< along the line's ray, in voxels
};
std::optional<Collision> first_collision(const SparseVolume& volume, const LineScene& scene, const SeenLine& line,
                                         SplitMix& random) {
  double left = -std::log1p(-random.next_unit());
  std::optional<Collision> found;
  walk_octant_depths(volume, scene.grid(), line.ray, [&](const OctantStretch& at, double depth) {
    if (depth > left) found = {at.voxel, at.enter + left / depth * (at.leave - at.enter)};
    left -= depth;
    return !found;
  });
  return found;
}

/// How much of the light that something sends on gets away.
struct Escape {
  FixedSum sent, away;
  FixedSum away_contrast;                ///< weighted with the contrast
  std::array<FixedSum, 3> away_opening;  ///< the same with the opening
};

/// What sides light gets away from.
struct Sides {
  std::array<FixedSum, 3> side, opening;
  std::array<FixedSum, 9> moments;  ///< of side opening^T, by columns

  void add(double away, const SentOn& sent) {
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<size_t>(i);
      side[at].add(away * sent.side[i]);
      opening[at].add(away * sent.opening[i]);
      for (int j = 0; j < 3; ++j) moments[3 * at + static_cast<size_t>(j)].add(away * sent.opening[i] * sent.side[j]);
    }
  }
};

dvec3 vector_of(const std::array<FixedSum, 3>& sums) { return {sums[0].value(), sums[1].value(), sums[2].value()}; }

/// Light of one of two kinds: of the geometry, of the medium. Any thread may add.
struct Light {
  explicit Light(size_t voxels) : of_voxel(voxels) {}

  void add(uint32_t voxel, const SentOn& sent, double share_away) {
    const double away = share_away * sent.weight;
    of_voxel[voxel].sent.add(sent.weight);
    of_voxel[voxel].away.add(away);
    of_voxel[voxel].away_contrast.add(away * sent.contrast);
    for (int i = 0; i < 3; ++i) of_voxel[voxel].away_opening[static_cast<size_t>(i)].add(away * sent.opening[i]);
    if (sent.is_base) {
      away_of_base.add(away);
      sides.add(away, sent);
    }
    contrast2.add(away * sent.contrast * sent.contrast);
  }

  double total(FixedSum Escape::*field) const {
    double sum = 0;
    for (const Escape& escape : of_voxel) sum += (escape.*field).value();
    return sum;
  }

  std::vector<Escape> of_voxel;
  FixedSum away_of_base;
  FixedSum contrast2;
  Sides sides;
};

class EscapeMeasurement {
 public:
  EscapeMeasurement(const LineScene& scene, const SparseVolume& volume)
      : scene_(scene), volume_(volume), source_(volume.voxels.size()), medium_(volume.voxels.size()) {}

  void add(const SeenLine& line, SplitMix& random) {
    if (line.hit) add_source(line, random);
    add_medium(line, random);
  }

  float hot_spot_strength() const;
  vec3 open_side() const;
  std::vector<double> ratios(float strength, const vec3& open_side) const;

 private:
  void add_source(const SeenLine& line, SplitMix& random);
  void add_medium(const SeenLine& line, SplitMix& random);
  /// What the macrosurface stops it stops for both: it says nothing.
  bool meets_macrosurface(const vec3& from, const SentOn& sent, SplitMix& random) const {
    return scene_.is_stopped_by_macrosurface(from, sent.direction, near(), kFar, random);
  }
  float near() const { return kClearance * static_cast<float>(scene_.lattice().voxel_size); }

  const LineScene& scene_;
  const SparseVolume& volume_;
  Light source_, medium_;
};

void EscapeMeasurement::add_source(const SeenLine& line, SplitMix& random) {
  const auto voxel = scene_.voxel_of_hit(line);
  const auto sent = scattered_by_source(scene_, line, random);
  if (!voxel || !sent || meets_macrosurface(line.point(), *sent, random)) return;
  const bool is_stopped = scene_.is_stopped_by_geometry(line.point(), sent->direction, near(), kFar, random);
  source_.add(*voxel, *sent, is_stopped ? 0 : 1);
}

void EscapeMeasurement::add_medium(const SeenLine& line, SplitMix& random) {
  const auto collision = first_collision(volume_, scene_, line, random);
  if (!collision) return;
  const auto sent = scattered_by_medium(volume_.voxels[collision->voxel], line, random);
  const dvec3 at = line.ray.origin + collision->at * line.ray.direction;
  const vec3 from(volume_.lattice.origin + volume_.lattice.voxel_size * at);
  if (!sent || meets_macrosurface(from, *sent, random)) return;
  const VoxelRay away{at, dvec3(sent->direction), 0, kFar};
  medium_.add(collision->voxel, *sent, std::exp(-optical_depth(volume_, scene_.grid(), away)));
}

/// Mean contrast of the light that gets away must be the geometry's.
float EscapeMeasurement::hot_spot_strength() const {
  const double source = source_.away_of_base.value(), medium = medium_.away_of_base.value();
  if (!(source > 0 && medium > 0)) return 0;
  const double wanted = source_.total(&Escape::away_contrast) / source;
  const double first = medium_.total(&Escape::away_contrast), second = medium_.contrast2.value();
  const double slope = second - wanted * first;
  if (!(slope > 0)) return 0;
  return static_cast<float>(std::clamp((wanted * medium - first) / slope, 0.0, double{kStrongestHotSpot}));
}

/// The mean side of the light that gets away must be the geometry's.
vec3 EscapeMeasurement::open_side() const {
  const double source = source_.away_of_base.value(), medium = medium_.away_of_base.value();
  if (!(source > 0 && medium > 0)) return vec3(0.0f);
  const dvec3 wanted = vector_of(source_.sides.side) / source, is = vector_of(medium_.sides.side) / medium;
  const dvec3 opening = vector_of(medium_.sides.opening) / medium;
  glm::dmat3 moments;
  for (int i = 0; i < 9; ++i) moments[i / 3][i % 3] = medium_.sides.moments[static_cast<size_t>(i)].value() / medium;
  // (is + moments x) / (1 + opening.x) = wanted; with a share of the trace more where the sides have no spread
  const glm::dmat3 slope = moments - glm::outerProduct(wanted, opening);
  const double trace = moments[0][0] + moments[1][1] + moments[2][2];
  const dvec3 x = glm::inverse(slope + glm::dmat3(kLeastSpread * trace)) * (wanted - is);
  const double length = glm::length(x);
  if (!std::isfinite(length)) return vec3(0.0f);
  return vec3(length > kMostOpenSide ? x * (kMostOpenSide / length) : x);
}

/// What gets away of the geometry's light by what gets away of the medium's with such a hot spot and such sides, voxel
/// by voxel.
std::vector<double> EscapeMeasurement::ratios(float strength, const vec3& open_side) const {
  const auto escapes = [&](const Light& light, double of_contrast, const dvec3& of_opening) {
    std::vector<SourceAndMedium> sums(light.of_voxel.size());
    for (size_t v = 0; v < sums.size(); ++v) {
      const Escape& of_voxel = light.of_voxel[v];
      sums[v].source.add(of_voxel.away.value() + of_contrast * of_voxel.away_contrast.value() +
                         glm::dot(of_opening, vector_of(of_voxel.away_opening)));
      sums[v].medium.add(of_voxel.sent.value());
    }
    return shrunk_ratios(volume_, sums, kPriorLight);
  };
  std::vector<double> result = escapes(source_, 0, dvec3(0));
  const std::vector<double> medium = escapes(medium_, strength, dvec3(open_side));
  for (size_t v = 0; v < result.size(); ++v) result[v] /= std::max(medium[v], 1e-6);
  return result;
}

}  // namespace

void let_escape(double ratio, Voxel& voxel) {
  const auto share = static_cast<float>(std::clamp(ratio, kLeastEscape, kMostEscape));
  voxel.self_shadowing = std::min(share, 1.0f);
  if (!(share > 1)) return;
  const vec3 albedo = layered_albedo(voxel.specular, voxel.diffuse + voxel.transmission);
  const vec3 gain = cluster_albedo(glm::min(albedo, vec3(1.0f)), share) / glm::max(albedo, vec3(1e-6f));
  voxel.diffuse *= gain;
  voxel.specular *= gain;
  voxel.transmission *= gain;
}

Result<void> measure_self_shadowing(const LineScene& scene, SparseVolume& volume, const SelfShadowingOptions& options) {
  if (volume.voxels.empty()) return {};
  EscapeMeasurement measurement(scene, volume);
  FARFIELD_TRY(for_lines(scene, {options.lines, options.seed, options.job},
                         [&](const SeenLine& line, SplitMix& random) { measurement.add(line, random); }));
  volume.hot_spot = measurement.hot_spot_strength();
  volume.open_side = measurement.open_side();
  const std::vector<double> ratios = measurement.ratios(volume.hot_spot, volume.open_side);
  for (size_t v = 0; v < ratios.size(); ++v) let_escape(ratios[v], volume.voxels[v]);
  return {};
}

}  // namespace farfield
