// SPDX-License-Identifier: Apache-2.0
// `farfield render`: one frame of a glTF scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "base/job.h"
#include "base/result.h"
#include "farfield/runtime.h"
#include "import/read_scene.h"
#include "path_tracer/integrator.h"

namespace farfield {

/// What render and shot have in common.
struct RenderOptions {
  std::filesystem::path scene;   ///< .gltf, .glb or .vdb
  std::string camera;            ///< its name, or its index in the scene; empty: the first
  double frames_per_second = 0;  ///< of frame numbers; 0: GltfScene::frames_per_second
  int width = 480;
  int height = 270;
  TraceOptions trace;
  uint64_t budget_bytes = uint64_t{4} << 30;
  /// Folder of baked assets: ASSETS/SCENE/MESH.farfield for each mesh. Empty: "farfield-assets" beside the scene.
  std::filesystem::path assets;
  float pixel_error = 1.0f;       ///< RuntimeOptions::pixel_error
  float off_screen_scale = 1.0f;  ///< TessellationCamera::off_screen_scale
  Blend blend = Blend::Dissolve;
  float blend_window = 1.0f;          ///< RuntimeOptions::blend_window
  bool full_detail = false;           ///< level 0 only, from assets baked with --source-only
  std::filesystem::path environment;  ///< EXR or Radiance HDR; empty: sun and sky, see make_lights()
  bool sky = true;                    ///< false: without an environment there is no light but the scene's own
  /// The sun, its sky and the scene's directional lights come from the opposite side: half a turn about +y.
  bool turn_sun = false;
  /// How long the shutter is open, in frames, around each frame's time; 0: an instant.
  double shutter = 0;
  float exposure_stops = 0;                           ///< of the PNG previews
  bool cryptomatte = false;                           ///< also write ids of objects and materials, see film.h
  uint32_t finest_grid = 512;                         ///< of assets that have to be baked first
  uint32_t rays_per_voxel = 200;                      ///< the same: SceneBakeOptions::rays_per_voxel
  AssemblyRule assemblies = AssemblyRule::Repeated;   ///< which subtrees of the scene are baked as one
  uint64_t tile_triangles = kTileTriangles;           ///< SceneOptions::tile_triangles
  FogOptions fog;                                     ///< of a scene that is a volume alone
  Downsampling downsampling = Downsampling::Matched;  ///< of volumes that have to be baked
  SubdivisionOptions subdivision;                     ///< of all meshes of the scene
  /// Command that bakes: called as BAKER bake SCENE --scene -o LIBRARY ... Empty: this very program.
  std::filesystem::path baker;
  std::function<void(const std::string& line)> message;  ///< for a person who waits, one line each; may be empty
  std::function<void(const std::string& line)> warning;  ///< what is ignored, guessed or degraded, each line
                                                         ///< once; from any thread; may be empty
  Job job;                                               ///< reports from any thread
};

/// What a level of an asset did in a frame.
struct LevelUse {
  uint32_t level = 0;           ///< k
  uint64_t hits = 0;            ///< of camera and scattered rays
  uint64_t loads = 0;           ///< reloads included
  double load_seconds = 0;      ///< read, check, build
  uint64_t resident_bytes = 0;  ///< after the frame
  uint64_t served_coarser = 0;  ///< visits of rays that asked for it and got a coarser level
};

/// What a frame took. Bytes are the process's and the budget's; see ShotReport.
struct FrameReport {
  int frame = 0;
  double seconds = 0;            ///< wall time of plan, prefetch and render
  double cpu_seconds = 0;        ///< of all threads of the process meanwhile
  double load_seconds = 0;       ///< summed over loads of levels: read, check, build; also those done in frames before
  double stall_seconds = 0;      ///< of `seconds`: prefetch, and what rays waited for levels, a mean over the threads
  uint64_t accounted_bytes = 0;  ///< that the runtime counts against the budget, after the frame
  uint64_t rss_bytes = 0;        ///< of the process after the frame
  uint64_t levels_loaded = 0;
  uint64_t fallbacks = 0;  ///< visits of rays to instances that a coarser level than planned served
  uint64_t rays = 0;
  uint64_t invalid_samples = 0;               ///< paths whose value was not finite; black in the image
  double bias = 0;                            ///< PlanSummary::bias
  uint64_t asked_bytes = 0;                   ///< a budget that would give nothing up
  uint32_t morphs = 0;                        ///< PlanSummary::morphs
  uint32_t morphs_given_up = 0;               ///< PlanSummary::morphs_given_up
  std::vector<uint32_t> finest_level;         ///< per asset of RenderReport::assets: finest level that rays may use
  std::vector<std::vector<LevelUse>> levels;  ///< per asset: its stored levels that anything happened to
  std::vector<float> levels_given_up;         ///< per asset: how many levels coarser than asked, for the budget's sake

  /// The share of its time in which it waited for levels.
  double stall() const { return seconds > 0 ? stall_seconds / seconds : 0.0; }
  /// The picture is not what was planned: a level was lost or did not fit, which the warnings say.
  bool is_degraded() const { return fallbacks > 0; }
};

struct RenderReport {
  std::vector<std::string> assets;  ///< names of the meshes that are shown
  uint64_t budget_bytes = 0;
  uint64_t baseline_rss_bytes = 0;    ///< of the process before it opened the assets
  uint64_t peak_rss_bytes = 0;        ///< highest since then
  uint64_t peak_accounted_bytes = 0;  ///< highest that the runtime counted against the budget
  std::vector<FrameReport> frames;    ///< those that are finished, in order
  std::vector<std::string> warnings;  ///< each once, in the order they came
};

/// Renders one frame to `out` (EXR with the channels of film.h and metadata) and to the PNG beside it.
/// frame: n is the scene at n / RenderOptions::frames_per_second, or GltfScene::frames_per_second where that is 0.
/// Errors: those of the scene, the bake, the runtime, the files; those of check_frames (the picture is written all the
/// same); Cancelled.
Result<RenderReport> render_frame(const RenderOptions& options, int frame, const std::filesystem::path& out);

/// Errors: BadFile, with their numbers, if any of the frames is degraded.
Result<void> check_frames(const RenderReport& report);

/// Writes an image to `exr` with its metadata, and as a PNG preview beside it. Errors: those of write_exr, write_png.
Result<void> write_frame(const std::filesystem::path& exr, const Image& image, const Metadata& metadata,
                         float exposure_stops);

}  // namespace farfield
