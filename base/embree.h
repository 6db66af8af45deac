// SPDX-License-Identifier: Apache-2.0
// Embree as the rooms use it: handles that own, and short functions for what they call. Other files leave Embree's own
// names alone (a test lists the few that may use them), so a move to another version of Embree is made here.
//
// What a function here returns or takes as "Ref" belongs to somebody else. Errors stay with the device until
// check_embree() asks for them.
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>

#include "base/result.h"
#include "base/vec.h"
#include "farfield/embree.h"

namespace farfield {

using EmbreeDeviceRef = RTCDevice;
using EmbreeSceneRef = RTCScene;
using EmbreeGeometryRef = RTCGeometry;
using EmbreeContext = RTCIntersectContext;
using EmbreeRay = RTCRay;
using EmbreeRayHit = RTCRayHit;
using EmbreeHit = RTCHit;
using EmbreeFilter = RTCFilterFunctionN;
using EmbreeFilterArguments = RTCFilterFunctionNArguments;

/// geomID of a ray that hit nothing, and instID outside of instances.
inline constexpr unsigned kNoGeometry = RTC_INVALID_GEOMETRY_ID;

// --- Handles ---------------------------------------------------------------------------------------------------------

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
/// Each owns one reference: made from a raw handle, it takes over that handle's.
using EmbreeDevice = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseEmbree>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseEmbree>;
using EmbreeGeometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, ReleaseEmbree>;

/// One more reference to what somebody else owns.
inline EmbreeDevice retain(EmbreeDeviceRef device) {
  rtcRetainDevice(device);
  return EmbreeDevice(device);
}
inline EmbreeScene retain(EmbreeSceneRef scene) {
  rtcRetainScene(scene);
  return EmbreeScene(scene);
}

// --- Devices ---------------------------------------------------------------------------------------------------------

/// threads: what Embree limits TBB to while the device lives; 0: no limit, and none by other devices either. Triangles
/// that move keep their corners in the BVH where the processor has AVX: rays are 1.3 to 1.9 times as fast as in
/// Embree's default, which gathers them. Errors: Unsupported (Embree does not start).
Result<EmbreeDevice> make_embree_device(int threads = 0);

/// What went wrong on the device since the last call: "Embree cannot TASK: REASON", an Io. Forgets it.
Result<void> check_embree(EmbreeDeviceRef device, std::string_view task);
inline void forget_embree_error(EmbreeDeviceRef device) { rtcGetDeviceError(device); }

/// Calls on_memory(user, bytes, post) for all memory that the device takes (bytes > 0) or gives back, from any thread.
inline void set_memory_monitor(EmbreeDeviceRef device, bool (*on_memory)(void*, ssize_t, bool), void* user) {
  rtcSetDeviceMemoryMonitorFunction(device, on_memory, user);
}

inline EmbreeDevice device_of(EmbreeSceneRef scene) { return EmbreeDevice(rtcGetSceneDevice(scene)); }

// --- Geometries ------------------------------------------------------------------------------------------------------

inline EmbreeGeometry new_triangles(EmbreeDeviceRef device) {
  return EmbreeGeometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
}
inline EmbreeGeometry new_quads(EmbreeDeviceRef device) {
  return EmbreeGeometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD));
}

/// What an array of T is to a geometry: positions (vec3), triangles (uvec3), or quads (any four indices).
template <typename T>
struct EmbreeArray {
  static constexpr bool kIsPosition = std::is_same_v<T, vec3>;
  static constexpr bool kIsTriangle = std::is_same_v<T, uvec3>;
  static_assert(kIsPosition || kIsTriangle || sizeof(T) == 4 * sizeof(uint32_t));
  static constexpr RTCBufferType kType = kIsPosition ? RTC_BUFFER_TYPE_VERTEX : RTC_BUFFER_TYPE_INDEX;
  static constexpr RTCFormat kFormat =
      kIsPosition ? RTC_FORMAT_FLOAT3 : (kIsTriangle ? RTC_FORMAT_UINT3 : RTC_FORMAT_UINT4);
};

/// The geometry reads the caller's array while it is built. Embree loads positions 16 bytes at a time: four bytes after
/// the last one must be readable.
template <typename T>
void share_array(EmbreeGeometryRef geometry, std::span<const T> array) {
  rtcSetSharedGeometryBuffer(geometry, EmbreeArray<T>::kType, 0, EmbreeArray<T>::kFormat, array.data(), 0, sizeof(T),
                             array.size());
}
/// The geometry gets a copy, with room behind it; positions of one of the times of a geometry that moves.
template <typename T>
void copy_array(EmbreeGeometryRef geometry, std::span<const T> array, unsigned time_step = 0) {
  void* copy = rtcSetNewGeometryBuffer(geometry, EmbreeArray<T>::kType, time_step, EmbreeArray<T>::kFormat, sizeof(T),
                                       array.size());
  if (copy) std::copy(array.begin(), array.end(), static_cast<T*>(copy));  // null: out of memory, which the device says
}

