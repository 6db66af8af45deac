// SPDX-License-Identifier: Apache-2.0
// Why these choices (quads, MEDIUM quality, default flags, shared buffers): docs/decisions and the measurements that
// DESIGN, decision 2, quotes. COMPACT would halve the speed on foliage; Embree cannot load a saved BVH.
#include "bvh/level_scene.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/result.h"
#include "cache/level_file.h"

namespace farfield {

namespace {

template <typename T>
void share_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::span<const T> array) {
  rtcSetSharedGeometryBuffer(geometry, type, 0, format, array.data(), 0, sizeof(T), array.size());
}

RTCGeometry make_quad_geometry(RTCDevice device, const LevelView& level) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  share_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, level.positions);
  share_buffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, level.quads);
  rtcSetGeometryMask(geometry, 0xffffffffu);  // the mask of the user geometry around it decides
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace

Result<LevelScene> LevelScene::build(BvhDevice& device, const LevelView& level) {
  LevelScene result;
  if (!level.has_surface()) return result;

  const std::lock_guard lock(device.build_mutex());
  const uint64_t bytes_before = device.bytes();
  device.reset_peak();
  rtcGetDeviceError(device.handle());  // forget what is not ours

  RTCGeometry geometry = make_quad_geometry(device.handle(), level);
  result.scene_ = rtcNewScene(device.handle());
  rtcSetSceneBuildQuality(result.scene_, RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometryByID(result.scene_, geometry, 0);
  rtcReleaseGeometry(geometry);
  // An arena of one: a render thread that waits in here must not run a foreign task, and the bytes stay the same.
  tbb::task_arena(1).execute([&] { rtcCommitScene(result.scene_); });

  const RTCError error = rtcGetDeviceError(device.handle());
  if (error != RTC_ERROR_NONE) {
    return make_error(ErrorCode::Io,
                      fmt::format("Embree cannot build a BVH of {} quads (error {}{})", level.quads.size(),
                                  static_cast<int>(error), error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : ""));
  }
  const uint64_t bytes_after = device.bytes();
  result.bytes_ = bytes_after - std::min(bytes_before, bytes_after) + kSceneOverheadBytes + kGeometryOverheadBytes;
  result.build_peak_bytes_ = device.peak_bytes() - bytes_after;
  return result;
}

LevelScene::~LevelScene() {
  if (scene_) rtcReleaseScene(scene_);
}

LevelScene::LevelScene(LevelScene&& other) noexcept { *this = std::move(other); }

LevelScene& LevelScene::operator=(LevelScene&& other) noexcept {
  std::swap(scene_, other.scene_);
  std::swap(bytes_, other.bytes_);
  std::swap(build_peak_bytes_, other.build_peak_bytes_);
  return *this;
}

LevelCost level_cost(const LevelView& level, const LevelScene& scene) {
  // Checking the file has mapped all of it. What is not given back stays mapped and so never faults again, which would
  // bring its neighbours back.
  const LevelFileSizes file = level_file_sizes(level);
  return {file.mapped_bytes - file.build_only_bytes + scene.bytes(), file.build_only_bytes + scene.build_peak_bytes()};
}

Result<LevelCost> measure_level_scene(BvhDevice& device, const LevelView& level) {
  // A LevelData has nothing behind its last position: see LevelScene::build.
  std::vector<vec3> padded_positions(level.positions.begin(), level.positions.end());
  padded_positions.emplace_back(0.0f);
  LevelView padded = level;
  padded.positions = std::span<const vec3>(padded_positions.data(), level.positions.size());

  FARFIELD_TRY_LET(const auto scene, LevelScene::build(device, padded));
  return level_cost(level, scene);
}

Result<LevelCost> measure_level_scene(const LevelView& level) {
  FARFIELD_TRY_LET(const auto device, BvhDevice::create());
  return measure_level_scene(*device, level);
}

}  // namespace farfield
