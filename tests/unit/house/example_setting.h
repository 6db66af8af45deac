// SPDX-License-Identifier: Apache-2.0
// What a host has before it meets Farfield: the names that the examples in documents and headers take as given. Only
// check_example.cmake includes it, and nothing of it is defined.
#pragma once

#include <farfield/runtime.h>

#include <memory>
#include <vector>

extern RTCDevice device;
extern RTCScene scene;
extern RTCRayHit ray_hit;
extern farfield::RayContext context;
extern std::unique_ptr<farfield::Runtime> runtime;
extern std::vector<glm::mat4x3> places;
extern glm::mat4x3 local_to_world;
extern glm::vec3 eye, next_eye, throughput, radiance, origin, direction;
extern farfield::RuntimeOptions options;
extern unsigned farfield_geometry;
extern float pixel_spread;
extern uint32_t path, ray;
extern farfield::Rng rng;

// A host's own materials.
struct MyMask {
  float lookup(glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy) const;
};
struct MyColor {
  glm::vec3 lookup(glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy) const;
};
struct MyBsdf {
  farfield::ScatterSample sample(farfield::Rng& rng) const;
};
struct MyMaterial {
  MyMask mask;
  MyColor color;
  float roughness;
  MyBsdf bsdf(glm::vec2 uv, glm::vec3 shading_normal, glm::vec3 wo) const;
};
extern std::vector<MyMaterial> my_materials;
