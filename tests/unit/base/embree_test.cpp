// SPDX-License-Identifier: Apache-2.0
#include "base/embree.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace farfield {
namespace {

/// Two unit squares that face each other along z, at 0 and 1.
struct Squares {
  std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  std::vector<uvec3> triangles = {{0, 1, 3}, {2, 3, 1}, {4, 5, 7}, {6, 7, 5}};
  std::vector<uvec4> quads = {{0, 1, 2, 3}, {4, 5, 6, 7}};
};

class Embree : public testing::Test {
 protected:
  Embree() : device_(*make_embree_device()) {}
  void TearDown() override {
    const auto result = check_embree(device_.get(), "pass");
    EXPECT_TRUE(result) << result.error().message;
  }

  EmbreeScene build(const EmbreeGeometry& geometry) { return build_static_scene(device_.get(), geometry); }
  EmbreeGeometry copied_triangles(const Squares& squares) {
    EmbreeGeometry geometry = new_triangles(device_.get());
    copy_array<vec3>(geometry.get(), squares.positions);
    copy_array<uvec3>(geometry.get(), squares.triangles);
    return geometry;
  }

  EmbreeDevice device_;
};

/// Along z through a point of both squares, from outside, from between them, and past them.
void expect_squares(EmbreeSceneRef scene, unsigned first, unsigned second) {
  EmbreeContext context = make_context();
  const auto hit = [&](EmbreeRayHit ray, float distance, unsigned primitive) {
    EmbreeRay shadow = ray.ray;
    EXPECT_TRUE(trace_occlusion(scene, context, shadow));
    ASSERT_TRUE(trace_nearest(scene, context, ray));
    EXPECT_EQ(ray.hit.geomID, 0u);
    EXPECT_EQ(ray.hit.primID, primitive);
    EXPECT_FLOAT_EQ(ray.ray.tfar, distance);
  };
  const auto missed = [&](EmbreeRayHit ray) {
    EmbreeRay shadow = ray.ray;
    EXPECT_FALSE(trace_occlusion(scene, context, shadow));
    EXPECT_FALSE(trace_nearest(scene, context, ray));
    EXPECT_EQ(ray.hit.geomID, kNoGeometry);
  };
  const vec3 up(0, 0, 1);
  hit(make_ray_hit({0.2f, 0.3f, -2}, up), 2, first);
  hit(make_ray_hit({0.2f, 0.3f, -2}, up, 2.5f), 3, second);
  hit(make_ray_hit({0.2f, 0.3f, 0.5f}, up), 0.5f, second);
  missed(make_ray_hit({0.2f, 0.3f, -2}, up, 0, 1.5f));
  missed(make_ray_hit({1.2f, 0.3f, -2}, up));
}

TEST_F(Embree, TracesTriangles) {
  EmbreeScene scene;
  {  // copies: the arrays and the geometry's handle may go
    const Squares squares;
    scene = build(copied_triangles(squares));
  }
  expect_squares(scene.get(), 0, 2);
}

TEST_F(Embree, TracesQuads) {
  Squares squares;
  squares.positions.emplace_back(0.0f);  // room behind the last one
  const EmbreeGeometry geometry = new_quads(device_.get());
  share_array(geometry.get(), std::span<const vec3>(squares.positions).first(8));
  share_array<uvec4>(geometry.get(), squares.quads);
  expect_squares(build(geometry).get(), 0, 1);
}

TEST_F(Embree, AMissLeavesTheRestOfTheHit) {
  const EmbreeScene scene = build(copied_triangles({}));
  EmbreeContext context = make_context();
  EmbreeRayHit ray = make_ray_hit({5, 5, 5}, {0, 0, 1});
  ray.hit.primID = 7;
  ray.hit.instID[0] = 3;
  EXPECT_FALSE(trace_nearest(scene.get(), context, ray));
  EXPECT_EQ(ray.hit.primID, 7u);
  EXPECT_EQ(ray.hit.instID[0], 3u);
}

TEST_F(Embree, AttachedGeometryGoesWhenDetached) {
  const EmbreeScene scene = new_scene(device_.get());
  const EmbreeGeometry geometry = copied_triangles({});
  commit_geometry(geometry.get());
  EXPECT_EQ(attach_geometry(scene.get(), geometry.get()), 0u);
  EXPECT_EQ(attach_geometry(scene.get(), geometry.get()), 1u);
  commit_scene(scene.get());
  EmbreeContext context = make_context();
  EmbreeRay ray = make_ray({0.2f, 0.3f, -2}, {0, 0, 1});
  EXPECT_TRUE(trace_occlusion(scene.get(), context, ray));
  detach_geometry(scene.get(), 0);
  detach_geometry(scene.get(), 1);
  commit_scene(scene.get());
  ray = make_ray({0.2f, 0.3f, -2}, {0, 0, 1});
  EXPECT_FALSE(trace_occlusion(scene.get(), context, ray));
}

TEST_F(Embree, OwnersShareWhatTheyRetain) {
  EmbreeScene scene = build(copied_triangles({}));
  const EmbreeScene second = retain(scene.get());
  const EmbreeDevice device = device_of(scene.get());
  EXPECT_EQ(device, device_);
  EXPECT_EQ(retain(device.get()), device_);
  scene.reset();
  expect_squares(second.get(), 0, 2);
}

TEST_F(Embree, TheMonitorCountsAllThatIsTakenAndGivenBack) {
  std::atomic<int64_t> bytes{0};
  const auto count = [](void* sum, ssize_t change, bool) {
    *static_cast<std::atomic<int64_t>*>(sum) += change;
    return true;
  };
  {
    const EmbreeDevice device = std::move(*make_embree_device());
    set_memory_monitor(device.get(), count, &bytes);
    const EmbreeGeometry geometry = new_quads(device.get());
    const Squares squares;
    copy_array<vec3>(geometry.get(), squares.positions);
    copy_array<uvec4>(geometry.get(), squares.quads);
    const EmbreeScene scene = build_static_scene(device.get(), geometry);
    EXPECT_GT(bytes, 0);
  }
  EXPECT_EQ(bytes, 0);
}

TEST_F(Embree, AnErrorIsSaidOnceAndInWords) {
  const EmbreeScene scene = new_scene(device_.get());
  detach_geometry(scene.get(), 5);
  const auto result = check_embree(device_.get(), "detach it");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::Io);
  EXPECT_EQ(result.error().message, "Embree cannot detach it: invalid operation");
  EXPECT_TRUE(check_embree(device_.get(), "detach it"));
}

}  // namespace
}  // namespace farfield
