// SPDX-License-Identifier: Apache-2.0
#include "bvh/instance_geometry.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <limits>
#include <map>
#include <memory>
#include <set>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "base/parallel.h"
#include "tests/support/level_builder.h"
#include "tests/support/optical_depth.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

using test::random_unit;
using test::set_volume;
using test::sphere_level;
using test::triangle_soup;

/// Any affine transform: rotation, shear, non-uniform scale, mirrored every other time.
mat4x3 random_transform(Rng& rng, float far = 3.0f) {
  mat4x3 m;
  do {
    for (int column = 0; column < 3; ++column) m[column] = (0.2f + 2.0f * rng.next()) * random_unit(rng);
  } while (std::abs(glm::determinant(mat3(m))) < 0.05f);
  m[3] = far * random_unit(rng);
  return m;
}

vec3 apply(const mat4x3& m, const vec3& p) { return m * vec4(p, 1.0f); }

/// Assets with all levels in memory, and a host scene over their instances.
class Stage : public LevelSource {
 public:
  Stage() : device_(*BvhDevice::create()), host_device_(*make_embree_device()), geometry_(*this) {}

  uint32_t add_asset(const std::vector<const LevelData*>& levels) {
    auto asset = std::make_unique<TracedAsset>();
    asset->base_resolution = levels[0]->header.resolution;
    asset->loaded = std::make_unique<std::atomic<const TracedLevel*>[]>(levels.size());
    for (const LevelData* level : levels) {
      asset->bounds.extend(level->header.bounds);
      asset->level_numbers.push_back(static_cast<float>(level->header.level));
      asset->usable_slots.push_back(static_cast<uint8_t>(asset->usable_slots.size()));
    }
    asset->bounds = padded_bounds(asset->bounds);
    levels_.emplace_back(levels);
    geometry_.assets.push_back(asset.get());
    assets_.push_back(std::move(asset));
    return static_cast<uint32_t>(assets_.size() - 1);
  }
  uint32_t add_instance(uint32_t asset, const mat4x3& transform) {
    const auto record = make_instance(asset, transform);
    EXPECT_TRUE(record) << record.error().message;
    geometry_.instances.push_back(*record);
    return static_cast<uint32_t>(geometry_.instances.size() - 1);
  }
  /// The host's scene; `plain` adds a triangle mesh of the host's own.
  EmbreeSceneRef scene(EmbreeGeometryRef plain = nullptr) {
    scene_ = new_scene(host_device());
    geom_id = attach_geometry(scene_.get(), geometry_.create(host_device()).get());
    if (plain) attach_geometry(scene_.get(), plain);
    commit_scene(scene_.get());
    return scene_.get();
  }
  EmbreeDeviceRef host_device() { return host_device_.get(); }
  InstanceGeometry& geometry() { return geometry_; }
  TracedAsset& asset(uint32_t i) { return *assets_[i]; }

  const TracedLevel* serve(uint32_t asset, uint32_t slot) override {
    const std::lock_guard lock(mutex_);
    auto& loaded = assets_[asset]->loaded[slot];
    if (const TracedLevel* level = loaded.load()) return level;
    auto level = TracedLevel::build(*device_, view_of(*levels_[asset][slot]), slot);
    EXPECT_TRUE(level);
    ++served;
    loaded.store((*level).get(), std::memory_order_release);
    built_.push_back(std::move(*level));
    return built_.back().get();
  }

  unsigned geom_id = 0;
  int served = 0;

 private:
  std::unique_ptr<BvhDevice> device_;
  EmbreeDevice host_device_;
  InstanceGeometry geometry_;
  EmbreeScene scene_;
  std::vector<std::unique_ptr<TracedAsset>> assets_;
  std::vector<std::vector<const LevelData*>> levels_;
  std::vector<std::unique_ptr<TracedLevel>> built_;
  std::mutex mutex_;
};

/// The same triangles in world space, as a host without Farfield would have them.
EmbreeGeometry flatten(EmbreeDeviceRef device, const LevelData& level, const std::vector<mat4x3>& transforms) {
  std::vector<uvec3> triangles;
  std::vector<vec3> positions;
  for (const mat4x3& m : transforms) {
    const auto base = static_cast<uint32_t>(positions.size());
    for (const vec3& p : level.positions) positions.push_back(apply(m, p));
    for (const Quad& q : level.quads) {
      triangles.emplace_back(base + q.v0, base + q.v1, base + q.v3);
      if (q.is_pair()) triangles.emplace_back(base + q.v2, base + q.v3, base + q.v1);
    }
  }
  EmbreeGeometry geometry = new_triangles(device);
  copy_array<vec3>(geometry.get(), positions);
  copy_array<uvec3>(geometry.get(), triangles);
  commit_geometry(geometry.get());
  return geometry;
}

struct Counts {
  int rays = 0, hits = 0, different = 0, wrong_normal = 0;
};

