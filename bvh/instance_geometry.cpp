// SPDX-License-Identifier: Apache-2.0
// The callbacks, and what Embree 3.13 demands of them:
//
// * Single rays (N == 1) are transformed in place and traced with the ray's RayContext: args->rayhit is the caller's
//   EmbreeRayHit, and the filter of a level's faces casts the context back. Within packets (N > 1) rays are copies.
// * The direction is not normalised, so t means the same inside and outside and tnear/tfar need no change.
// * A nested hit writes the nested scene's ids, and may do so without shrinking tfar (equal distances). So geomID is
//   set aside before the nested call, and what it is afterwards tells whether there was a hit.
// * context->instID is left alone: Debian's Embree has one instance level and asserts on.
// * occluded reports by tfar = -infinity.
// * Debian's Embree has its assertions on: a ray with a NaN or a coordinate beyond 1.8e18 stops the process. Hosts see
//   to that in world space; what an extreme transform makes of a ray is checked here.
#include "bvh/instance_geometry.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/check.h"
#include "base/hash.h"
#include "base/just_behind.h"
#include "base/nonfinite.h"
#include "bvh/ray_lanes.h"
#include "bvh/traced_morph.h"

namespace farfield {

namespace {

// How much the range in which a ray meets an instance's local bounds is widened: rounding of the slab test.
constexpr float kRangePad = 1e-6f;

/// Random bits of a ray in an instance.
uint64_t bits_of_ray(const RayContext& context, uint32_t instance) { return mix64(context.ray_seed, instance); }

}  // namespace

// --- Rays ------------------------------------------------------------------------------------------------------------

/// A ray that enters an instance: with which level it deals there.
struct InstanceGeometry::Visit {
  RayLanes ray;  ///< in local space
  float t_entry;
  LevelChoice choice;
  const TracedLevel* level = nullptr;
  const TracedMorph* morph = nullptr;  ///< in place of the level

