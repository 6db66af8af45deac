// SPDX-License-Identifier: Apache-2.0
// What render and shot share: a scene made ready, then frames of it within one budget.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "import/gltf_scene.h"
#include "path_tracer/image.h"
#include "path_tracer/integrator.h"
#include "path_tracer/pixel_report.h"
#include "path_tracer/render_job.h"
#include "path_tracer/scene_names.h"
#include "path_tracer/warning_log.h"

namespace farfield {

/// Takes a finished frame. report.frames.back() tells of it; peaks are up to date.
using FrameSink = std::function<Result<void>(const Image& image, const Metadata& metadata, const RenderReport& report)>;

/// One thread at a time; render() itself uses all threads.
class FrameRenderer {
 public:
  /// Reads the scene, its lights, and finds or bakes its assets. Errors: InvalidArgument (image size), those of
  /// read_scene, make_lights, find_or_bake_assets.
  static Result<std::unique_ptr<FrameRenderer>> prepare(const RenderOptions& options);

  /// Text that is equal if and only if everything that the images depend on is: options, scene, environment, assets.
  const std::string& fingerprint() const { return fingerprint_; }
  /// Names of the meshes that are shown, in the order of FrameReport::finest_level.
  const std::vector<std::string>& asset_names() const { return asset_names_; }

  /// Renders frames, at least one, in the order given. The process's memory is measured from just before the assets are
  /// opened. Errors: those of warm_up, RenderSession and the sink; Cancelled.
  Result<RenderReport> render(std::span<const int> frames, const FrameSink& sink);

  /// Looks at a pixel of a frame; x and y lie in the picture. Errors: those of RenderSession.
  Result<PixelReport> explain(int frame, int x, int y);

 private:
  FrameRenderer() = default;

  RenderOptions options_;  // its warnings go by way of warnings_
  std::shared_ptr<WarningLog> warnings_;
  GltfScene scene_;
  size_t camera_ = 0;  // index into scene_.cameras
  Lights lights_;
  std::vector<std::filesystem::path> asset_folders_;  // per mesh
  MaterialNames material_names_;                      // empty without ids
  std::vector<std::string> asset_names_;
  std::string fingerprint_;
};

}  // namespace farfield