/// Traces the same rays through instances and through the flattened mesh.
Counts compare_with_flattened(const LevelData& level, int instance_count, uint64_t seed) {
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  Rng rng(seed);
  std::vector<mat4x3> transforms;
  for (int i = 0; i < instance_count; ++i) {
    transforms.push_back(random_transform(rng));
    stage.add_instance(asset, transforms.back());
  }
  const EmbreeSceneRef scene = stage.scene();
  const EmbreeGeometry mesh = flatten(stage.host_device(), level, transforms);
  const EmbreeScene plain = build_static_scene(stage.host_device(), mesh);

  Counts counts;
  for (int i = 0; i < 20000; ++i) {
    const vec3 direction = (0.5f + rng.next()) * random_unit(rng);
    const vec3 origin = 3.0f * random_unit(rng) - 3.0f * direction;
    EmbreeRayHit a = make_ray_hit(origin, direction);
    EmbreeRayHit b = a;
    RayContext context;
    EmbreeContext plain_context = make_context();
    trace_nearest(scene, context.embree, a);
    trace_nearest(plain.get(), plain_context, b);
    EmbreeRay shadow = make_ray(origin, direction);
    trace_occlusion(scene, context.embree, shadow);
    ++counts.rays;
    const bool hit = a.hit.geomID == stage.geom_id;
    EXPECT_EQ(hit, shadow.tfar < 0.0f);
    EXPECT_EQ(a.ray.org_x, origin.x);
    EXPECT_EQ(a.ray.dir_z, direction.z);
    counts.hits += b.hit.geomID != kNoGeometry;
    const bool same = hit == (b.hit.geomID != kNoGeometry) &&
                      (!hit || std::abs(a.ray.tfar - b.ray.tfar) < 1e-4f * (1.0f + b.ray.tfar));
    if (!same) {
      ++counts.different;
      continue;
    }
    if (!hit) continue;
    EXPECT_EQ(a.hit.primID, context.hit.instance);
    EXPECT_LT(a.hit.primID, transforms.size());
    const vec3 na = glm::normalize(vec3(a.hit.Ng_x, a.hit.Ng_y, a.hit.Ng_z));
    const vec3 nb = glm::normalize(vec3(b.hit.Ng_x, b.hit.Ng_y, b.hit.Ng_z));
    counts.wrong_normal += glm::dot(na, nb) < 0.999f;  // same side too, mirrored instances included
  }
  return counts;
}

TEST(InstanceGeometry, HitsWhatTheFlattenedTrianglesHit) {
  const Counts counts = compare_with_flattened(triangle_soup(300, 0.2f, 1), 20, 42);
  EXPECT_GT(counts.hits, 5000);
  EXPECT_LE(counts.different, counts.rays / 1000);    // rays through edges, where rounding decides
  EXPECT_LE(counts.wrong_normal, counts.rays / 500);  // two faces at nearly the same distance; sliver normals
}

TEST(InstanceGeometry, HitsWhatTheFlattenedQuadsHit) {
  const Counts counts = compare_with_flattened(sphere_level(vec3(0.5f), 0.5f, 16), 20, 43);
  EXPECT_GT(counts.hits, 5000);
  EXPECT_LE(counts.different, counts.rays / 1000);
  EXPECT_LE(counts.wrong_normal, counts.rays / 500);
}

TEST(InstanceGeometry, TellsWhichFaceWasHit) {
  LevelData level = test::empty_level(0, 1.0f);
  test::set_quads(level, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2, 3}});
  Stage stage;
  stage.add_instance(stage.add_asset({&level}), mat4x3(1.0f));
  const EmbreeSceneRef scene = stage.scene();
  RayContext context;
  EmbreeRayHit first = make_ray_hit({0.2f, 0.2f, 1}, {0, 0, -1});
  trace_nearest(scene, context.embree, first);
  EXPECT_EQ(context.hit.element, 0u);  // (v0, v1, v3)
  EmbreeRayHit second = make_ray_hit({0.8f, 0.8f, 1}, {0, 0, -1});
  trace_nearest(scene, context.embree, second);
  EXPECT_EQ(context.hit.element, 1u);  // (v2, v3, v1)
  EXPECT_FALSE(context.hit.is_volume);
}

TEST(InstanceGeometry, NearerHostGeometryKeepsItsIds) {
  const LevelData soup = triangle_soup(500, 0.3f, 2);
  Stage stage;
  stage.add_instance(stage.add_asset({&soup}), mat4x3(1.0f));
  // The host's own copy of the same triangles: every distance ties, and either may win, but ids must be consistent.
  const EmbreeGeometry host_mesh = flatten(stage.host_device(), soup, {mat4x3(1.0f)});
  const EmbreeSceneRef scene = stage.scene(host_mesh.get());
  Rng rng(3);
  int host = 0, ours = 0;
  for (int i = 0; i < 5000; ++i) {
    const vec3 direction = random_unit(rng);
    EmbreeRayHit ray = make_ray_hit(vec3(0.5f) - 2.0f * direction + 0.3f * random_unit(rng), direction);
    RayContext context;
    trace_nearest(scene, context.embree, ray);
    if (ray.hit.geomID == kNoGeometry) continue;
    if (ray.hit.geomID == stage.geom_id) {
      ++ours;
      ASSERT_EQ(ray.hit.primID, 0u);
      ASSERT_EQ(context.hit.instance, 0u);
    } else {
      ++host;
      ASSERT_EQ(ray.hit.geomID, 1u);
      ASSERT_LT(ray.hit.primID, soup.quads.size());
    }
  }
  EXPECT_GT(host + ours, 1000);
}

