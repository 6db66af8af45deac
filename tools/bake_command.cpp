// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <optional>

#include "bake/bake.h"
#include "base/bytes.h"
#include "base/parallel.h"
#include "base/process_memory.h"
#include "base/process_time.h"
#include "import/read_volume.h"
#include "path_tracer/scene_assets.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/fog_flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/report_json.h"
#include "tools/subdivision_flags.h"

namespace farfield::tool {
namespace {

struct BakeArguments {
  std::string source, output, report;
  bool whole_scene = false;
  AssemblyRule assemblies = AssemblyRule::Repeated;
  uint64_t tile_triangles = kTileTriangles;
  Part part;
  int parent = 0;  // process that started this one for itself; 0: nobody did
  int threads = 0;
  bool warnings = true;
  BakeOptions options;
};

void print_summary(const BakeArguments& arguments, const BakeReport& report) {
  uint64_t bytes = 0;
  for (const LevelEntry& level : report.manifest.levels) bytes += level.file_bytes;
  const size_t levels = report.manifest.levels.size();
  fmt::print("{}: {} level{}, {}, {}\n", arguments.output, levels, levels == 1 ? "" : "s", format_bytes(bytes),
             report.up_to_date ? "up to date" : fmt::format("baked in {:.1f} s", report.total_seconds));
}

/// What each asset of a scene takes of this process; written after each, so that what was measured stays if the rest
/// is not baked.
class SceneReport {
 public:
  /// path: empty for none.
  explicit SceneReport(std::string path) : path_(std::move(path)) {}

  void begin() {
    peak_.emplace();
    cpu_before_ = process_cpu_seconds();
  }
  Result<void> end(const std::string& asset, const BakeReport& report) {
    assets_.push_back({asset, process_cpu_seconds() - cpu_before_, peak_->peak_bytes(), report});
    return path_.empty() ? Result<void>() : write_text_file(path_, scene_report_json(assets_));
  }

