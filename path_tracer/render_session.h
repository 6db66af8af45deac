// SPDX-License-Identifier: Apache-2.0
// The runtime with a scene's assets and instances: opened once, rendered frame by frame.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/embree.h"
#include "base/result.h"
#include "import/gltf_scene.h"
#include "path_tracer/film.h"
#include "path_tracer/pixel_report.h"
#include "path_tracer/render_job.h"
#include "path_tracer/scene_names.h"

namespace farfield {

/// One thread at a time; render() itself uses all threads.
class RenderSession {
 public:
  /// folders: per mesh, as find_or_bake_assets gives them; instances of meshes without one are left out.
  /// names: for ids, of the same folders; empty without. The device outlives the session. Errors: those of Runtime;
  /// OutOfBudget has the number that would do for the whole scene.
  static Result<std::unique_ptr<RenderSession>> open(EmbreeDeviceRef device, const RenderOptions& options,
                                                     std::span<const std::filesystem::path> folders,
                                                     std::span<const GltfInstance> instances,
                                                     const MaterialNames& names);

  /// Places the instances anew, at evenly spaced times of the open shutter (one: they stand still): as many each time,
  /// of the same meshes in the same order. Errors: those of Runtime::move_instance.
  Result<void> move(std::span<const std::vector<GltfInstance>> keys);

  /// The keys of cameras (see path_trace()) of a frame and of the one after it, empty if there is none.
  struct FrameCameras {
    std::span<const Camera> now, next;
  };
  /// Plans for the camera, loads, and renders into the film, while levels for the next frame are loaded. The report's
  /// frame number is not set. Errors: those of plan_frame and path_trace.
  Result<FrameReport> render(const FrameCameras& cameras, const Lights& lights, const RenderOptions& options,
                             Film& film, const Job& job);

  /// Plans for the camera and looks at the pixel that the report names. names: per shown mesh. instances: of open().
  /// Errors: those of plan_frame.
  Result<void> explain(const Camera& camera, const RenderOptions& options, std::span<const std::string> names,
                       std::span<const GltfInstance> instances, PixelReport& report);

  Stats stats() const { return runtime_->stats(); }

 private:
  RenderSession() = default;
  Result<void> fill(EmbreeDeviceRef device, std::span<const std::filesystem::path> folders,
                    std::span<const GltfInstance> instances, const MaterialNames& names, bool is_small);
  Result<PlanSummary> plan(std::span<const Camera> camera, const RenderOptions& options);
  std::vector<std::vector<LevelRecord>> level_stats() const;
  std::vector<std::vector<LevelUse>> level_use(const std::vector<std::vector<LevelRecord>>& before,
                                               const LevelHits& hits) const;
  std::unique_ptr<Runtime> runtime_;
  std::vector<AssetId> assets_;  ///< that are shown, in the order of FrameReport::finest_level
  std::vector<bool> is_shown_;   ///< per mesh: it has a folder
  SceneIds ids_;
  EmbreeScene scene_;
};

}  // namespace farfield