TEST(InstanceGeometry, PacketsAndStreamsSeeTheSameDistancesAsSingleRays) {
  LevelData level = triangle_soup(200, 0.3f, 4);
  level.header.resolution = 0.125f;
  set_volume(level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 1.5f; });
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  Rng rng(5);
  for (int i = 0; i < 10; ++i) stage.add_instance(asset, random_transform(rng));
  const EmbreeSceneRef scene = stage.scene();

  constexpr unsigned kRays = 512;
  std::vector<EmbreeRayHit> single, rays;
  for (unsigned i = 0; i < kRays; ++i) {
    const vec3 direction = random_unit(rng);
    rays.push_back(make_ray_hit(2.0f * random_unit(rng) - 4.0f * direction, direction));
    rays.back().ray.id = i;
  }
  RayContext context;
  context.ray_seed = 77;
  single = rays;
  int hits = 0;
  for (EmbreeRayHit& ray : single) {
    trace_nearest(scene, context.embree, ray);
    hits += ray.hit.geomID == stage.geom_id;
  }
  EXPECT_GT(hits, 100);

  const auto expect_same = [&](const EmbreeRayHit& ray, unsigned i, const char* what) {
    EXPECT_EQ(ray.hit.geomID, single[i].hit.geomID) << what << " " << i;
    EXPECT_EQ(ray.ray.tfar, single[i].ray.tfar) << what << " " << i;
    if (ray.hit.geomID != kNoGeometry) {
      EXPECT_EQ(ray.hit.primID, single[i].hit.primID) << what << " " << i;
    }
  };
  // Embree 3.13 traces packets that are wider than the machine's registers ray by ray, inactive lanes too.
  const auto packets = [&]<typename RayHitN>(RayHitN, unsigned n, auto trace, const char* what,
                                             RTCDeviceProperty native) {
    const bool is_native = rtcGetDeviceProperty(device_of(scene).get(), native) != 0;
    for (unsigned base = 0; base < kRays; base += n) {
      RayHitN packet;
      alignas(64) int valid[16];
      for (unsigned lane = 0; lane < n; ++lane) {
        valid[lane] = lane % 3 == 1 ? 0 : -1;
        rtcCopyHitToHitN(reinterpret_cast<RTCHitN*>(&packet.hit), &rays[base + lane].hit, n, lane);
        const EmbreeRay& r = rays[base + lane].ray;
        auto* p = reinterpret_cast<RTCRayN*>(&packet.ray);
        RTCRayN_org_x(p, n, lane) = r.org_x, RTCRayN_org_y(p, n, lane) = r.org_y, RTCRayN_org_z(p, n, lane) = r.org_z;
        RTCRayN_dir_x(p, n, lane) = r.dir_x, RTCRayN_dir_y(p, n, lane) = r.dir_y, RTCRayN_dir_z(p, n, lane) = r.dir_z;
        RTCRayN_tnear(p, n, lane) = r.tnear, RTCRayN_tfar(p, n, lane) = r.tfar, RTCRayN_time(p, n, lane) = 0.0f;
        RTCRayN_mask(p, n, lane) = r.mask, RTCRayN_id(p, n, lane) = r.id, RTCRayN_flags(p, n, lane) = 0;
      }
      trace(valid, &packet);
      for (unsigned lane = 0; lane < n; ++lane) {
        EmbreeRayHit got = rays[base + lane];
        if (valid[lane]) {
          got.ray.tfar = RTCRayN_tfar(reinterpret_cast<RTCRayN*>(&packet.ray), n, lane);
          got.hit = rtcGetHitFromHitN(reinterpret_cast<RTCHitN*>(&packet.hit), n, lane);
          expect_same(got, base + lane, what);
        } else if (is_native) {
          EXPECT_EQ(RTCRayN_tfar(reinterpret_cast<RTCRayN*>(&packet.ray), n, lane), kInfinity) << what;
        }
      }
    }
  };
  packets(
      RTCRayHit4{}, 4, [&](int* v, RTCRayHit4* p) { rtcIntersect4(v, scene, &context.embree, p); }, "4",
      RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED);
  packets(
      RTCRayHit8{}, 8, [&](int* v, RTCRayHit8* p) { rtcIntersect8(v, scene, &context.embree, p); }, "8",
      RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED);
  packets(
      RTCRayHit16{}, 16, [&](int* v, RTCRayHit16* p) { rtcIntersect16(v, scene, &context.embree, p); }, "16",
      RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED);

  for (const bool is_coherent : {false, true}) {
    context.set_coherent(is_coherent);
    std::vector<EmbreeRayHit> stream = rays;
    rtcIntersect1M(scene, &context.embree, stream.data(), kRays, sizeof(EmbreeRayHit));
    for (unsigned i = 0; i < kRays; ++i) expect_same(stream[i], i, "1M");
    std::vector<EmbreeRay> shadows;
    for (const EmbreeRayHit& ray : rays) shadows.push_back(ray.ray);
    rtcOccluded1M(scene, &context.embree, shadows.data(), kRays, sizeof(EmbreeRay));
    for (unsigned i = 0; i < kRays; ++i) {
      EXPECT_EQ(shadows[i].tfar < 0.0f, single[i].hit.geomID != kNoGeometry) << i;
    }
  }
}

/// Surfaces and volumes in several instances, and rays through them.
struct Crowd {
  static constexpr unsigned kInstances = 6;
  LevelData level = test::white_sphere()[2];
  Stage stage;
  std::vector<EmbreeRayHit> rays;

  Crowd() {
    const uint32_t asset = stage.add_asset({&level});
    Rng rng(9);
    for (unsigned i = 0; i < kInstances; ++i) {
      mat4x3 place(1.0f);
      place[3] = 1.5f * random_unit(rng);
      stage.add_instance(asset, place);
    }
    for (unsigned i = 0; i < 256; ++i) {
      const vec3 origin = 6.0f * random_unit(rng);
      rays.push_back(make_ray_hit(origin, glm::normalize(2.0f * random_unit(rng) - origin)));
      rays.back().ray.id = i;
    }
  }
};