 private:
  std::string path_;
  std::optional<PeakMemory> peak_;
  double cpu_before_ = 0;
  std::vector<AssetReport> assets_;
};

/// On standard output a line before and after each asset, for whoever started this. Exit code 1 if one failed.
Result<void> bake_scene(const BakeArguments& arguments) {
  ProgressLine progress;
  SceneBakeOptions options;
  options.scene = arguments.source;
  options.library = arguments.output;
  options.finest_grid = arguments.options.finest_grid;
  options.coarsest_grid = arguments.options.coarsest_grid;
  options.rays_per_voxel = arguments.options.rays_per_voxel;
  options.source_only = arguments.options.source_only;
  options.read = {arguments.assemblies, arguments.options.import.fog, arguments.tile_triangles};
  options.subdivision = arguments.options.import.subdivision;
  options.downsampling = arguments.options.downsampling;
  options.part = arguments.part.number;
  options.part_count = arguments.part.count;
  options.job = arguments.options.job;
  options.job.progress = [&](double done, const std::string& stage) { progress.update(done, stage); };
  const auto say = [&](const char* what, const std::string& asset) {
    progress.clear();
    fmt::print("{} {}\n", what, asset);
    std::fflush(stdout);
  };
  const auto warn = [&](const std::vector<std::string>& lines) {
    progress.clear();
    print_warnings("bake", lines);
  };
  SceneReport measured(arguments.report);
  Result<void> written;
  options.begin = [&](const std::string& asset) {
    say("baking", asset);
    measured.begin();
  };
  options.end = [&](const std::string& asset, const Result<BakeReport>& report) {
    if (report && written) written = measured.end(asset, *report);
    if (report && arguments.warnings) warn(report->warnings);
    if (!report) {
      warn(report.error().warnings);
      warn({fmt::format("{}: {}", asset, report.error().message)});
    }
    say(report ? "ready" : "failed", asset);
  };
  options.warning = [&](const std::string& line) {
    if (arguments.warnings) warn({line});
  };
  const auto failed = bake_scene_assets(options);
  progress.clear();
  if (!failed) return tl::unexpected(failed.error());
  if (*failed == 0) return written;
  return make_error(ErrorCode::Unsupported,
                    fmt::format("{}: {} of its assets cannot be baked", arguments.source, *failed));
}

/// What was said of the other kind of source, which changes nothing.
std::vector<std::string> flags_without_use(const BakeArguments& arguments) {
  if (arguments.whole_scene) return {};
  if (is_volume_file(arguments.source)) {
    const BakeOptions usual;
    const BakeOptions& options = arguments.options;
    if (options.finest_grid == usual.finest_grid && options.rays_per_voxel == usual.rays_per_voxel &&
        canonical_text(options.import.subdivision).empty() && options.simplify == usual.simplify)
      return {};
    return {fmt::format(
        "{}: --finest-grid, --rays-per-voxel, --subdivide and --simplify are for models; a volume's grid is its own",
        arguments.source)};
  }
  if (canonical_text(arguments.options.import.fog).empty()) return {};
  return {fmt::format("{}: is no volume; flags of volumes change nothing", arguments.source)};
}

Result<void> run_bake(BakeArguments& arguments) {
  if (auto writable = check_can_write(arguments.report, Output::Text, {arguments.source, arguments.output}); !writable)
    return writable;
  const ThreadLimit limit(arguments.threads);
  arguments.options.job.cancel = &catch_interrupts();
  end_with_parent(arguments.parent);
  if (arguments.whole_scene) return bake_scene(arguments);
  print_warnings("bake", flags_without_use(arguments));
  ProgressLine progress;
  arguments.options.job.progress = [&](double done, const std::string& stage) { progress.update(done, stage); };

  const auto report = bake(arguments.source, arguments.output, arguments.options);
  progress.clear();
  if (!report) return tl::unexpected(report.error());
  if (arguments.warnings) print_warnings("bake", report->warnings);
  if (stdout_is_terminal()) print_summary(arguments, *report);
  return arguments.report.empty() ? Result<void>() : write_text_file(arguments.report, bake_report_json(*report));
}

}  // namespace

void add_bake_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<BakeArguments>();
  BakeOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand(
      "bake", "Bake a model or a volume to a folder of levels; goes on where an interrupted bake stopped");
  command
      ->add_option("source", arguments->source,
                   "Model: OBJ, PLY, glTF or glb, gzipped or not. Volume: OpenVDB or NanoVDB (.vdb, .nvdb)")
      ->required()
      ->check(is_named);
  command->add_option("-o,--output", arguments->output, "Folder to write, by convention NAME.farfield")
      ->required()
      ->check(is_named);
  command
      ->add_option("--finest-grid", options.finest_grid,
                   "Voxels along the longest side of level 1, a power of two; of models, a volume's grid is its own")
      ->capture_default_str();
  command->add_option("--coarsest-grid", options.coarsest_grid, "The same of the last level, the root")
      ->capture_default_str();
  command->add_option("--rays-per-voxel", options.rays_per_voxel, "Rays that measure each voxel's occlusion")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  add_part_flags(command, options.import, "glTF: bake only this mesh, in its own space",
                 "glTF: bake only what this node and those below it show");
  CLI::Option* scene = command
                           ->add_flag("--scene", arguments->whole_scene,
                                      "glTF: bake each asset of the scene, into folders in the one given by -o, as "
                                      "render and shot do")
                           ->excludes(command->get_option("--mesh"))
                           ->excludes(command->get_option("--node"))
                           ->excludes(command->get_option("--tile"));
  add_parsed_option(command, "--assemblies", arguments->assemblies, parse_assembly_rule,
                    "With --scene, what is one asset: repeated, marked, none")
      ->default_str(name_of(arguments->assemblies))
      ->needs(scene);
  add_tiles_flag(command, arguments->tile_triangles)->needs(scene);
  add_parsed_option(command, "--part", arguments->part, parse_part,
                    "With --scene, only each N-th asset from number I on: I/N, for processes that share the work")
      ->default_str("0/1")
      ->needs(scene);
  command->add_option("--parent", arguments->parent, "Process to end with")->group("");  // for render and shot
  add_fog_flags(command, options.import.fog);
  add_downsampling_flag(command, options.downsampling);
  add_subdivision_flags(command, options.import.subdivision);
  add_simplify_flag(command, options.simplify)->excludes(scene);  // which has triangles only
  command->add_flag("--source-only", options.source_only, "Write level 0 only: the source, ready to render");
  command->add_option("--threads", arguments->threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("!--no-warnings", arguments->warnings,
                    "Leave what was ignored or guessed to the manifest, as render does, which says it itself");
  command->add_option("--report", arguments->report, "Write what was done, with seconds per stage, as JSON");
  command->footer(
      "Example:\n  farfield bake oak.obj.gz -o oak.farfield --finest-grid 512\n"
      "  farfield bake character.obj -o character.farfield --subdivide catmull-clark\n"
      "  farfield bake cloud.vdb -o cloud.farfield --density-scale 20 --albedo 0.999 --anisotropy 0.8");
  command->callback([arguments, &action] { action = [arguments] { return run_bake(*arguments); }; });
}

}  // namespace farfield::tool
