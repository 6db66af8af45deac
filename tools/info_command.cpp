// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "base/result.h"
#include "cache/manifest.h"
#include "tools/commands.h"
#include "tools/flags.h"
#include "tools/info_text.h"

namespace farfield::tool {
namespace {

Result<void> run_info(const std::string& asset, bool as_json) {
  FARFIELD_TRY_LET(const auto manifest, read_manifest(asset));
  fmt::print("{}", as_json ? info_json(asset, manifest) : info_table(asset, manifest));
  return {};
}

}  // namespace

void add_info_command(CLI::App& app, Action& action) {
  struct Arguments {
    std::string asset;
    bool as_json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("info", "Show the levels of a baked asset: what they hold, cost and miss");
  command->add_option("asset", arguments->asset, "Baked folder")->required();
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->footer("Example:\n  farfield info oak.farfield");
  command->callback(
      [arguments, &action] { action = [arguments] { return run_info(arguments->asset, arguments->as_json); }; });
}

}  // namespace farfield::tool
