// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "bake/bake.h"
#include "base/bytes.h"
#include "base/parallel.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/report_json.h"

namespace farfield::tool {
namespace {

struct BakeArguments {
  std::string source, output, report;
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

Result<void> run_bake(BakeArguments& arguments) {
  if (auto writable = check_can_write(arguments.report, Output::Text, {arguments.source, arguments.output}); !writable)
    return writable;
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  arguments.options.job = {[&](double done, const std::string& stage) { progress.update(done, stage); },
                           &catch_interrupts()};

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
  CLI::App* command =
      app.add_subcommand("bake", "Bake a model to a folder of levels; goes on where an interrupted bake stopped");
  command->add_option("source", arguments->source, "Model: OBJ, PLY, glTF or glb, gzipped or not")
      ->required()
      ->check(is_named);
  command->add_option("-o,--output", arguments->output, "Folder to write, by convention NAME.farfield")
      ->required()
      ->check(is_named);
  command->add_option("--finest-grid", options.finest_grid, "Voxels along the longest side of level 1, a power of two")
      ->capture_default_str();
  command->add_option("--coarsest-grid", options.coarsest_grid, "The same of the last level, the root")
      ->capture_default_str();
  command->add_option("--rays-per-voxel", options.rays_per_voxel, "Rays that measure each voxel's occlusion")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--mesh", options.import.mesh, "glTF: bake only this mesh, in its own space")
      ->check(CLI::Range(0, 1 << 20));
  command->add_flag("--source-only", options.source_only, "Write level 0 only: the source, ready to render");
  command->add_option("--threads", arguments->threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("!--no-warnings", arguments->warnings,
                    "Leave what was ignored or guessed to the manifest, as render does, which says it itself");
  command->add_option("--report", arguments->report, "Write what was done, with seconds per stage, as JSON");
  command->footer("Example:\n  farfield bake oak.obj.gz -o oak.farfield --finest-grid 512");
  command->callback([arguments, &action] { action = [arguments] { return run_bake(*arguments); }; });
}

}  // namespace farfield::tool
