// SPDX-License-Identifier: Apache-2.0
// The `farfield` command: parses, runs one command, and says in one line what went wrong.
// Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/suggest.h"

namespace {

using namespace farfield;

constexpr int kFailed = 1, kWrongUsage = 2, kInterrupted = 130;

std::string name_of_command(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? "farfield" : "farfield " + chosen.front()->get_name();
}

std::vector<std::string> names_of_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

bool looks_like_option(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

std::string unknown(std::string_view word, std::string_view what, std::span<const std::string> known) {
  const auto meant = tool::nearest_name(word, known);
  return fmt::format("{}: unknown {}{}", word, what, meant ? fmt::format("; did you mean {}?", *meant) : "");
}

// What is wrong with the command line. An unknown word comes before what the parser says: it is the reason that a value
// stands in the wrong place, or that something is missing.
std::string what_is_wrong(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  std::vector<std::string> not_understood = app.remaining(true);
  not_understood.erase(std::ranges::find(not_understood, "--"), not_understood.end());  // no options behind it
  const auto option = std::ranges::find_if(not_understood, looks_like_option);
  if (chosen.empty() && !not_understood.empty() && option != not_understood.begin())
    return unknown(not_understood.front(), "command", names_of_commands(app));
  if (option != not_understood.end())
    return unknown(option->substr(0, option->find('=')), "option", names_of_options(command));
  return error.what();
}

int run(int argc, char** argv) {
  CLI::App app("Farfield bakes assets to levels of detail, checks them, and renders scenes of them.");
  app.footer("Example:\n  farfield bake oak.obj -o oak.farfield && farfield info oak.farfield");
  app.set_version_flag("--version", "farfield " FARFIELD_VERSION);
  app.require_subcommand(1);
  tool::Action action;
  tool::add_bake_command(app, action);
  tool::add_info_command(app, action);
  tool::add_analyse_command(app, action);
  tool::add_verify_command(app, action);
  tool::add_evaluate_command(app, action);
  tool::add_export_command(app, action);
  tool::add_render_command(app, action);
  tool::add_shot_command(app, action);
  tool::add_trade_command(app, action);
  tool::add_why_command(app, action);
  tool::add_sky_command(app, action);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const std::string name = name_of_command(app);
    fmt::print(stderr, "{}: {} (see {} --help)\n", name, tool::one_line(what_is_wrong(app, error)), name);
    return kWrongUsage;
  }

  const Result<void> result = action();
  if (result) return 0;
  tool::print_warnings(app.get_subcommands().front()->get_name(), result.error().warnings);
  const bool is_interrupted = result.error().code == ErrorCode::Cancelled;
  if (is_interrupted && result.error().message.empty()) return kInterrupted;  // somebody else says it
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
