// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "base/bytes.h"
#include "export/export_asset.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/report_json.h"

namespace farfield::tool {
namespace {

struct ExportArguments {
  std::string asset, output, report;
  ExportOptions options;
};

std::string text_of(const ExportedLevel& level) {
  if (level.grids.empty())
    return fmt::format("level {}: {} faces, {} vertices", level.level, level.faces, level.vertices);
  return fmt::format("level {}: {} voxels, {}", level.level, level.voxels, fmt::join(level.grids, ", "));
}

void print_summary(const ExportArguments& arguments, const ExportReport& report) {
  for (const std::filesystem::path& file : files_of_export(arguments.output)) {
    std::error_code ignored;  // somebody may have taken it away already
    fmt::print("{}: {}\n", file.string(), format_bytes(std::filesystem::file_size(file, ignored)));
  }
  for (const ExportedLevel& level : report.levels) fmt::print("  {}\n", text_of(level));
}

Result<void> run_export(const ExportArguments& arguments) {
  FARFIELD_TRY(export_format_of(arguments.output));
  for (const std::filesystem::path& file : files_of_export(arguments.output))
    FARFIELD_TRY(check_can_write(file, Output::File, {arguments.asset}));
  FARFIELD_TRY(check_can_write(arguments.report, Output::Text, {arguments.asset, arguments.output}));
  ProgressLine progress;
  const Job job{[&](double done, const std::string& stage) { progress.update(done, stage); }, &catch_interrupts()};
  const auto report = export_asset(arguments.asset, arguments.output, arguments.options, job);
  progress.clear();
  if (!report) return tl::unexpected(report.error());
  print_warnings("export", report->notes, report->notes.size());  // each is said once
  if (stdout_is_terminal()) print_summary(arguments, *report);
  if (arguments.report.empty()) return {};
  return write_text_file(arguments.report, export_report_json(arguments.asset, arguments.output, *report));
}

}  // namespace

void add_export_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand(
      "export", "Write levels of a baked asset for other programs: volumes as OpenVDB, surfaces as OBJ, PLY or glb");
  command->add_option("asset", arguments->asset, "Baked folder")->required()->check(is_named);
  add_parsed_option(command, "--level", arguments->options.levels, parse_levels,
                    "Level to write; a .vdb also takes several, 2,3,4, or all")
      ->required();
  command->add_option("-o,--output", arguments->output, "File to write, named .vdb, .obj, .ply or .glb")
      ->required()
      ->check(is_named);
  command->add_option("--report", arguments->report, "Write what was exported as JSON");
  command->footer(
      "Example:\n  farfield export cloud.farfield --level all -o cloud_levels.vdb\n"
      "  farfield export oak.farfield --level 3 -o oak_3.glb");
  command->callback([arguments, &action] { action = [arguments] { return run_export(*arguments); }; });
}

}  // namespace farfield::tool
