// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "base/bytes.h"
#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/figure_text.h"
#include "evaluate/trade.h"
#include "evaluate/trade_advice.h"
#include "evaluate/trade_json.h"
#include "evaluate/trade_page.h"
#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/render_flags.h"

namespace farfield::tool {
namespace {

namespace fs = std::filesystem;

struct TradeArguments : RenderArguments {
  TradeOptions trade;
};

std::string summary_table(const Trade& trade) {
  std::vector<std::vector<std::string>> rows = {{"setting", "error per pixel", "CPU", "noise", "memory"}};
  const double full_seconds = summary_of(trade, 0).cpu_seconds;
  for (size_t row = 0; row < trade.rows.size(); ++row) {
    const TradeSummary summary = summary_of(trade, row);
    rows.push_back({trade.rows[row].setting.label, row == 0 ? "" : size_text(summary.error),
                    fmt::format("{:.2f}", full_seconds > 0 ? summary.cpu_seconds / full_seconds : 0.0),
                    fmt::format("{:.2f}", summary.noise), format_bytes(summary.memory_bytes)});
  }
  return format_table(rows);
}

void print_summary(const Trade& trade, const fs::path& page) {
  fmt::print("{}\n", summary_table(trade));
  for (const TradeAdvice& advice : advise(trade)) fmt::print("{}: {}\n", advice.wish, advice.text);
  fmt::print("{}\n", page.string());
}

Result<void> check_is_there(const fs::path& scene) {
  std::error_code error;
  if (fs::exists(scene, error)) return {};
  return make_error(ErrorCode::NotFound, fmt::format("{}: no such file", scene.string()));
}

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) return {};
  return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}", folder.string(), error.message()));
}

Result<void> write_trade(const Trade& trade, const fs::path& folder) {
  FARFIELD_TRY_LET(const auto pictures, trade_pictures(trade, folder));
  FARFIELD_TRY(write_text_file(folder / "trade.html", trade_page(trade, pictures)));
  return write_text_file(folder / "trade.json", to_json(trade));
}

Result<void> run_trade(TradeArguments& arguments) {
  const ThreadLimit limit(arguments.threads);
  ProgressLine progress;
  TradeOptions& options = arguments.trade;
  set_files(arguments);
  options.render = arguments.options;
  options.render.job = {[&](double done, const std::string& stage) { progress.update(done, stage); },
                        &catch_interrupts()};
  options.render.warning = [&](const std::string& line) {
    progress.clear();
    print_warnings("trade", {line});
  };
  options.output = arguments.output;
  FARFIELD_TRY(check_is_there(options.render.scene));  // before a folder is made
  FARFIELD_TRY(make_folder(options.output));
  FARFIELD_TRY_LET(const auto trade, measure_trade(options));
  FARFIELD_TRY(write_trade(trade, options.output));
  progress.clear();
  if (stdout_is_terminal()) print_summary(trade, options.output / "trade.html");
  return {};
}

/// A knob: its first value is where it stands while the others are turned.
template <typename T>
void add_knob(CLI::App* command, const std::string& flag, std::vector<T>& values, Result<T> (*parse)(std::string_view),
              const std::string& help, const std::string& shown_default) {
  const auto parse_all = [parse](const std::string& text) { return parse_list<T>(text, parse); };
  add_parsed_option(command, flag, values, parse_all, help)->default_str(shown_default);
}

}  // namespace

void add_trade_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<TradeArguments>();
  TradeKnobs& knobs = arguments->trade.knobs;
  CLI::App* command = app.add_subcommand(
      "trade", "Measure what each knob brings and costs in a shot, against full detail; keeps finished renders");
  add_picture_flags(command, *arguments, "Folder for trade.html, trade.json and the renders");
  add_parsed_option(command, "--frames", arguments->trade.frames, parse_frame_range, "A-B[:STEP]")->required();
  add_knob(command, "--pixel-error", knobs.pixel_error, parse_pixel_error,
           "Values to try, of all knobs with commas between; at the first it stands while others are turned",
           "1,0.5,2,4");
  add_knob(command, "--budget", knobs.budget_bytes, parse_budget, "Memory for assets, e.g. 2G,300M,100M", "4G");
  add_knob(command, "--rays-per-voxel", knobs.rays_per_voxel, parse_rays_per_voxel,
           "Of the bake; assets of other than the first value are baked into the folder", "200");
  add_knob(command, "--finest-grid", knobs.finest_grid, parse_finest_grid, "The same", "512");
  command->add_flag("!--no-turned-sun", arguments->trade.turn_sun,
                    "Only the scene's own light, not also with the sun from the opposite side");
  command->footer(
      "Example:\n  farfield trade forest.glb --frames 0-120:40 --size 320x180 --budget 2G,200M,50M -o trade");
  command->callback([arguments, &action] { action = [arguments] { return run_trade(*arguments); }; });
}

}  // namespace farfield::tool
