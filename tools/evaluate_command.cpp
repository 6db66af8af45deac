// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/evaluate.h"
#include "evaluate/evaluation_json.h"
#include "evaluate/figure_text.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/fog_flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/subdivision_flags.h"

namespace farfield::tool {
namespace {

struct EvaluateArguments {
  EvaluateOptions options;
  std::string asset, source, json, sheet, images;
  LevelRange levels{1, 1000};
  int threads = 0;

  bool writes_files() const { return !json.empty() || !sheet.empty() || !images.empty(); }
};

std::string bias_text(const std::array<Estimate, 3>& bias) {
  double deviation = 0;
  for (const Estimate& channel : bias) deviation = std::max(deviation, channel.standard_error);
  return fmt::format("{:+.2f} {:+.2f} {:+.2f} +- {:.2f} %", 100 * bias[0].value, 100 * bias[1].value,
                     100 * bias[2].value, 100 * deviation);
}

/// Coverage and depth: one row per level.
std::string shape_table(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows = {{"level", "grid", "occlusion", "worst view", "rms", "touched", "2x2",
                                                 "4x4", "depth", "depth moved", "inside hits", "spp"}};
  for (const LevelEvaluation& level : evaluation.levels) {
    const ErrorMetrics& e = level.errors;
    const Estimate& worst = level.views[level.worst_view].occlusion_error;
    rows.push_back({fmt::format("{}", level.entry.level), fmt::format("{}^3", level.entry.grid),
                    estimate_text(e.occlusion_error), fmt::format("{}: {:+.2f} %", level.worst_view, 100 * worst.value),
                    size_text(e.occlusion_rms), size_text(e.occlusion_rms_touched[0]),
                    size_text(e.occlusion_rms_touched[1]), size_text(e.occlusion_rms_touched[2]),
                    estimate_text(level.depth.camera.mean), size_text(level.depth.camera.distance),
                    estimate_text(level.depth.inside_hits), fmt::format("{}", level.samples_per_pixel)});
  }
  return format_table(rows);
}

/// Colour: one row per level and light.
std::string color_table(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows = {
      {"level", "grid", "light", "occlusion", "bias red, green, blue", "worst view", "color", "rms", "2x2", "4x4"}};
  for (const LevelEvaluation& level : evaluation.levels)
    for (const LightEvaluation& light : level.lights) {
      const ErrorMetrics& e = light.errors;
      const Estimate worst = light.views[light.worst_view].largest_color_bias();
      rows.push_back({fmt::format("{}", level.entry.level), fmt::format("{}^3", level.entry.grid),
                      std::string(name_of(light.light)), estimate_text(e.occlusion_error), bias_text(e.color_bias),
                      fmt::format("{}: {:+.2f} %", light.worst_view, 100 * worst.value), size_text(e.color_error),
                      size_text(e.color_rms[0]), size_text(e.color_rms[1]), size_text(e.color_rms[2])});
    }
  return format_table(rows);
}

std::string evaluation_tables(const Evaluation& evaluation) {
  return shape_table(evaluation) + "\n" + color_table(evaluation);
}

Result<void> run_evaluate(EvaluateArguments& arguments) {
  const std::vector<std::filesystem::path> inputs = {arguments.source, arguments.asset};
  FARFIELD_TRY(check_can_write(arguments.json, Output::Text, inputs));
  FARFIELD_TRY(check_can_write(arguments.sheet, Output::Png, inputs));
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  EvaluateOptions& options = arguments.options;
  options.asset = arguments.asset;
  options.source = arguments.source;
  options.sheet = arguments.sheet;
  options.images = arguments.images;
  options.first_level = arguments.levels.first;
  options.last_level = arguments.levels.last;
  options.job = {[&](double done, const std::string& stage) { progress.update(done, stage); }, &catch_interrupts()};

  const auto evaluation = evaluate(options);
  progress.clear();
  if (!evaluation) return tl::unexpected(evaluation.error());
  print_warnings("evaluate", evaluation->warnings);
  if (stdout_is_terminal() || !arguments.writes_files()) fmt::print("{}", evaluation_tables(*evaluation));
  return arguments.json.empty() ? Result<void>() : write_text_file(arguments.json, to_json(*evaluation));
}

}  // namespace

void add_evaluate_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<EvaluateArguments>();
  EvaluateOptions& options = arguments->options;
  CLI::App* command =
      app.add_subcommand("evaluate", "Measure how far the levels of a baked asset look from their source");
  command->add_option("asset", arguments->asset, "Baked folder; keeps the errors, for `farfield info`")
      ->required()
      ->check(is_named);
  command->add_option("--source", arguments->source, "The model it was baked from")->required()->check(is_named);
  add_part_flags(command, options.import, "glTF: the mesh that was baked",
                 "glTF: the node that was baked with all below it");
  add_fog_flags(command, options.import.fog);
  add_subdivision_flags(command, options.import.subdivision);
  command->add_flag("--other-source", options.other_source,
                    "Compare with a model that it was not baked from, too; then no errors are kept");
  add_parsed_option(command, "--levels", arguments->levels, parse_level_range,
                    "Levels A-B; without it all but the source");
  add_parsed_option(command, "--lights", options.lights, parse_lights,
                    "Of daylight,front,behind,above,sky; without it all. Only daylight's colour is kept in the asset");
  command->add_option("--views", options.views, "Pictures per level and light")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--spp", options.samples_per_pixel,
                   "Samples per pixel and light, rounded up to four; without it more for smaller pictures")
      ->check(CLI::Range(1, 1 << 20));
  command->add_option("--seed", options.seed, "Of the random numbers");
  command->add_option("--threads", arguments->threads, "0: as many as the machine has")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_option("--json", arguments->json, "Write the figures as JSON");
  command->add_option("--sheet", arguments->sheet, "Write a contact sheet: source, level, difference, as PNG");
  command->add_option("--images", arguments->images, "Folder for every picture and the light as EXR");
  command->footer(
      "Example:\n  farfield evaluate oak.farfield --source oak.obj.gz --levels 2-5 --json oak.json --sheet oak.png");
  command->callback([arguments, &action] { action = [arguments] { return run_evaluate(*arguments); }; });
}

}  // namespace farfield::tool