  LocalRay ray_up_to(float t_far) const {
    const Float4 &o = ray.origin, &d = ray.direction;
    return {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, o[3], t_far};
  }
};

/// Fills in `visit` but for the level itself. False: the ray passes by.
inline bool InstanceGeometry::choose(const InstanceRecord& record, uint32_t instance, const EmbreeRay& ray,
                                     const RayContext& context, Visit& visit) const {
  const TracedAsset& asset = *assets[record.asset];
  visit.ray = RayLanes::of(ray).transformed(record.world_to_local);
  if (!is_traceable(visit.ray.origin, visit.ray.direction)) return false;
  const RayRange range = clip_to_box(visit.ray.origin, visit.ray.direction, ray.tnear, ray.tfar, asset.bounds);
  if (!(range.t_near * (1.0f - kRangePad) <= range.t_far * (1.0f + kRangePad))) return false;
  visit.t_entry = range.t_near;
  visit.choice = choose_level(asset, record.footprint, record.limits, instance, context, range.t_near, forced_lambda);
  return true;
}

/// Fills in `visit`. False: the ray passes by.
bool InstanceGeometry::enter(const InstanceRecord& record, uint32_t instance, const EmbreeRay& ray,
                             const RayContext& context, Visit& visit) const {
  if (!choose(record, instance, ray, context, visit)) return false;
  const TracedAsset& asset = *assets[record.asset];
  if (visit.choice.blend > 0.0f) {
    visit.morph = asset.morphs[visit.choice.slot].load(std::memory_order_acquire);
    if (!visit.morph) visit.morph = source_.serve_morph(record.asset, visit.choice.slot);
    if (visit.morph) return true;
    visit.choice.slot = dissolve({visit.choice.slot, visit.choice.slot + 1, visit.choice.blend}, instance, context);
    visit.choice.blend = 0.0f;
  }
  visit.level = asset.loaded[visit.choice.slot].load(std::memory_order_acquire);
  if (!visit.level) visit.level = source_.serve(record.asset, visit.choice.slot);
  return visit.level != nullptr;
}

/// The nearest hit on a level, and what the record has of it. False: none, ray_hit's ids are not to be trusted, and the
/// record is as it was.
bool InstanceGeometry::intersect_level(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                                       EmbreeContext& embree_context, HitRecord& made) {
  const TracedLevel& level = *visit.level;
  RTCHit& hit = ray_hit.hit;
  bool on_surface = false;
  if (level.scene.handle()) {
    const InSpace scope(ray_hit.ray, visit.ray);
    on_surface = trace_nearest(level.scene.handle(), embree_context, ray_hit);
  }
  if (!level.volume.is_empty()) {
    const LocalRay up_to_surface = visit.ray_up_to(ray_hit.ray.tfar);
    if (const auto collision = level.volume.first_collision(up_to_surface, flight_seed(ray_bits, level.slot))) {
      ray_hit.ray.tfar = collision->t;
      made = {};
      made.level_slot = static_cast<uint8_t>(level.slot);
      made.is_volume = true;
      made.element = collision->payload;
      made.attenuation = collision->attenuation;
      return true;
    }
  }
  if (!on_surface) return false;
  made = {};
  made.level_slot = static_cast<uint8_t>(level.slot);
  made.element = 2 * level.view.quad_of(hit.geomID, hit.primID) + quad_side(hit.u, hit.v);
  if (hit.geomID != 0) {
    made.placement = hit.instID[0];
    hit.instID[0] = embree_context.instID[0];
  }
  const vec2 barycentric = face_barycentric(hit.u, hit.v);
  made.barycentric[0] = barycentric.x, made.barycentric[1] = barycentric.y;
  return true;
}

/// The same on a morph.
bool InstanceGeometry::intersect_morph(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                                       EmbreeContext& embree_context, HitRecord& made) {
  const InSpace scope(ray_hit.ray, visit.ray);
  const auto found = visit.morph->intersect(ray_hit, embree_context, visit.choice.blend, ray_bits);
  if (!found) return false;
  made = {};
  made.level_slot = static_cast<uint8_t>(visit.choice.slot);
  made.blend = visit.choice.blend;
  made.is_volume = found->is_volume;
  made.is_coarser = found->is_coarser;
  made.element = found->element;
  made.barycentric[0] = found->barycentric.x, made.barycentric[1] = found->barycentric.y;
  made.attenuation = found->attenuation;
  return true;
}

bool InstanceGeometry::intersect(uint32_t instance, unsigned geometry_id, EmbreeRayHit& ray_hit,
                                 const RayContext& context, EmbreeContext* embree_context, HitRecord* record) const {
  std::optional<InstanceRecord> moved;
  const InstanceRecord& hit_instance = record_at(instance, ray_hit.ray.time, moved);
  Visit visit;
  if (!enter(hit_instance, instance, ray_hit.ray, context, visit)) return false;
  EmbreeRay& ray = ray_hit.ray;
  RTCHit& hit = ray_hit.hit;
  const unsigned outer_id = hit.geomID;
  HitRecord unwanted;
  HitRecord& made = record ? *record : unwanted;
  const bool is_hit = visit.morph
                          ? intersect_morph(visit, bits_of_ray(context, instance), ray_hit, *embree_context, made)
                          : intersect_level(visit, bits_of_ray(context, instance), ray_hit, *embree_context, made);
  if (!is_hit) {
    hit.geomID = outer_id;
    return false;
  }
  made.instance = instance;
  made.lambda = lambda_of_choice(*assets[hit_instance.asset], hit_instance.footprint, hit_instance.limits, visit.choice,
                                 forced_lambda);
  vec3 normal_world(0.0f);
  if (made.is_volume) {
    hit.u = hit.v = 0.0f;
    hit.instID[0] = embree_context->instID[0];
  } else {
    const vec3 normal(hit.Ng_x, hit.Ng_y, hit.Ng_z);
    made.normal_local[0] = normal.x, made.normal_local[1] = normal.y, made.normal_local[2] = normal.z;
    normal_world = made.placement == kNoPlacement
                       ? hit_instance.normal_to_world(normal)
                       : placed(hit_instance, visit.level->view.placements[made.placement]).normal_to_world(normal);
  }
  made.footprint = context.width_at(ray.tfar);
  hit.Ng_x = normal_world.x, hit.Ng_y = normal_world.y, hit.Ng_z = normal_world.z;
  hit.geomID = geometry_id;
  hit.primID = instance;
  return true;
}

bool InstanceGeometry::occluded(uint32_t instance, EmbreeRay& ray, RayContext& context,
                                EmbreeContext* embree_context) const {
  std::optional<InstanceRecord> moved;
  Visit visit;
  if (!enter(record_at(instance, ray.time, moved), instance, ray, context, visit)) return false;
  float* const transmittance = context.transmittance >= 0.0f ? &context.transmittance : nullptr;
  if (visit.morph) {
    const InSpace scope(ray, visit.ray);
    return visit.morph->occluded(ray, *embree_context, visit.choice.blend, bits_of_ray(context, instance),
                                 transmittance);
  }
  if (visit.level->scene.handle()) {
    const InSpace scope(ray, visit.ray);
    if (trace_occlusion(visit.level->scene.handle(), *embree_context, ray)) return true;
  }
  const BrickVolume& volume = visit.level->volume;
  if (transmittance) {
    *transmittance *= std::exp(-volume.optical_depth(visit.ray_up_to(ray.tfar)));
    return false;
  }
  if (volume.is_empty() || !volume.first_collision(visit.ray_up_to(ray.tfar),
                                                   flight_seed(bits_of_ray(context, instance), visit.level->slot)))
    return false;
  ray.tfar = -kInfinity;
  return true;
}

// --- Embree ----------------------------------------------------------------------------------------------------------

void InstanceGeometry::bounds_callback(const RTCBoundsFunctionArguments* args) {
  const auto& self = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  const uint64_t segments = self.time_segments_;
  const float time = segments == 0 ? 0.0f : static_cast<float>(args->timeStep) / static_cast<float>(segments);
  std::optional<InstanceRecord> moved;
  const InstanceRecord& instance = self.record_at(args->primID, time, moved);
  // The empty box of a hidden instance is not valid: Embree leaves it out.
  const Box3 bounds = self.is_hidden(args->primID) ? Box3() : instance_bounds(instance, *self.assets[instance.asset]);
  args->bounds_o->lower_x = bounds.lower.x, args->bounds_o->upper_x = bounds.upper.x;
  args->bounds_o->lower_y = bounds.lower.y, args->bounds_o->upper_y = bounds.upper.y;
  args->bounds_o->lower_z = bounds.lower.z, args->bounds_o->upper_z = bounds.upper.z;
}

namespace {

using AskFilters = void (*)(const void* args, const EmbreeFilterArguments* asked);

void ask_intersection_filters(const void* args, const EmbreeFilterArguments* asked) {
  rtcFilterIntersection(static_cast<const RTCIntersectFunctionNArguments*>(args), asked);
}
void ask_occlusion_filters(const void* args, const EmbreeFilterArguments* asked) {
  rtcFilterOcclusion(static_cast<const RTCOccludedFunctionNArguments*>(args), asked);
}

}  // namespace

/// One ray that Embree asks about, and how to ask the host about its hits.
struct InstanceGeometry::Query {
  RayContext& context;
  EmbreeContext* given;  ///< the context that the host has passed, which its filters get
  uint32_t instance;
  unsigned geometry_id;
  bool is_filtered;
  AskFilters ask_filters;
  const void* args;  ///< of the callback, for it

