// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/pixel_look.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace farfield {

namespace {

RayContext context_of(const CameraRay& ray, Rng& rng) {
  RayContext context;
  context.cone_width = ray.cone_width;
  context.cone_spread = ray.cone_spread;
  context.path_seed = rng.next_uint();
  context.ray_seed = rng.next_uint();
  return context;
}

/// What one ray hits.
PixelHit look_along(const TraceScene& scene, const CameraRay& ray, const PixelNames& names, Rng& rng) {
  RayContext context = context_of(ray, rng);
  EmbreeRayHit ray_hit = make_ray_hit(ray.origin, ray.direction);
  PixelHit hit;
  if (!trace_nearest(scene.embree, context.embree, ray_hit)) return hit;
  const Interaction seen = scene.runtime->interaction(ray_hit, context);
  hit.asset = names.assets[scene.runtime->asset_of({seen.instance}).value];
  hit.object = names.objects[seen.instance];
  hit.level = seen.level;
  hit.is_volume = seen.kind == Interaction::Kind::Volume;
  hit.distance = static_cast<double>(ray_hit.ray.tfar);
  return hit;
}

void count(const PixelHit& hit, std::vector<PixelHit>& hits) {
  const auto found = std::ranges::find_if(hits, [&](const PixelHit& other) {
    return hit.asset == other.asset && hit.object == other.object && hit.level == other.level &&
           hit.is_volume == other.is_volume;
  });
  PixelHit& sum = found != hits.end() ? *found : hits.emplace_back(hit);
  ++sum.rays;
  sum.distance += (hit.distance - sum.distance) / sum.rays;
}

std::vector<PixelLevel> levels_of(const Runtime& runtime, const RayVisit& visit) {
  const std::vector<LevelInfo>& infos = runtime.levels(visit.asset);
  const std::vector<LevelRecord> stats = runtime.level_stats(visit.asset);
  std::vector<PixelLevel> levels;
  for (size_t slot = 0; slot < infos.size(); ++slot) {
    levels.push_back({infos[slot].level, std::ldexp(visit.level_0_footprint, static_cast<int>(infos[slot].level)),
                      infos[slot].resident_bytes, stats[slot].resident_bytes > 0, stats[slot].is_broken,
                      stats[slot].is_planned});
  }
  return levels;
}

}  // namespace

void look_at_pixel(const TraceScene& scene, const Camera& camera, const PlanSummary& plan, const PixelNames& names,
                   PixelReport& report) {
  const auto x = static_cast<float>(report.x), y = static_cast<float>(report.y);
  Rng rng(static_cast<uint64_t>(report.y) * static_cast<uint64_t>(report.width) + static_cast<uint64_t>(report.x));
  for (int i = 0; i < report.rays; ++i) {
    const float x_inside = rng.next();
    count(look_along(scene, camera.ray(x + x_inside, y + rng.next()), names, rng), report.hits);
  }
  std::ranges::stable_sort(report.hits, std::greater<>(), &PixelHit::rays);

  const CameraRay middle = camera.ray(x + 0.5f, y + 0.5f);
  report.origin = middle.origin, report.direction = middle.direction;
  report.cone_width = middle.cone_width, report.cone_spread = middle.cone_spread;
  for (const RayVisit& visit :
       scene.runtime->explain(make_ray(middle.origin, middle.direction), context_of(middle, rng))) {
    report.visits.push_back({names.assets[visit.asset.value], names.objects[visit.instance.value], visit,
                             plan.levels_given_up[visit.asset.value], levels_of(*scene.runtime, visit)});
  }
}

}  // namespace farfield
