// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/analysis.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/subdivision_flags.h"

namespace farfield::tool {
namespace {

struct AnalyseArguments {
  AnalyseOptions options;
  std::string source, sheet, json;
  int size = 320;
  int threads = 0;
};

std::string level_table(const Analysis& analysis) {
  std::vector<std::vector<std::string>> rows = {{"level", "grid", "surface area", "surface faces", "simplified",
                                                 "sub-resolution", "side, r", "95 %", "roughness"}};
  for (const LevelAnalysis& level : analysis.levels)
    rows.push_back({fmt::format("{}", level.level), fmt::format("{}^3", level.grid),
                    fmt::format("{:.1f} %", 100 * level.macrosurface_share), fmt::format("{}", level.faces_before),
                    fmt::format("{}", level.faces), fmt::format("{}", level.sub_resolution),
                    fmt::format("{:.2f}", level.face_size.median), fmt::format("{:.2f}", level.face_size.most),
                    fmt::format("{:.3f}", level.normal_roughness)});
  return format_table(rows);
}

std::string comparison_table(const Analysis& analysis) {
  std::vector<std::vector<std::string>> rows = {
      {"grid", "vertices", "faces", "farthest, r", "rms, r", "area", "volume"}};
  for (const LevelAnalysis& level : analysis.levels)
    for (const SimplifierFigures& figures : level.simplifiers)
      rows.push_back({fmt::format("{}^3", level.grid), figures.name, fmt::format("{}", figures.faces),
                      fmt::format("{:.3f}", figures.farthest), fmt::format("{:.4f}", figures.rms),
                      fmt::format("{:+.2f} %", 100 * figures.area_change),
                      figures.volume_change ? fmt::format("{:+.2f} %", 100 * *figures.volume_change) : "open"});
  return format_table(rows);
}

std::vector<std::string> notes(const AnalyseOptions& options, const Analysis& analysis) {
  std::vector<std::string> lines = analysis.warnings;
  if (options.compare && !has_quadrics())
    lines.push_back("no quadrics are compared: this program was built without libmeshoptimizer-dev");
  return lines;
}

Result<void> run_analyse(AnalyseArguments& arguments) {
  FARFIELD_TRY(check_can_write(arguments.json, Output::Text, {arguments.source}));
  FARFIELD_TRY(check_can_write(arguments.sheet, Output::Png, {arguments.source}));
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  AnalyseOptions& options = arguments.options;
  options.source = arguments.source;
  options.cell_px = arguments.sheet.empty() ? 0 : arguments.size;
  options.bake.job = {[&](double done, const std::string& stage) { progress.update(done, stage); },
                      &catch_interrupts()};
  const auto analysis = analyse(options);
  progress.clear();
  if (!analysis) return tl::unexpected(analysis.error());
  print_warnings("analyse", notes(options, *analysis));
  if (!arguments.sheet.empty()) FARFIELD_TRY(write_png(arguments.sheet, analysis_sheet(*analysis)));
  if (!arguments.json.empty()) FARFIELD_TRY(write_text_file(arguments.json, to_json(*analysis)));
  const bool writes_files = !arguments.sheet.empty() || !arguments.json.empty();
  if (!stdout_is_terminal() && writes_files) return {};
  fmt::print("{}", level_table(*analysis));
  if (!analysis->grids_not_made.empty())
    fmt::print("not made, as they would take more than the source: {}^3\n",
               fmt::join(analysis->grids_not_made, "^3, "));
  if (options.compare) fmt::print("\n{}", comparison_table(*analysis));
  return {};
}

}  // namespace

void add_analyse_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<AnalyseArguments>();
  AnalyseOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand(
      "analyse", "Show what a bake would decide about a model: surface or voxels, sizes of faces, roughness");
  command->add_option("source", arguments->source, "Model: OBJ, PLY, glTF or glb, gzipped or not")
      ->required()
      ->check(is_named);
  command->add_option("-o,--output", arguments->sheet,
                      "Write a sheet as PNG, one row per level: macrosurface and sub-resolution geometry, longest side "
                      "of the simplified faces, roughness of their normals");
  command->add_option("--json", arguments->json, "Write the figures as JSON");
  command->add_flag("--compare", options.compare,
                    "Hold each level's simplification against others in as many faces: two-sided distance, area, "
                    "volume");
  command->add_option("--finest-grid", options.bake.finest_grid, "As of bake")->capture_default_str();
  command->add_option("--coarsest-grid", options.bake.coarsest_grid, "As of bake")->capture_default_str();
  add_part_flags(command, options.bake.import, "glTF: only this mesh, in its own space",
                 "glTF: only what this node and those below it show");
  add_subdivision_flags(command, options.bake.import.subdivision);
  add_simplify_flag(command, options.bake.simplify);
  command->add_option("--view", options.view, "Number of one of the twelve directions of evaluate, 0 to 11")
      ->check(CLI::Range(0, 11))
      ->capture_default_str();
  command->add_option("--size", arguments->size, "Longest side of each picture, in pixels")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->footer("Example:\n  farfield analyse oak.obj.gz -o oak.png --finest-grid 128 --json oak.json");
  command->callback([arguments, &action] { action = [arguments] { return run_analyse(*arguments); }; });
}

}  // namespace farfield::tool