  bool does_host_accept(EmbreeRayHit& ray_hit) const {
    int valid = -1;
    EmbreeFilterArguments asked{
        &valid, nullptr, given, reinterpret_cast<RTCRayN*>(&ray_hit.ray), reinterpret_cast<RTCHitN*>(&ray_hit.hit), 1};
    ask_filters(args, &asked);
    return valid != 0;
  }
};

namespace {

uint32_t mark_of(const EmbreeContext& context) {
  uint32_t mark;
  std::memcpy(&mark, &context.flags, sizeof mark);
  return mark & ~uint32_t{RTC_INTERSECT_CONTEXT_FLAG_COHERENT};
}

/// The ray came by way of an instance of the scene. Footprints and interactions would be of the wrong space.
bool is_nested(const EmbreeContext& context) { return context.instID[0] != kNoGeometry; }

/// The RayContext of a ray, whatever the host has passed; `fallback` if that has none.
RayContext& context_of(EmbreeContext& given, const EmbreeRay& ray, std::optional<RayContext>& fallback) {
  const uint32_t mark = mark_of(given);
  if (mark == detail::kRayContextMark) return reinterpret_cast<RayContext&>(given);
  if (mark == detail::kRayContextsMark) {
    auto& all = reinterpret_cast<RayContexts&>(given);
    if (ray.id < all.count) return all.rays[ray.id];
  }
  fallback.emplace();
  uint64_t seed = 0;
  for (const float x : {ray.org_x, ray.org_y, ray.org_z, ray.dir_x, ray.dir_y, ray.dir_z}) {
    seed = mix64(seed, std::bit_cast<uint32_t>(x));
  }
  fallback->path_seed = static_cast<uint32_t>(seed);
  fallback->ray_seed = static_cast<uint32_t>(seed >> 32);
  return *fallback;
}

/// The host's filter is not asked about what lies inside of instances.
class WithoutFilter {
 public:
  explicit WithoutFilter(EmbreeContext& context) : context_(context), filter_(context.filter) {
    if (filter_) context_.filter = nullptr;
  }
  ~WithoutFilter() {
    if (filter_) context_.filter = filter_;
  }
  WithoutFilter(const WithoutFilter&) = delete;
  WithoutFilter& operator=(const WithoutFilter&) = delete;

