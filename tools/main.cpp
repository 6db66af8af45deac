// SPDX-License-Identifier: Apache-2.0
// The `farfield` command: parses, runs one command, and says in one line what went wrong.
// Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "tools/commands.h"
#include "tools/console.h"

namespace {

using namespace farfield;

constexpr int kFailed = 1, kWrongUsage = 2, kInterrupted = 130;

std::string name_of_command(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? "farfield" : "farfield " + chosen.front()->get_name();
}

int run(int argc, char** argv) {
  CLI::App app("Farfield bakes assets to levels of detail, checks them, and renders scenes of them.");
  app.footer("Example:\n  farfield bake oak.obj -o oak.farfield && farfield info oak.farfield");
  app.set_version_flag("--version", "farfield " FARFIELD_VERSION);
  app.require_subcommand(1);
  tool::Action action;
  tool::add_bake_command(app, action);
  tool::add_info_command(app, action);
  tool::add_verify_command(app, action);
  tool::add_evaluate_command(app, action);
  tool::add_render_command(app, action);
  tool::add_shot_command(app, action);
  tool::add_sky_command(app, action);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const std::string name = name_of_command(app);
    fmt::print(stderr, "{}: {} (see {} --help)\n", name, tool::one_line(error.what()), name);
    return kWrongUsage;
  }

  const Result<void> result = action();
  if (result) return 0;
  const bool is_interrupted = result.error().code == ErrorCode::Cancelled;
  fmt::print(stderr, "{}: {}\n", name_of_command(app),
             is_interrupted ? "interrupted" : tool::one_line(result.error().message));
  return is_interrupted ? kInterrupted : kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int code = run(argc, argv);
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
    fmt::print(stderr, "farfield: cannot write to standard output\n");
    return kFailed;
  } catch (const std::exception& error) {  // out of memory, a full stdout: what no Result speaks of
    fmt::print(stderr, "farfield: {}\n", tool::one_line(error.what()));
    return kFailed;
  }
}