/// The i-th ray's: it has other random numbers than the others.
RayContext context_of(unsigned i) {
  RayContext context;
  context.cone_spread = 1e-3f;
  context.ray_seed = 1000 + i;
  return context;
}

TEST(InstanceGeometry, RaysOfPacketsAndStreamsHaveTheirOwnContextsAndRecords) {
  Crowd crowd;
  const EmbreeSceneRef scene = crowd.stage.scene();
  std::vector<EmbreeRayHit> single = crowd.rays, stream = crowd.rays;
  std::vector<RayContext> alone, together;
  unsigned hits = 0;
  for (unsigned i = 0; i < single.size(); ++i) {
    alone.push_back(context_of(i)), together.push_back(context_of(i));
    hits += trace_nearest(scene, alone[i].embree, single[i]);
  }
  ASSERT_GT(hits, 50u);
  RayContexts contexts(together.data(), static_cast<uint32_t>(together.size()));
  const auto expect_same_records = [&] {
    for (unsigned i = 0; i < single.size(); ++i) {
      ASSERT_EQ(stream[i].hit.geomID, single[i].hit.geomID) << i;
      if (single[i].hit.geomID == kNoGeometry) continue;
      EXPECT_EQ(stream[i].ray.tfar, single[i].ray.tfar);
      EXPECT_EQ(together[i].hit.instance, alone[i].hit.instance);
      EXPECT_EQ(together[i].hit.element, alone[i].hit.element);
      EXPECT_EQ(together[i].hit.is_volume, alone[i].hit.is_volume);
      EXPECT_EQ(together[i].hit.footprint, alone[i].hit.footprint);
    }
  };
  for (const bool is_coherent : {false, true}) {
    contexts.set_coherent(is_coherent);
    stream = crowd.rays;
    for (unsigned i = 0; i < together.size(); ++i) together[i] = context_of(i);
    rtcIntersect1M(scene, &contexts.embree, stream.data(), static_cast<unsigned>(stream.size()), sizeof(EmbreeRayHit));
    expect_same_records();
  }

  stream = crowd.rays;  // the same as packets of 4
  for (unsigned i = 0; i < together.size(); ++i) together[i] = context_of(i);
  for (unsigned base = 0; base < stream.size(); base += 4) {
    alignas(16) const int valid[4] = {-1, -1, -1, -1};
    RTCRayHit4 packet;
    auto* rays = reinterpret_cast<RTCRayN*>(&packet.ray);
    auto* found = reinterpret_cast<RTCHitN*>(&packet.hit);
    for (unsigned lane = 0; lane < 4; ++lane) {
      const EmbreeRay& r = stream[base + lane].ray;
      rtcCopyHitToHitN(found, &stream[base + lane].hit, 4, lane);
      RTCRayN_org_x(rays, 4, lane) = r.org_x, RTCRayN_org_y(rays, 4, lane) = r.org_y;
      RTCRayN_org_z(rays, 4, lane) = r.org_z, RTCRayN_dir_x(rays, 4, lane) = r.dir_x;
      RTCRayN_dir_y(rays, 4, lane) = r.dir_y, RTCRayN_dir_z(rays, 4, lane) = r.dir_z;
      RTCRayN_tnear(rays, 4, lane) = r.tnear, RTCRayN_tfar(rays, 4, lane) = r.tfar, RTCRayN_time(rays, 4, lane) = 0;
      RTCRayN_mask(rays, 4, lane) = r.mask, RTCRayN_id(rays, 4, lane) = r.id, RTCRayN_flags(rays, 4, lane) = 0;
    }
    rtcIntersect4(valid, scene, &contexts.embree, &packet);
    for (unsigned lane = 0; lane < 4; ++lane) {
      stream[base + lane].ray.tfar = RTCRayN_tfar(rays, 4, lane);
      stream[base + lane].hit = rtcGetHitFromHitN(found, 4, lane);
    }
  }
  expect_same_records();
}

TEST(InstanceGeometry, AQueryWithoutARayContextIsAnsweredAlikeEachTime) {
  Crowd crowd;
  const EmbreeSceneRef scene = crowd.stage.scene();
  unsigned hits = 0;
  std::set<float> distances;
  for (EmbreeRayHit& ray : crowd.rays) {
    EmbreeContext context = make_context();
    EmbreeRayHit again = ray;
    EmbreeRay shadow = ray.ray;
    const bool is_hit = trace_nearest(scene, context, ray);
    EXPECT_EQ(trace_nearest(scene, context, again), is_hit);
    EXPECT_EQ(again.ray.tfar, ray.ray.tfar);
    EXPECT_EQ(trace_occlusion(scene, context, shadow), is_hit);
    if (!is_hit) continue;
    ++hits;
    EXPECT_EQ(ray.hit.geomID, crowd.stage.geom_id);
    EXPECT_LT(ray.hit.primID, Crowd::kInstances);
    distances.insert(ray.ray.tfar);
  }
  EXPECT_GT(hits, 50u);
  EXPECT_GT(distances.size(), hits / 2);
}

/// A host's filter that lets rays pass all instances but one, and counts what it is asked.
struct OnlyInstance {
  RayContext context;  // first: the filter finds the rest by it
  unsigned wanted = 0;
  unsigned geometry = 0;
  int asked = 0;
  bool is_sane = true;

