// SPDX-License-Identifier: Apache-2.0
#include "bake/measure_levels.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/bytes.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"

namespace farfield::tool {
namespace {

Result<void> run_verify(const std::string& asset) {
  std::error_code error;
  if (!std::filesystem::is_directory(asset, error))
    return make_error(ErrorCode::NotFound, fmt::format("{}: there is no such folder", asset));
  const VerifyResult result = verify_and_measure_asset(asset);
  for (const Finding& finding : result.findings)
    fmt::print("{}: {}\n", finding.severity == Finding::Severity::Error ? "error" : "warning",
               one_line(finding.message));
  if (!result.is_sound()) {
    const auto errors = std::count_if(result.findings.begin(), result.findings.end(), [](const Finding& finding) {
      return finding.severity == Finding::Severity::Error;
    });
    return make_error(ErrorCode::BadFile,
                      fmt::format("{}: broken, {} error{}; bake it again", asset, errors, errors == 1 ? "" : "s"));
  }
  if (stdout_is_terminal())
    fmt::print("{}: sound, {} levels, {} checked\n", asset, result.levels_checked, format_bytes(result.bytes_checked));
  return {};
}

}  // namespace

void add_verify_command(CLI::App& app, Action& action) {
  auto asset = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("verify", "Check every byte of a baked asset; exit code 1 if it is broken");
  command->add_option("asset", *asset, "Baked folder")->required();
  command->footer("Example:\n  farfield verify oak.farfield");
  command->callback([asset, &action] { action = [asset] { return run_verify(*asset); }; });
}

}  // namespace farfield::tool
