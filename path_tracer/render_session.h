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

  /// Places the instances anew: as many, of the same meshes in the same order. Errors: those of Runtime::move_instance.
  Result<void> move(std::span<const GltfInstance> instances);

  /// Plans for the camera, loads, and renders into the film. The report's frame number is not
  /// set. Errors: those of plan_frame and path_trace.
  Result<FrameReport> render(const Camera& camera, const Lights& lights, const RenderOptions& options, Film& film,
                             const Job& job);

  Stats stats() const { return runtime_->stats(); }

 private:
  RenderSession() = default;
  Result<void> fill(EmbreeDeviceRef device, std::span<const std::filesystem::path> folders,
                    std::span<const GltfInstance> instances, const MaterialNames& names, bool is_small);
  std::unique_ptr<Runtime> runtime_;
  std::vector<bool> is_shown_;  ///< per mesh: it has a folder
  SceneIds ids_;
  EmbreeScene scene_;
};

}  // namespace farfield
