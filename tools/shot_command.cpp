// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/shot_job.h"

#include <fmt/format.h>

#include "base/bytes.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/memory_pools.h"
#include "tools/render_flags.h"
#include "tools/use_text.h"

namespace farfield::tool {
namespace {

struct ShotArguments : RenderArguments {
  FrameRange frames;
  int parent = 0;  // process that started this one for itself; 0: nobody did
};

Result<void> run_shot(ShotArguments& arguments) {
  use_one_memory_pool();
  const RenderTask task = [&](const RenderOptions& options) {
    return render_shot(options, arguments.frames, arguments.output);
  };
  const auto report = arguments.parent == 0 ? run_with_progress("shot", arguments, task)
                                            : run_for_parent(arguments, arguments.parent, task);
  if (!report) return tl::unexpected(report.error());
  if (stdout_is_terminal())
    fmt::print("{}: {} frames, {} of {} for assets\n", arguments.output, report->frames.size(),
               format_bytes(report->peak_accounted_bytes), format_bytes(report->budget_bytes));
  if (arguments.with_stats) fmt::print("{}", use_table(*report));
  return {};
}

}  // namespace

void add_shot_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ShotArguments>();
  CLI::App* command =
      app.add_subcommand("shot", "Render a range of frames within one memory budget; keeps finished frames");
  add_picture_flags(command, *arguments, "Folder for the frames, shot.json and the contact sheet");
  add_level_flags(command, arguments->options);
  add_parsed_option(command, "--frames", arguments->frames, parse_frame_range, "A-B[:STEP]")->required();
  command->add_option("--parent", arguments->parent, "Process to end with")->group("");  // for trade
  add_stats_flag(command, *arguments);
  command->footer(
      "Example:\n  farfield shot forest.glb --frames 0-120:10 --size 640x360 --spp 48 --budget 500M -o shot");
  command->callback([arguments, &action] { action = [arguments] { return run_shot(*arguments); }; });
}

}  // namespace farfield::tool