  static void filter(const RTCFilterFunctionNArguments* args) {
    auto& self = *reinterpret_cast<OnlyInstance*>(args->context);
    ++self.asked;
    const unsigned instance = RTCHitN_primID(args->hit, args->N, 0);
    self.is_sane = self.is_sane && args->N == 1 && instance < Crowd::kInstances &&
                   RTCHitN_geomID(args->hit, 1, 0) == self.geometry && RTCRayN_tfar(args->ray, 1, 0) > 0.0f;
    if (instance != self.wanted) args->valid[0] = 0;
  }
};

TEST(InstanceGeometry, FiltersOfTheHostAreAskedAboutHitsAndRaysPassWhatTheyRefuse) {
  for (const bool in_context : {true, false}) {
    Crowd crowd;
    crowd.stage.geometry().has_filters = !in_context;
    const EmbreeSceneRef scene = crowd.stage.scene();
    if (!in_context) {
      const RTCGeometry geometry = rtcGetGeometry(scene, crowd.stage.geom_id);
      rtcSetGeometryIntersectFilterFunction(geometry, OnlyInstance::filter);
      rtcSetGeometryOccludedFilterFunction(geometry, OnlyInstance::filter);
      rtcCommitGeometry(geometry);
      rtcCommitScene(scene);
    }
    int asked = 0, hits = 0, refused = 0;
    for (unsigned i = 0; i < crowd.rays.size(); ++i) {
      for (unsigned wanted = 0; wanted < Crowd::kInstances; ++wanted) {
        OnlyInstance filter;
        filter.context = context_of(i);
        filter.wanted = wanted, filter.geometry = crowd.stage.geom_id;
        if (in_context) filter.context.embree.filter = OnlyInstance::filter;
        EmbreeRayHit ray = crowd.rays[i];
        EmbreeRay shadow = ray.ray;
        const bool is_hit = trace_nearest(scene, filter.context.embree, ray);
        hits += is_hit, asked += filter.asked, refused += !is_hit && filter.asked > 0;
        EXPECT_TRUE(filter.is_sane);
        EXPECT_EQ(ray.ray.tnear, 0.0f);
        EXPECT_TRUE(!is_hit || (ray.hit.primID == wanted && filter.context.hit.instance == wanted));
        EXPECT_EQ(trace_occlusion(scene, filter.context.embree, shadow), is_hit);
      }
    }
    EXPECT_GT(hits, 50) << in_context;
    EXPECT_GT(asked, hits) << in_context;
    EXPECT_GT(refused, 50) << in_context;
  }
}

// Embree may find the surface that was refused once more, an ulp in front of where the ray goes on.
TEST(InstanceGeometry, RaysEndHoweverOftenTheHostRefuses) {
  Stage stage;
  const LevelData soup = test::triangle_soup(50, 0.5f, 1);
  stage.add_instance(stage.add_asset({&soup}), mat4x3(glm::mat4(1.0f)));
  const EmbreeSceneRef scene = stage.scene();
  Rng rng(8);
  int asked = 0;
  for (uint32_t i = 0; i < 20'000; ++i) {
    OnlyInstance filter;
    filter.context = context_of(i);
    filter.context.embree.filter = OnlyInstance::filter;
    filter.wanted = Crowd::kInstances, filter.geometry = stage.geom_id;
    const vec3 origin(rng.next(), rng.next(), rng.next());
    EmbreeRayHit ray = make_ray_hit(origin, random_unit(rng), 0, std::numeric_limits<float>::infinity());
    EXPECT_FALSE(trace_nearest(scene, filter.context.embree, ray));
    EXPECT_LT(filter.asked, 100);  // 50 faces, few of them twice
    asked += filter.asked;
  }
  EXPECT_GT(asked, 5'000);
}

TEST(InstanceGeometry, VolumesKeepTheirTransmittanceUnderAnyAffineTransform) {
  LevelData level = test::empty_level(0, 0.125f);
  const SymMat3 s = SymMat3::outer(glm::normalize(vec3(1, 2, 3))) + SymMat3::identity() * 0.05f;
  set_volume(
      level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 2.5f; }, [&](int, int, int) { return s; });
  Rng rng(6);
  for (int i = 0; i < 12; ++i) {
    Stage stage;
    const mat4x3 transform = random_transform(rng);
    stage.add_instance(stage.add_asset({&level}), transform);
    const EmbreeSceneRef scene = stage.scene();
    const vec3 from_local = vec3(0.5f) + 2.0f * random_unit(rng);
    const vec3 to_local = vec3(0.5f) + 0.3f * random_unit(rng);
    const vec3 origin = apply(transform, from_local);
    const vec3 direction = glm::normalize(apply(transform, to_local) - origin);  // unit in the world, as hosts trace
    const double depth = test::optical_depth(level, from_local, 4.0f * (to_local - from_local), 1.0);

    constexpr int kRays = 20000;
    int passed = 0;
    for (uint32_t seed = 0; seed < kRays; ++seed) {
      RayContext context;
      context.ray_seed = seed;
      EmbreeRayHit ray = make_ray_hit(origin, direction);
      trace_nearest(scene, context.embree, ray);
      const bool hit = ray.hit.geomID == stage.geom_id;
      passed += !hit;
      EmbreeRay shadow = make_ray(origin, direction);
      trace_occlusion(scene, context.embree, shadow);
      ASSERT_EQ(hit, shadow.tfar < 0.0f);  // the same seed gives the same answer
      if (hit) {
        ASSERT_TRUE(context.hit.is_volume);
        ASSERT_LT(context.hit.element, voxel_count(level));
      }
    }
    const double expected = std::exp(-depth);
    RayContext measuring;
    measuring.transmittance = 0.5f;
    EmbreeRay through = make_ray(origin, direction);
    EXPECT_FALSE(trace_occlusion(scene, measuring.embree, through));
    EXPECT_NEAR(measuring.transmittance, 0.5 * expected, 1e-3 * expected) << i;
    EXPECT_NEAR(passed / double(kRays), expected, 4.5 * std::sqrt(expected * (1 - expected) / kRays)) << i;
  }
}

