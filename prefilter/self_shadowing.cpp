// SPDX-License-Identifier: Apache-2.0
#include "prefilter/self_shadowing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "prefilter/voxel_ratios.h"
#include "scattering/albedo.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

/// In voxels: how far light must get away.
constexpr float kEscapeLength = 0.5f;
/// In voxels: light that goes on starts this far from the face it leaves.
constexpr float kClearance = 1e-3f;
/// What the measurement of a brick counts in each of its voxels, as light of weight 1 that is sent on.
constexpr double kPriorLight = 4;

/// Where light goes on that arrived along `direction` at a face: a cosine lobe on the side that it came from or, as
/// often as the face lets light through, on the other. Nothing for faces too small to have a normal.
std::optional<vec3> scattered_direction(const FaceMaterial& m, const vec3& geometric_normal, const vec3& direction,
                                        SplitMix& random) {
  const float longest = max_component(glm::abs(geometric_normal));
  if (!(longest >= std::numeric_limits<float>::min())) return {};
  const float through = component_sum(m.transmission);
  const float back = component_sum(m.diffuse) + component_sum(m.specular);
  const bool goes_through = static_cast<float>(random.next_unit()) * (through + back) < through;
  // In two steps: the square of a tiny face's normal may be no float.
  const vec3 normal = glm::normalize(geometric_normal / longest);
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  return cosine_lobe((glm::dot(normal, direction) > 0) == goes_through ? normal : -normal, u1, u2);
}

/// The light of one hit.
struct SentOn {
  vec3 direction{0.0f};
  float weight = 0;
  bool gets_away = false;
};

std::optional<SentOn> send_on(const LineScene& scene, const SeenLine& line, SplitMix& random) {
  const FaceMaterial& m = scene.geometry().materials[line.hit->triangle];
  const auto away = scattered_direction(m, line.hit->normal, line.direction, random);
  const float weight = component_sum(layered_albedo(m.specular, m.diffuse + m.transmission));
  if (!away || !(weight > 0)) return {};
  const auto size = static_cast<float>(scene.lattice().voxel_size);
  const float near = kClearance * size, far = kEscapeLength * size;
  if (scene.is_stopped_by_macrosurface(line.point(), *away, near, far, random)) return {};  // as it stops the medium's
  return SentOn{*away, weight, !scene.is_stopped_by_geometry(line.point(), *away, near, far, random)};
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
  std::vector<SourceAndMedium> light(volume.voxels.size());
  const double length = kEscapeLength * volume.lattice.voxel_size;
  FARFIELD_TRY(
      for_lines(scene, {options.lines, options.seed, options.job}, [&](const SeenLine& line, SplitMix& random) {
        if (!line.hit) return;
        const auto v = scene.voxel_of_hit(line);
        if (!v) return;
        const auto sent = send_on(scene, line, random);
        if (!sent) return;
        const Voxel& voxel = volume.voxels[*v];
        const double sigma = std::sqrt(std::max(0.0f, voxel.sggx.quadratic(sent->direction)));
        if (sent->gets_away) light[*v].source.add(sent->weight);
        light[*v].medium.add(sent->weight * std::exp(-voxel.density * sigma * length));
      }));
  const std::vector<double> ratios = shrunk_ratios(volume, light, kPriorLight);
  for (size_t v = 0; v < ratios.size(); ++v) let_escape(ratios[v], volume.voxels[v]);
  return {};
}

}  // namespace farfield
