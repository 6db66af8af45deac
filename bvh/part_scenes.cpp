// SPDX-License-Identifier: Apache-2.0
// Callbacks as in bvh/instance_geometry.cpp, one space further in.
#include "bvh/part_scenes.h"

#include <fmt/format.h>

#include <algorithm>

#include "bvh/brick_volume.h"
#include "bvh/ray_lanes.h"
#include "cache/placed_parts.h"

namespace farfield {

namespace {

std::vector<vec3> points_of(const LevelView& level, uint32_t part) {
  std::vector<vec3> points;
  for (const uint32_t v : part_vertices(level, part)) points.push_back(level.positions[v]);
  return points;
}

/// Of all points: by its box alone a turned twig would be met by twice the rays (docs/decisions/0039).
Box3 bounds_of(const PartPlacement& placement, const std::vector<vec3>& points) {
  const glm::dmat4x3 transform = to_level(placement);
  Box3 bounds;
  for (const vec3& p : points) bounds.extend(vec3(transform * glm::dvec4(p, 1.0)));
  return padded_for_local_rays(bounds);
}

}  // namespace

EmbreeGeometry make_quads(BvhDevice& device, const LevelView& level, std::span<const Quad> quads, EmbreeFilter filter,
                          void* user) {
  EmbreeGeometry geometry = new_quads(device.handle());
  share_array(geometry.get(), level.positions);
  share_array(geometry.get(), quads);
  if (filter) set_filter(geometry.get(), filter, user);
  return geometry;
}

Result<PartScenes> PartScenes::build(BvhDevice& device, const LevelView& level, const LoadTerms& terms,
                                     EmbreeFilter filter, void* user) {
  PartScenes parts;
  parts.placements_ = level.placements;
  for (uint32_t part = 0; part < level.part_first_quad.size(); ++part) {
    const auto [first, end] = level.part_quads(part);
    const auto quads = level.quads.subspan(first, end - first);
    const auto make = [&] {
      std::vector<EmbreeGeometry> geometries;
      geometries.push_back(make_quads(device, level, quads, filter, user));
      return geometries;
    };
    const std::string what = fmt::format("the BVH of {} quads of part {}", quads.size(), part);
    FARFIELD_TRY_LET(MeasuredScene built,
                     build_measured_scene(device, make, terms.after(parts.bytes_), what, part + 1));
    parts.scenes_.push_back(std::move(built.scene));
    parts.most_held_bytes_ = std::max(parts.most_held_bytes_, parts.bytes_ + built.bytes + built.build_peak_bytes);
    parts.bytes_ += built.bytes + sizeof(EmbreeScene);
  }
  for (uint32_t part = 0; part < parts.scenes_.size(); ++part) {
    parts.points_.push_back(points_of(level, part));
    parts.point_bytes_ += sizeof(parts.points_.back()) + parts.points_.back().size() * sizeof(vec3);
  }
  return parts;
}

void PartScenes::forget_points() {
  points_ = {};
  point_bytes_ = 0;
}

EmbreeGeometry PartScenes::make_geometry(EmbreeDeviceRef device) const {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
  rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(placements_.size()));
  rtcSetGeometryUserData(geometry.get(), const_cast<PartScenes*>(this));
  rtcSetGeometryBoundsFunction(geometry.get(), bounds_callback, nullptr);
  rtcSetGeometryIntersectFunction(geometry.get(), intersect_callback);
  rtcSetGeometryOccludedFunction(geometry.get(), occluded_callback);
  return geometry;
}

void PartScenes::bounds_callback(const RTCBoundsFunctionArguments* args) {
  const auto& self = *static_cast<const PartScenes*>(args->geometryUserPtr);
  const PartPlacement& placement = self.placements_[args->primID];
  const Box3 bounds = bounds_of(placement, self.points_[placement.part]);
  args->bounds_o->lower_x = bounds.lower.x, args->bounds_o->upper_x = bounds.upper.x;
  args->bounds_o->lower_y = bounds.lower.y, args->bounds_o->upper_y = bounds.upper.y;
  args->bounds_o->lower_z = bounds.lower.z, args->bounds_o->upper_z = bounds.upper.z;
}

void PartScenes::intersect_callback(const RTCIntersectFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  const auto& self = *static_cast<const PartScenes*>(args->geometryUserPtr);
  const PartPlacement& placement = self.placements_[args->primID];
  auto& ray_hit = *reinterpret_cast<EmbreeRayHit*>(args->rayhit);
  const RayLanes ray = RayLanes::of(ray_hit.ray).transformed(placement.level_to_part);
  if (!is_traceable(ray.origin, ray.direction)) return;
  const unsigned outer_id = ray_hit.hit.geomID;
  const InSpace scope(ray_hit.ray, ray);
  if (trace_nearest(self.scenes_[placement.part].get(), *static_cast<EmbreeContext*>(args->context), ray_hit)) {
    ray_hit.hit.instID[0] = args->primID;
  } else {
    ray_hit.hit.geomID = outer_id;
  }
}

void PartScenes::occluded_callback(const RTCOccludedFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  const auto& self = *static_cast<const PartScenes*>(args->geometryUserPtr);
  const PartPlacement& placement = self.placements_[args->primID];
  auto& occluded = *reinterpret_cast<EmbreeRay*>(args->ray);
  const RayLanes ray = RayLanes::of(occluded).transformed(placement.level_to_part);
  if (!is_traceable(ray.origin, ray.direction)) return;
  const InSpace scope(occluded, ray);
  trace_occlusion(self.scenes_[placement.part].get(), *static_cast<EmbreeContext*>(args->context), occluded);
}

}  // namespace farfield