TEST(InstanceGeometry, TheNearestOfSurfaceAndVolumeWins) {
  LevelData level = sphere_level(vec3(0.5f), 0.25f, 12);
  level.header.resolution = 0.125f;
  set_volume(level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 2.0f; });
  Stage stage;
  stage.add_instance(stage.add_asset({&level}), mat4x3(1.0f));
  const EmbreeSceneRef scene = stage.scene();
  int surface = 0;
  constexpr int kRays = 20000;
  for (uint32_t seed = 0; seed < kRays; ++seed) {
    RayContext context;
    context.ray_seed = seed;
    EmbreeRayHit ray = make_ray_hit({-1.0f, 0.51f, 0.52f}, {1, 0, 0});
    trace_nearest(scene, context.embree, ray);
    ASSERT_EQ(ray.hit.geomID, stage.geom_id);  // the sphere stops what the volume lets through
    surface += !context.hit.is_volume;
    if (context.hit.is_volume) {
      ASSERT_LT(ray.ray.tfar, 1.26f);
      ASSERT_EQ(ray.hit.Ng_x, 0.0f);
    } else {
      ASSERT_NEAR(ray.ray.tfar, 1.253f, 0.005f);
    }
  }
  const double expected = std::exp(-2.0 * 0.253);
  EXPECT_NEAR(surface / double(kRays), expected, 0.02);
}

TEST(InstanceGeometry, InstancesOfOneAssetHaveIndependentFreeFlights) {
  LevelData level = test::empty_level(0, 0.125f);
  set_volume(level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 0.7f; });
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  for (int i = 0; i < 3; ++i) {
    mat4x3 m(1.0f);
    m[3] = vec3(2.0f * static_cast<float>(i), 0, 0);
    stage.add_instance(asset, m);
  }
  const EmbreeSceneRef scene = stage.scene();
  int passed = 0;
  constexpr int kRays = 40000;
  for (uint32_t seed = 0; seed < kRays; ++seed) {
    RayContext context;
    context.ray_seed = seed;
    EmbreeRayHit ray = make_ray_hit({-1.0f, 0.51f, 0.52f}, {1, 0, 0});
    trace_nearest(scene, context.embree, ray);
    passed += ray.hit.geomID == kNoGeometry;
  }
  const double expected = std::exp(-2.1);
  EXPECT_NEAR(passed / double(kRays), expected, 4.5 * std::sqrt(expected * (1 - expected) / kRays));
}

TEST(InstanceGeometry, AllInstancesShareLoadedLevelsAndThreadsAgree) {
  const LevelData fine = triangle_soup(2000, 0.1f, 7);
  LevelData coarse = triangle_soup(100, 0.4f, 8);
  coarse.header.level = 1;
  std::vector<std::vector<float>> results;
  for (const int threads : {1, 0}) {
    Stage stage;
    const uint32_t asset = stage.add_asset({&fine, &coarse});
    Rng rng(9);
    for (int i = 0; i < 50; ++i) stage.add_instance(asset, random_transform(rng));
    stage.geometry().forced_lambda = 0.5f;
    const EmbreeSceneRef scene = stage.scene();
    std::vector<float> t(20000);
    const ThreadLimit limit(threads);
    parallel_for(t.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        Rng ray_rng(i);
        const vec3 direction = random_unit(ray_rng);
        EmbreeRayHit ray = make_ray_hit(4.0f * random_unit(ray_rng) - 4.0f * direction, direction);
        RayContext context;
        context.path_seed = static_cast<uint32_t>(i);
        trace_nearest(scene, context.embree, ray);
        t[i] = ray.ray.tfar;
      }
    });
    EXPECT_EQ(stage.served, 2);
    results.push_back(t);
  }
  EXPECT_EQ(results[0], results[1]);
}

// --- Motion ----------------------------------------------------------------------------------------------------------

/// The transforms of an instance that turns and drifts.
std::vector<mat4x3> random_motion(Rng& rng, size_t keys) {
  const mat4x3 start = random_transform(rng);
  const vec3 way = random_unit(rng), axis = random_unit(rng);
  std::vector<mat4x3> motion;
  for (size_t i = 0; i < keys; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(keys - 1);
    const mat3 turn(glm::rotate(glm::mat4(1.0f), 2.0f * t, axis));
    motion.emplace_back(turn * start[0], turn * start[1], turn * start[2], start[3] + (t * t) * way);
  }
  return motion;
}

