// SPDX-License-Identifier: Apache-2.0
#include "tools/render_flags.h"

#include <fmt/format.h>

#include "base/bytes.h"
#include "base/parallel.h"
#include "tools/args.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace farfield::tool {
namespace {

Result<Blend> parse_blend(const std::string& text) {
  if (text == "dissolve") return Blend::Dissolve;
  if (text == "morph")
    return make_error(ErrorCode::Unsupported, "this version cannot morph; levels carry the data, dissolve works");
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a way to blend; dissolve is", text));
}

Result<uint64_t> parse_budget(const std::string& text) {
  const auto bytes = parse_bytes(text);
  if (bytes && *bytes == 0) return make_error(ErrorCode::InvalidArgument, "nothing fits 0 bytes");
  return bytes;
}

/// What CLI::PositiveNumber says, but NaN is no number either.
std::string is_scale(const std::string& text) {
  float scale = 0;
  if (CLI::detail::lexical_cast(text, scale) && scale > 0 && scale <= 1e6f) return {};
  return fmt::format("\"{}\" is not a number above 0, at most 1e6", text);
}

}  // namespace

void add_render_flags(CLI::App* command, RenderArguments& arguments, const std::string& output_help) {
  RenderOptions& options = arguments.options;
  command->add_option("scene", arguments.scene, "glTF scene: .glb or .gltf")->required()->check(is_named);
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
  add_parsed_option(command, "--budget", options.budget_bytes, parse_budget,
                    "Memory for assets, e.g. 300M or 4GiB: a hard limit")
      ->default_str(format_bytes(options.budget_bytes));
  command->add_option("--assets", arguments.assets,
                      "Folder of baked assets; what is missing is baked. Without it farfield-assets beside the scene");
  add_parsed_option(command, "--blend", options.blend, parse_blend, "How neighbouring levels are mixed: dissolve")
      ->default_str("dissolve");
  command
      ->add_option("--pixel-error", options.pixel_error,
                   "How wide voxels may look, in pixels: above 1 coarser, below 1 finer")
      ->check(is_scale)
      ->capture_default_str();
  command->add_flag("--full-detail", options.full_detail, "Render the sources, without levels, for comparison");
  CLI::Option* environment = command->add_option("--environment", arguments.environment,
                                                 "Light from a latitude-longitude picture, EXR or Radiance HDR");
  command->add_flag("!--no-sky", options.sky, "No sun and sky: the scene's own lights alone")->excludes(environment);
  command->add_flag("--cryptomatte", options.cryptomatte,
                    "Also write which objects and materials each pixel shows, for mattes by name (Cryptomatte)");
  command->add_option("--camera", options.camera, "Name or index of a camera of the scene. Without it the first");
  command
      ->add_option("--fps", options.frames_per_second,
                   "Frames per second: frame n is the scene at n / fps. Without it the rate of the animation's keys, "
                   "else 24")
      ->check(CLI::Range(0.001, 1e6));
  command->add_option("--exposure", options.exposure_stops, "Of the PNG previews, in stops")
      ->check(CLI::Range(-50, 50));
  add_parsed_option(command, "--assemblies", options.assemblies, parse_assembly_rule,
                    "What is baked as one: trees of several meshes that the scene repeats, or only what it marks, or "
                    "nothing: repeated, marked, none")
      ->default_str(name_of(options.assemblies));
  command->add_option("--finest-grid", options.finest_grid, "Of assets that have to be baked, a power of two")
      ->check(is_finest_grid)
      ->capture_default_str();
  command->add_option("--threads", arguments.threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}

Result<RenderReport> run_with_progress(std::string_view command, RenderArguments& arguments,
                                       const std::function<Result<RenderReport>(const RenderOptions&)>& job) {
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  RenderOptions& options = arguments.options;
  options.scene = arguments.scene;
  options.assets = arguments.assets;
  options.environment = arguments.environment;
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
  return job(options);
}

}  // namespace farfield::tool