/// The geometry moves along straight lines between as many positions, the first at time 0, the last at time 1. Before
/// its arrays.
inline void set_time_steps(EmbreeGeometryRef geometry, unsigned count) { rtcSetGeometryTimeStepCount(geometry, count); }

/// Asked about every hit, of nearest-hit and occlusion queries alike.
inline void set_filter(EmbreeGeometryRef geometry, EmbreeFilter filter, void* user) {
  rtcSetGeometryUserData(geometry, user);
  rtcSetGeometryIntersectFilterFunction(geometry, filter);
  rtcSetGeometryOccludedFilterFunction(geometry, filter);
}

inline void commit_geometry(EmbreeGeometryRef geometry) { rtcCommitGeometry(geometry); }

// --- Scenes ----------------------------------------------------------------------------------------------------------

inline EmbreeScene new_scene(EmbreeDeviceRef device) { return EmbreeScene(rtcNewScene(device)); }
/// How a scene's own BVH is built. Small: of Embree's low quality; for our instances it takes a third of the memory,
/// and rays about a tenth more time.
enum class SceneBuild { Default, Small, Compact, HighQuality };
/// Before the first commit.
inline void set_build(EmbreeSceneRef scene, SceneBuild build) {
  rtcSetSceneFlags(scene, build == SceneBuild::Compact ? RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(scene, build == SceneBuild::Small         ? RTC_BUILD_QUALITY_LOW
                                 : build == SceneBuild::HighQuality ? RTC_BUILD_QUALITY_HIGH
                                                                    : RTC_BUILD_QUALITY_MEDIUM);
}
inline void commit_scene(EmbreeSceneRef scene) { rtcCommitScene(scene); }
/// The geometry's id in the scene, which keeps a reference to it; kNoGeometry is an error.
inline unsigned attach_geometry(EmbreeSceneRef scene, EmbreeGeometryRef geometry) {
  return rtcAttachGeometry(scene, geometry);
}
inline void detach_geometry(EmbreeSceneRef scene, unsigned id) { rtcDetachGeometry(scene, id); }

/// A committed scene of medium quality of these geometries (committed here), with their places, counted from first_id,
/// as ids and no mask; null ones are left out. Built on the calling thread alone: a parallel build may order primitives
/// differently, and with them the bytes that it takes and which of two equal hits is reported; and a thread that waits
/// in here must not run a foreign task. cancel: polled meanwhile; once true, Embree ends with an error, and the scene
/// is of no use.
EmbreeScene build_static_scene(EmbreeDeviceRef device, std::span<const EmbreeGeometry> geometries,
                               const std::atomic<bool>* cancel = nullptr, unsigned first_id = 0);
inline EmbreeScene build_static_scene(EmbreeDeviceRef device, const EmbreeGeometry& geometry) {
  return build_static_scene(device, std::span(&geometry, 1));
}

/// A committed instance of a scene as Embree itself has them: what ours are measured against.
inline EmbreeGeometry new_native_instance(EmbreeDeviceRef device, EmbreeSceneRef object, const mat4x3& local_to_world) {
  EmbreeGeometry instance(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(instance.get(), object);
  rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &local_to_world);
  commit_geometry(instance.get());
  return instance;
}

// --- Rays ------------------------------------------------------------------------------------------------------------

inline EmbreeContext make_context() {
  EmbreeContext context;
  rtcInitIntersectContext(&context);
  return context;
}

/// A ray that no mask stops.
inline EmbreeRay make_ray(const vec3& origin, const vec3& direction, float near = 0.0f,
                          float far = std::numeric_limits<float>::infinity()) {
  return {origin.x, origin.y, origin.z, near, direction.x, direction.y, direction.z, 0.0f, far, 0xffffffffu, 0, 0};
}
/// The same that has hit nothing yet.
inline EmbreeRayHit make_ray_hit(const vec3& origin, const vec3& direction, float near = 0.0f,
                                 float far = std::numeric_limits<float>::infinity()) {
  EmbreeRayHit ray_hit{};
  ray_hit.ray = make_ray(origin, direction, near, far);
  ray_hit.hit.geomID = ray_hit.hit.instID[0] = kNoGeometry;
  return ray_hit;
}

/// Finds the nearest hit. False: there is none, and of the hit only geomID has changed.
inline bool trace_nearest(EmbreeSceneRef scene, EmbreeContext& context, EmbreeRayHit& ray_hit) {
  ray_hit.hit.geomID = kNoGeometry;
  rtcIntersect1(scene, &context, &ray_hit);
  return ray_hit.hit.geomID != kNoGeometry;
}
/// Whether there is any hit. If so, the ray's tfar becomes -infinity.
inline bool trace_occlusion(EmbreeSceneRef scene, EmbreeContext& context, EmbreeRay& ray) {
  rtcOccluded1(scene, &context, &ray);
  return ray.tfar < 0.0f;
}

}  // namespace farfield