/// The level's triangles in world space as Embree moves them: as many time steps as the motions' common times.
EmbreeGeometry flatten_in_motion(EmbreeDeviceRef device, const LevelData& level,
                                 const std::vector<std::vector<mat4x3>>& motions, size_t steps) {
  EmbreeGeometry geometry = new_triangles(device);
  set_time_steps(geometry.get(), static_cast<unsigned>(steps));
  std::vector<uvec3> triangles;
  for (size_t step = 0; step < steps; ++step) {
    std::vector<vec3> positions;
    for (const std::vector<mat4x3>& keys : motions) {
      const double place = static_cast<double>(step * (keys.size() - 1)) / static_cast<double>(steps - 1);
      const size_t key = std::min(static_cast<size_t>(place), keys.size() - 1);
      const auto t = static_cast<float>(place - static_cast<double>(key));
      const auto base = static_cast<uint32_t>(positions.size());
      for (const vec3& p : level.positions) {
        const vec3 a = apply(keys[key], p);
        positions.push_back(t > 0.0f ? glm::mix(a, apply(keys[key + 1], p), t) : a);
      }
      if (step > 0) continue;
      for (const Quad& q : level.quads) {
        triangles.emplace_back(base + q.v0, base + q.v1, base + q.v3);
        if (q.is_pair()) triangles.emplace_back(base + q.v2, base + q.v3, base + q.v1);
      }
    }
    copy_array<vec3>(geometry.get(), positions, static_cast<unsigned>(step));
  }
  copy_array<uvec3>(geometry.get(), triangles);
  commit_geometry(geometry.get());
  return geometry;
}

TEST(InstanceGeometry, MovesAsEmbreesOwnTrianglesDo) {
  const LevelData level = triangle_soup(300, 0.2f, 1);
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  Rng rng(21);
  std::vector<std::vector<mat4x3>> motions;
  for (const size_t keys : {2, 3, 4, 5, 7, 2, 4}) {  // 12 segments together
    motions.push_back(random_motion(rng, keys));
    const uint32_t id = stage.add_instance(asset, motions.back().front());
    ASSERT_TRUE(stage.geometry().set_motion(id, *InstanceMotion::make(motions.back())));
  }
  motions.push_back({random_transform(rng)});  // and one that stands still
  motions.back().push_back(motions.back().front());
  stage.add_instance(asset, motions.back().front());
  const EmbreeSceneRef scene = stage.scene();
  const EmbreeGeometry mesh = flatten_in_motion(stage.host_device(), level, motions, 13);
  const EmbreeScene plain = build_static_scene(stage.host_device(), mesh);

  int hits = 0, different = 0, wrong_normal = 0;
  constexpr int kRays = 20000;
  for (int i = 0; i < kRays; ++i) {
    const vec3 direction = random_unit(rng);
    const vec3 origin = 3.0f * random_unit(rng) - 3.0f * direction;
    EmbreeRayHit a = make_ray_hit(origin, direction);
    a.ray.time = i % 100 == 0 ? static_cast<float>(i / 100 % 2) : rng.next();
    EmbreeRayHit b = a;
    RayContext context;
    EmbreeContext plain_context = make_context();
    EmbreeRay shadow = a.ray;
    const bool is_hit = trace_nearest(scene, context.embree, a);
    const bool is_plain_hit = trace_nearest(plain.get(), plain_context, b);
    trace_occlusion(scene, context.embree, shadow);
    EXPECT_EQ(is_hit, shadow.tfar < 0.0f);
    hits += is_plain_hit;
    if (is_hit != is_plain_hit || (is_hit && std::abs(a.ray.tfar - b.ray.tfar) > 1e-4f * (1.0f + b.ray.tfar))) {
      ++different;
    } else if (is_hit) {
      const vec3 na = glm::normalize(vec3(a.hit.Ng_x, a.hit.Ng_y, a.hit.Ng_z));
      const vec3 nb = glm::normalize(vec3(b.hit.Ng_x, b.hit.Ng_y, b.hit.Ng_z));
      wrong_normal += glm::dot(na, nb) < 0.999f;
    }
  }
  EXPECT_GT(hits, kRays / 10);
  EXPECT_LT(different, hits / 500);  // rays that graze an edge
  EXPECT_LT(wrong_normal, hits / 500);
}

TEST(InstanceGeometry, MotionsShareTimesOrAreRefused) {
  const LevelData level = triangle_soup(10, 0.2f, 1);
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  InstanceGeometry& geometry = stage.geometry();
  for (int i = 0; i < 3; ++i) stage.add_instance(asset, mat4x3(1.0f));
  const auto still = [](size_t keys) { return *InstanceMotion::make(std::vector<mat4x3>(keys, mat4x3(1.0f))); };
  EXPECT_EQ(geometry.motion_bytes(), 0u);
  ASSERT_TRUE(geometry.set_motion(0, still(129)));
  ASSERT_TRUE(geometry.set_motion(1, still(65)));
  const uint64_t bytes = geometry.motion_bytes();
  EXPECT_GE(bytes, (129 + 65) * sizeof(mat4x3));
  EXPECT_FALSE(geometry.set_motion(1, still(4)));  // 384 segments
  EXPECT_EQ(geometry.motion_bytes(), bytes);
  EXPECT_EQ(geometry.motion(1)->key_count(), 65u);
  ASSERT_TRUE(geometry.set_motion(0, std::nullopt));
  EXPECT_FALSE(geometry.motion(0));
  EXPECT_FALSE(geometry.set_motion(2, still(4)));  // 192
  ASSERT_TRUE(geometry.set_motion(1, still(9)));
  EXPECT_TRUE(geometry.set_motion(2, still(4)));  // 24
  ASSERT_TRUE(geometry.set_motion(1, std::nullopt));
  ASSERT_TRUE(geometry.set_motion(2, std::nullopt));
  EXPECT_EQ(geometry.motion_bytes(), 0u);
}

