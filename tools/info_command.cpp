// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "base/result.h"
#include "cache/manifest.h"
#include "evaluate/source_summary.h"
#include "import/read_volume.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/fog_flags.h"
#include "tools/info_text.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/source_text.h"
#include "tools/subdivision_flags.h"
#include "tools/volume_text.h"

namespace farfield::tool {
namespace {

struct InfoArguments {
  std::string path;
  ImportOptions import;
  bool as_json = false;
};

Result<void> info_of_asset(const InfoArguments& arguments) {
  if (arguments.import.mesh >= 0 || arguments.import.node >= 0)
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: {} chooses from a glTF source, this is a folder", arguments.path,
                                  arguments.import.mesh >= 0 ? "--mesh" : "--node"));
  FARFIELD_TRY_LET(const auto manifest, read_manifest(arguments.path));
  fmt::print("{}", arguments.as_json ? info_json(arguments.path, manifest) : info_table(arguments.path, manifest));
  return {};
}

Result<void> info_of_source(const InfoArguments& arguments) {
  ProgressLine progress;
  const Job job{[&](double done, const std::string& stage) { progress.update(done, stage); }, &catch_interrupts()};
  const auto summary = summarise_source(arguments.path, arguments.import, job);
  progress.clear();
  if (!summary) return tl::unexpected(summary.error());
  // The table ends with all warnings: who reads it on a terminal need not read them twice.
  if (arguments.as_json || !stdout_is_terminal()) print_warnings("info", summary->warnings);
  fmt::print("{}", arguments.as_json ? source_json(arguments.path, *summary) : source_table(arguments.path, *summary));
  return {};
}

Result<void> info_of_volume(const InfoArguments& arguments) {
  FARFIELD_TRY_LET(const auto volume, read_volume(arguments.path, arguments.import.fog));
  if (arguments.as_json || !stdout_is_terminal()) print_warnings("info", volume.warnings);
  fmt::print("{}", arguments.as_json ? volume_json(arguments.path, volume) : volume_table(arguments.path, volume));
  return {};
}

/// What is baked is a folder; a file is what one bakes from.
Result<void> run_info(const InfoArguments& arguments) {
  std::error_code ignored;  // what cannot be looked at is refused with the file's name by info_of_asset()
  if (!std::filesystem::is_regular_file(arguments.path, ignored)) return info_of_asset(arguments);
  return is_volume_file(arguments.path) ? info_of_volume(arguments) : info_of_source(arguments);
}

}  // namespace

void add_info_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand(
      "info",
      "Show what the levels of a baked asset hold, cost and miss, or what is understood of a model before a bake");
  command
      ->add_option("path", arguments->path,
                   "Baked folder, or a model: OBJ, PLY, glTF or glb, gzipped or not; or a volume: .vdb, .nvdb")
      ->required()
      ->check(is_named);
  add_part_flags(command, arguments->import, "glTF model: only this mesh, as for bake",
                 "glTF model: only this node and those below it, as for bake");
  add_fog_flags(command, arguments->import.fog);
  add_subdivision_flags(command, arguments->import.subdivision);
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->footer("Example:\n  farfield info oak.farfield\n  farfield info oak.obj.gz");
  command->callback([arguments, &action] { action = [arguments] { return run_info(*arguments); }; });
}

}  // namespace farfield::tool
