// SPDX-License-Identifier: Apache-2.0
#include "tools/render_flags.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <mutex>

#include "base/bytes.h"
#include "base/parallel.h"
#include "path_tracer/warning_log.h"
#include "tools/args.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/fog_flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/subdivision_flags.h"

namespace farfield::tool {
namespace {

Result<Blend> parse_blend(const std::string& text) {
  if (text == "dissolve") return Blend::Dissolve;
  if (text == "morph") return Blend::Morph;
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("\"{}\" is not a way to blend; dissolve and morph are", text));
}

}  // namespace

void add_picture_flags(CLI::App* command, RenderArguments& arguments, const std::string& output_help) {
  RenderOptions& options = arguments.options;
  command->add_option("scene", arguments.scene, "glTF scene: .glb or .gltf; or a volume: .vdb, .nvdb")
      ->required()
      ->check(is_named);
  if (!output_help.empty())
    command->add_option("-o,--output", arguments.output, output_help)->required()->check(is_named);
  const auto set_size = [&options](const std::string& text) {
    const auto size = parse_pixel_size(text);
    if (!size) throw CLI::ValidationError("--size", size.error().message);
    options.width = size->width, options.height = size->height;
  };
  command->add_option_function<std::string>("--size", set_size, "Pixels WxH")
      ->default_str(fmt::format("{}x{}", options.width, options.height));
  command->add_option("--spp", options.trace.samples_per_pixel, "Samples per pixel")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  command->add_option("--seed", options.trace.seed, "Of the random numbers");
  command->add_option("--assets", arguments.assets,
                      "Folder of baked assets; what is missing is baked. Without it farfield-assets beside the scene");
  add_parsed_option(command, "--blend", options.blend, parse_blend,
                    "How neighbouring levels are mixed: dissolve (each path sees one of them) or morph (they change "
                    "into each other in place; more memory, slower)")
      ->default_str("dissolve");
  command
      ->add_option("--blend-window", options.blend_window,
                   "Octaves of distance before a coarser level over which it blends with the finer one")
      ->check(CLI::Range(0.001, 1.0))
      ->default_str("1");
  CLI::Option* environment = command->add_option("--environment", arguments.environment,
                                                 "Light from a latitude-longitude picture, EXR or Radiance HDR");
  command->add_flag("!--no-sky", options.sky, "No sun and sky: the scene's own lights alone")->excludes(environment);
  command->add_option("--camera", options.camera, "Name or index of a camera of the scene. Without it the first");
  command
      ->add_option("--fps", options.frames_per_second,
                   "Frames per second: frame n is the scene at n / fps. Without it the rate of the animation's keys, "
                   "else 24")
      ->check(CLI::Range(0.001, 1e6));
  command
      ->add_option("--shutter", options.shutter,
                   "Motion blur: for how many frames the shutter is open, the frame's own time in the middle")
      ->check(CLI::Range(0.0, 16.0))
      ->default_str("0");
  command->add_option("--exposure", options.exposure_stops, "Of the PNG previews, in stops")
      ->check(CLI::Range(-50.0, 50.0));
  add_parsed_option(command, "--assemblies", options.assemblies, parse_assembly_rule,
                    "What is baked as one: trees of several meshes that the scene repeats, or only what it marks, or "
                    "nothing: repeated, marked, none")
      ->default_str(name_of(options.assemblies));
  add_tiles_flag(command, options.tile_triangles);
  command->add_option("--threads", arguments.threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}

void add_level_flags(CLI::App* command, RenderOptions& options) {
  add_parsed_option(command, "--budget", options.budget_bytes, parse_budget,
                    "Memory for assets, e.g. 300M or 4GiB: a hard limit")
      ->default_str(format_bytes(options.budget_bytes));
  add_parsed_option(command, "--pixel-error", options.pixel_error, parse_pixel_error,
                    "How wide voxels may look, in pixels: above 1 coarser, below 1 finer")
      ->default_str("1");
  command
      ->add_option("--off-screen-scale", options.off_screen_scale,
                   "How much wider voxels of what the camera does not see may look in mirrors and in bounced light")
      ->check(CLI::Range(1.0, 1e6))
      ->default_str("1");
  command->add_flag("--full-detail", options.full_detail, "Render the sources, without levels, for comparison");
  command
      ->add_flag("--turn-sun", options.turn_sun,
                 "Sun, sky and directional lights from the opposite side: what was lit from the front is from behind")
      ->excludes(command->get_option("--environment"));
  command->add_flag("--cryptomatte", options.cryptomatte,
                    "Also write which objects and materials each pixel shows, for mattes by name (Cryptomatte)");
  add_parsed_option(command, "--finest-grid", options.finest_grid, parse_finest_grid,
                    "Of assets that have to be baked, a power of two")
      ->default_str(fmt::format("{}", options.finest_grid));
  add_fog_flags(command, options.fog);
  add_downsampling_flag(command, options.downsampling);
  add_subdivision_flags(command, options.subdivision);
  add_parsed_option(command, "--rays-per-voxel", options.rays_per_voxel, parse_rays_per_voxel,
                    "Of assets that have to be baked: what each voxel's density is measured with")
      ->default_str(fmt::format("{}", options.rays_per_voxel));
}

void add_frame_flag(CLI::App* command, int& frame) {
  command->add_option("--frame", frame, "Frame n is the scene at n / fps seconds, see --fps")
      ->check(CLI::Range(0, 1 << 24))
      ->capture_default_str();
}

void add_stats_flag(CLI::App* command, RenderArguments& arguments) {
  command->add_flag("--stats", arguments.with_stats,
                    "Print at the end what each level of each asset did: loads, bytes, hits, how often it was missing");
}

namespace {

/// "progress 0.42 frame 60 (3/7)": what is done, as lines on standard output, ten a second at most. Any thread.
class ProgressLines {
 public:
  void update(double done, const std::string& what) {
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock(mutex_);
    if (now - last_written_ < std::chrono::milliseconds(100)) return;
    last_written_ = now;
    fmt::print("progress {:.4f} {}\n", done, what);
    std::fflush(stdout);
  }

 private:
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_written_{};  // guarded by mutex_
};

}  // namespace

void set_files(RenderArguments& arguments) {
  arguments.options.scene = arguments.scene;
  arguments.options.assets = arguments.assets;
  arguments.options.environment = arguments.environment;
}

Result<RenderReport> run_with_progress(std::string_view command, RenderArguments& arguments, const RenderTask& task) {
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  RenderOptions& options = arguments.options;
  set_files(arguments);
  options.job = {[&](double done, const std::string& stage) { progress.update(done, stage); }, &catch_interrupts()};
  options.message = [&](const std::string& line) {
    if (!stdout_is_terminal()) return;
    progress.clear();
    fmt::print("{}\n", one_line(line));
  };
  options.warning = [&](const std::string& line) {
    progress.clear();
    print_warnings(command, {line});
  };
  return task(options);
}

Result<RenderReport> run_for_parent(RenderArguments& arguments, int parent, const RenderTask& task) {
  const ThreadLimit limit(arguments.threads);
  ProgressLines progress;
  WarningLog warnings({});
  RenderOptions& options = arguments.options;
  set_files(arguments);
  options.job = {[&](double done, const std::string& stage) { progress.update(done, stage); }, &catch_interrupts()};
  options.warning = [&](const std::string& line) { warnings.add(line); };
  end_with_parent(parent);
  auto report = task(options);
  if (report) return report;
  Error error = report.error();
  error.warnings = warnings.lines();
  if (error.code == ErrorCode::Cancelled) error = {ErrorCode::Cancelled, ""};  // the parent says so
  return tl::unexpected(std::move(error));
}

}  // namespace farfield::tool
