// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/evaluate.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace farfield::tool {
namespace {

struct EvaluateArguments {
  EvaluateOptions options;
  std::string asset, source, json, sheet, images;
  LevelRange levels{1, 1000};
  int threads = 0;

  bool writes_files() const { return !json.empty() || !sheet.empty() || !images.empty(); }
};

std::string with_error(const Estimate& estimate, bool is_signed) {
  return is_signed ? fmt::format("{:+.2f} +- {:.2f} %", 100 * estimate.value, 100 * estimate.standard_error)
                   : fmt::format("{:.2f} +- {:.2f} %", 100 * estimate.value, 100 * estimate.standard_error);
}

std::string evaluation_table(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows = {
      {"level", "grid", "occlusion", "rms", "color", "bias red", "bias green", "bias blue", "noise", "spp"}};
  for (const LevelEvaluation& level : evaluation.levels) {
    const ErrorMetrics& e = level.errors;
    rows.push_back({fmt::format("{}", level.entry.level), fmt::format("{}^3", level.entry.grid),
                    with_error(e.occlusion_error, true), with_error(e.occlusion_rms, false),
                    e.color_error_low > 0 ? with_error(e.color_error, false) : "lost in noise: raise --spp",
                    with_error(e.color_bias[0], true), with_error(e.color_bias[1], true),
                    with_error(e.color_bias[2], true), fmt::format("{:.2f} %", 100 * e.color_noise),
                    fmt::format("{}", level.samples_per_pixel)});
  }
  return format_table(rows);
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
  if (stdout_is_terminal() || !arguments.writes_files()) fmt::print("{}", evaluation_table(*evaluation));
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
  command->add_option("--mesh", options.import.mesh, "glTF: the mesh that was baked")->check(CLI::Range(0, 1 << 20));
  command->add_flag("--other-source", options.other_source,
                    "Compare with a model that it was not baked from, too; then no errors are kept");
  add_parsed_option(command, "--levels", arguments->levels, parse_level_range,
                    "Levels A-B; without it all but the source");
  command->add_option("--views", options.views, "Pictures per level")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--spp", options.samples_per_pixel,
                   "Samples per pixel, rounded up to four; without it more for smaller pictures")
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