TEST(InstanceGeometry, BoundsContainEveryHitUnderExtremeTransforms) {
  const LevelData soup = triangle_soup(50, 0.3f, 10);
  TracedAsset asset;
  asset.bounds = soup.header.bounds;
  TracedAsset with_hull;
  with_hull.bounds = asset.bounds;
  with_hull.hull = soup.positions;
  Rng rng(11);
  for (int i = 0; i < 300; ++i) {
    mat4x3 m = random_transform(rng, std::pow(10.0f, 7.0f * rng.next()));
    if (i % 3 == 0) {
      const float scale = std::pow(10.0f, 12.0f * rng.next() - 6.0f);
      for (int column = 0; column < 3; ++column) m[column] *= scale;
    }
    const auto record = make_instance(0, m);
    ASSERT_TRUE(record);
    for (const TracedAsset* a : {&asset, &with_hull}) {
      const Box3 bounds = instance_bounds(*record, *a);
      ASSERT_TRUE(is_finite(bounds.lower) && is_finite(bounds.upper));
      for (const vec3& p : soup.positions) {
        const vec3 q = apply(m, p);
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_LE(bounds.lower[axis], q[axis]);
          ASSERT_GE(bounds.upper[axis], q[axis]);
        }
      }
    }
    // The hull gives bounds at least as tight.
    const vec3 difference = instance_bounds(*record, asset).size() - instance_bounds(*record, with_hull).size();
    EXPECT_GE(min_component(difference), -1e-3f * max_component(instance_bounds(*record, asset).size()));
  }
}

TEST(InstanceGeometry, RefusesTransformsThatCannotBeInverted) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  mat4x3 flat(1.0f);
  flat[1] = vec3(0.0f);
  mat4x3 dependent(1.0f);
  dependent[1] = 2.0f * dependent[0];
  mat4x3 with_nan(1.0f);
  with_nan[3].y = nan;
  mat4x3 with_infinity(1.0f);
  with_infinity[0].x = kInfinity;
  mat4x3 tiny(1.0f);
  for (int column = 0; column < 3; ++column) tiny[column] *= 1e-39f;
  for (const mat4x3& m : {flat, dependent, with_nan, with_infinity, tiny, mat4x3(0.0f)}) {
    const auto record = make_instance(0, m);
    ASSERT_FALSE(record);
    EXPECT_EQ(record.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(InstanceGeometry, LargestStretchIsTheLongestImageOfAUnitVector) {
  Rng rng(12);
  for (int i = 0; i < 50; ++i) {
    const mat4x3 m = random_transform(rng);
    float longest = 0.0f;
    for (int k = 0; k < 20000; ++k) longest = std::max(longest, glm::length(mat3(m) * random_unit(rng)));
    EXPECT_LE(longest, largest_stretch(m) * 1.00001f);
    EXPECT_GE(longest, largest_stretch(m) * 0.995f);
  }
  EXPECT_FLOAT_EQ(largest_stretch(mat4x3(1.0f)), 1.0f);
  EXPECT_FLOAT_EQ(largest_stretch(mat4x3(3e20f)), 3e20f);
}

TEST(InstanceGeometry, RaysWithoutADirectionOrThatLeaveEmbreesRangeMeetNothing) {
  LevelData level = sphere_level(vec3(0.5f), 0.25f, 12);
  level.header.resolution = 0.125f;
  set_volume(level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 2.0f; });
  Stage stage;
  const uint32_t asset = stage.add_asset({&level});
  stage.add_instance(asset, mat4x3(1.0f));
  mat4x3 speck(1e-15f);  // makes 1e18 of a length of 1000, and worse behind it
  stage.add_instance(asset, speck);
  const EmbreeSceneRef scene = stage.scene();
  Rng rng(14);
  for (int i = 0; i < 2000; ++i) {
    RayContext context;
    context.ray_seed = static_cast<uint32_t>(i);
    const vec3 direction = i == 0 ? vec3(0.0f) : std::pow(10.0f, 8.0f * rng.next()) * random_unit(rng);
    EmbreeRayHit ray = make_ray_hit((i % 2 ? -1.0f : -1e4f) * direction, direction);
    trace_nearest(scene, context.embree, ray);  // towards the origin, where the speck is
    EXPECT_FALSE(std::isnan(ray.ray.tfar));
    EmbreeRay shadow = make_ray(-direction, direction);
    trace_occlusion(scene, context.embree, shadow);
    EXPECT_FALSE(std::isnan(shadow.tfar));
  }
}

TEST(InstanceGeometry, FarAwayInstancesAreHitWithinTheRoundingOfTheirPlace) {
  const LevelData sphere = sphere_level(vec3(0.0f), 1.0f, 32);
  Stage stage;
  const uint32_t asset = stage.add_asset({&sphere});
  mat4x3 m(1000.0f);
  m[3] = vec3(1e7f, -1e7f, 1e7f);
  stage.add_instance(asset, m);
  const EmbreeSceneRef scene = stage.scene();
  Rng rng(13);
  for (int i = 0; i < 2000; ++i) {
    const vec3 direction = random_unit(rng);
    EmbreeRayHit ray = make_ray_hit(m[3] - 3000.0f * direction, direction);
    RayContext context;
    trace_nearest(scene, context.embree, ray);
    ASSERT_EQ(ray.hit.geomID, stage.geom_id);
    ASSERT_NEAR(ray.ray.tfar, 2000.0f, 25.0f);  // facets of 1000 (1 - cos(pi/64)) = 1.2, ulp of 1e7 = 1
  }
}

}  // namespace
}  // namespace farfield
