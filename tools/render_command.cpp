// SPDX-License-Identifier: Apache-2.0
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

struct FrameArguments : RenderArguments {
  int frame = 0;
};

Result<void> run_render(FrameArguments& arguments) {
  use_one_memory_pool();
  if (auto writable =
          check_can_write(arguments.output, Output::Exr, {arguments.scene, arguments.environment, arguments.assets});
      !writable)
    return writable;
  const auto report = run_with_progress("render", arguments, [&](const RenderOptions& options) {
    return render_frame(options, arguments.frame, arguments.output);
  });
  if (!report) return tl::unexpected(report.error());
  if (stdout_is_terminal() && !report->frames.empty())
    fmt::print("{}: {:.1f} s, {} of {} for assets\n", arguments.output, report->frames.back().seconds,
               format_bytes(report->peak_accounted_bytes), format_bytes(report->budget_bytes));
  if (arguments.with_stats) fmt::print("{}", use_table(*report));
  return {};
}

}  // namespace

void add_render_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<FrameArguments>();
  CLI::App* command =
      app.add_subcommand("render", "Render one frame of a glTF scene; bakes its meshes first if need be");
  add_picture_flags(command, *arguments, "EXR file to write; a PNG preview goes beside it");
  add_level_flags(command, arguments->options);
  add_frame_flag(command, arguments->frame);
  add_stats_flag(command, *arguments);
  command->footer(
      "Example:\n  farfield render forest.glb --frame 60 --size 960x540 --spp 64 --budget 2G -o forest.exr");
  command->callback([arguments, &action] { action = [arguments] { return run_render(*arguments); }; });
}

}  // namespace farfield::tool