 private:
  EmbreeContext& context_;
  RTCFilterFunctionN filter_;
};

}  // namespace

bool is_of_ray_context(const EmbreeContext& context) { return mark_of(context) == detail::kRayContextMark; }

/// The nearest hit in the instance that the host's filters accept.
bool InstanceGeometry::intersect_filtered(const Query& query, EmbreeRayHit& ray_hit, HitRecord* record) const {
  RayContext& context = query.context;
  const auto intersect_once = [&] {
    const WithoutFilter scope(context.embree);
    return intersect(query.instance, query.geometry_id, ray_hit, context, &context.embree, record);
  };
  if (!query.is_filtered) return intersect_once();

  const EmbreeRayHit before = ray_hit;
  const std::optional<HitRecord> record_before = record ? std::optional(*record) : std::nullopt;
  const uint32_t ray_seed = context.ray_seed;
  bool is_accepted = false;
  while (intersect_once()) {
    is_accepted = query.does_host_accept(ray_hit);
    if (is_accepted) break;
    const float behind = just_behind(ray_hit.ray.tnear, ray_hit.ray.tfar);
    ray_hit = before;
    if (record) *record = *record_before;
    if (!(behind < ray_hit.ray.tfar)) break;
    ray_hit.ray.tnear = behind;
    context.ray_seed = static_cast<uint32_t>(mix64(context.ray_seed, query.instance));  // of the flight that goes on
  }
  ray_hit.ray.tnear = before.ray.tnear;
  context.ray_seed = ray_seed;
  return is_accepted;
}

/// Single rays with a RayContext and without filters: nothing else is asked for, and nothing else is in their way.
bool InstanceGeometry::is_plain(unsigned ray_count, const EmbreeContext& context) const {
  return ray_count == 1 && is_of_ray_context(context) && !context.filter && !has_filters && !is_nested(context);
}

namespace {

/// What the host has passed to the query that a callback belongs to. In Embree 4 `args.context` is a base of it.
template <typename Arguments>
EmbreeContext& given_context(const Arguments& args) {
  return *static_cast<EmbreeContext*>(args.context);
}

}  // namespace

void InstanceGeometry::intersect_callback(const RTCIntersectFunctionNArguments* args) {
  const auto& self = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  EmbreeContext& given = given_context(*args);
  if (!self.is_plain(args->N, given)) return self.intersect_others(args);
  if (args->valid[0] == 0) return;
  auto& context = reinterpret_cast<RayContext&>(given);
  auto& ray_hit = *reinterpret_cast<EmbreeRayHit*>(args->rayhit);
  self.intersect(args->primID, args->geomID, ray_hit, context, &given, &context.hit);
}

void InstanceGeometry::occluded_callback(const RTCOccludedFunctionNArguments* args) {
  const auto& self = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  EmbreeContext& given = given_context(*args);
  if (!self.is_plain(args->N, given)) return self.occlude_others(args);
  if (args->valid[0] == 0) return;
  auto& context = reinterpret_cast<RayContext&>(given);
  self.occluded(args->primID, *reinterpret_cast<EmbreeRay*>(args->ray), context, &given);
}

void InstanceGeometry::intersect_others(const RTCIntersectFunctionNArguments* args) const {
  EmbreeContext& given = given_context(*args);
  if (is_nested(given)) return source_.refuse_nested();
  const auto intersect_one = [&](EmbreeRayHit& ray_hit, bool is_single) {
    std::optional<RayContext> fallback;
    RayContext& context = context_of(given, ray_hit.ray, fallback);
    const bool has_own = is_single || &context.embree != &given;  // lanes that share one leave no record
    const Query query{
        context, &given, args->primID, args->geomID, has_filters || given.filter, ask_intersection_filters, args};
    return intersect_filtered(query, ray_hit, has_own ? &context.hit : nullptr);
  };
  if (args->N == 1) {
    if (args->valid[0] != 0) intersect_one(*reinterpret_cast<EmbreeRayHit*>(args->rayhit), true);
    return;
  }
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
  for (unsigned lane = 0; lane < args->N; ++lane) {
    if (args->valid[lane] == 0) continue;
    EmbreeRayHit ray_hit;
    ray_hit.ray = rtcGetRayFromRayN(rays, args->N, lane);
    ray_hit.hit.geomID = kNoGeometry;
    ray_hit.hit.instID[0] = given.instID[0];
    if (!intersect_one(ray_hit, false)) continue;
    RTCRayN_tfar(rays, args->N, lane) = ray_hit.ray.tfar;
    rtcCopyHitToHitN(hits, &ray_hit.hit, args->N, lane);
  }
}

void InstanceGeometry::occlude_others(const RTCOccludedFunctionNArguments* args) const {
  EmbreeContext& given = given_context(*args);
  if (is_nested(given)) return source_.refuse_nested();
  const auto is_occluded = [&](EmbreeRay& ray) {
    std::optional<RayContext> fallback;
    RayContext& context = context_of(given, ray, fallback);
    if (!has_filters && !given.filter) return occluded(args->primID, ray, context, &context.embree);
    EmbreeRayHit ray_hit;  // filters want to know the hit
    ray_hit.ray = ray;
    ray_hit.hit.geomID = kNoGeometry;
    ray_hit.hit.instID[0] = given.instID[0];
    const Query query{context, &given, args->primID, args->geomID, true, ask_occlusion_filters, args};
    return intersect_filtered(query, ray_hit, nullptr);
  };
  if (args->N == 1) {
    auto& ray = *reinterpret_cast<EmbreeRay*>(args->ray);
    if (args->valid[0] != 0 && is_occluded(ray)) ray.tfar = -kInfinity;
    return;
  }
  for (unsigned lane = 0; lane < args->N; ++lane) {
    if (args->valid[lane] == 0) continue;
    EmbreeRay ray = rtcGetRayFromRayN(args->ray, args->N, lane);
    if (is_occluded(ray)) RTCRayN_tfar(args->ray, args->N, lane) = -kInfinity;
  }
}

const InstanceRecord& InstanceGeometry::move(uint32_t instance, float time,
                                             std::optional<InstanceRecord>& moved) const {
  moved = motions_.at(instance).at(instances[instance], time);
  return *moved;
}

std::optional<InstanceGeometry::Entry> InstanceGeometry::entry_of(uint32_t instance, const EmbreeRay& ray,
                                                                  const RayContext& context) const {
  std::optional<InstanceRecord> moved;
  Visit visit;
  if (is_hidden(instance) || !choose(record_at(instance, ray.time, moved), instance, ray, context, visit))
    return std::nullopt;
  return Entry{visit.t_entry, visit.choice};
}

Box3 InstanceGeometry::bounds_over_time(uint32_t instance) const {
  const TracedAsset& asset = *assets[instances[instance].asset];
  if (!instances[instance].moves) return instance_bounds(instances[instance], asset);
  Box3 bounds;
  const size_t segments = motions_.at(instance).key_count() - 1;
  for (size_t key = 0; key <= segments; ++key) {
    std::optional<InstanceRecord> moved;
    const float time = static_cast<float>(key) / static_cast<float>(segments);
    bounds.extend(instance_bounds(move(instance, time, moved), asset));
  }
  return bounds;
}

/// So many segments of the time between 0 and 1 that every key of every motion lies between two of them.
uint64_t InstanceGeometry::time_segments() const {
  uint64_t segments = 0;
  for (const auto& [of_motion, count] : motions_with_segments_) {
    segments = segments == 0 ? of_motion : std::lcm(segments, of_motion);
    if (segments >= InstanceMotion::kMostKeys) break;  // more never make it fewer
  }
  return segments;
}

std::optional<InstanceMotion> InstanceGeometry::motion(uint32_t instance) const {
  if (!instances[instance].moves) return std::nullopt;
  return motions_.at(instance);
}

void InstanceGeometry::replace_motion(uint32_t instance, std::optional<InstanceMotion> motion) {
  if (const auto former = motions_.find(instance); former != motions_.end()) {
    const auto with_segments = motions_with_segments_.find(former->second.key_count() - 1);
    if (--with_segments->second == 0) motions_with_segments_.erase(with_segments);
    motion_bytes_ -= former->second.bytes();
    motions_.erase(former);
  }
  instances[instance].moves = motion.has_value();
  if (!motion) return;
  ++motions_with_segments_[motion->key_count() - 1];
  motion_bytes_ += motion->bytes();
  motions_.emplace(instance, std::move(*motion));
}

Result<void> InstanceGeometry::set_motion(uint32_t instance, std::optional<InstanceMotion> motion) {
  const size_t keys = motion ? motion->key_count() : 0;
  std::optional<InstanceMotion> former = this->motion(instance);
  replace_motion(instance, std::move(motion));
  if (time_segments() < InstanceMotion::kMostKeys) return {};
  replace_motion(instance, std::move(former));
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("{} keys and those of other motions have no common times that Embree could take; "
                                "2, 3, 5, 9, 17, ... keys always have",
                                keys));
}

void InstanceGeometry::set_hidden(uint32_t instance, bool is_hidden) {
  if (!is_hidden && instance >= hidden.size()) return;
  if (instance >= hidden.size()) hidden.resize(instances.size());
  hidden[instance] = is_hidden;
}

EmbreeGeometry InstanceGeometry::create(EmbreeDeviceRef device) {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
  rtcSetGeometryUserData(geometry.get(), this);
  rtcSetGeometryBoundsFunction(geometry.get(), bounds_callback, nullptr);
  rtcSetGeometryIntersectFunction(geometry.get(), intersect_callback);
  rtcSetGeometryOccludedFunction(geometry.get(), occluded_callback);
  update(geometry.get());
  return geometry;
}

void InstanceGeometry::update(EmbreeGeometryRef geometry) {
  time_segments_ = time_segments();
  set_time_steps(geometry, static_cast<unsigned>(time_segments_ + 1));
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(instances.size()));
  commit_geometry(geometry);
}

}  // namespace farfield
