// SPDX-License-Identifier: Apache-2.0
#include "cache/verify.h"

#include <fmt/format.h>

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"

namespace farfield::tool {
namespace {

Result<void> run_verify(const std::string& asset) { return make_error(ErrorCode::Io, ""); }

}  // namespace

void add_verify_command(CLI::App& app, Action& action) {
  auto asset = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("verify", "Check every byte of a baked asset; exit code 1 if it is broken");
  command->add_option("asset", *asset, "Baked folder")->required();
  command->footer("Example:\n  farfield verify oak.farfield");
  command->callback([asset, &action] { action = [asset] { return run_verify(*asset); }; });
}

}  // namespace farfield::tool
