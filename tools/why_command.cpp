// SPDX-License-Identifier: Apache-2.0
// `farfield why`: explains one pixel of a frame.
#include <fmt/format.h>

#include "tools/args.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"
#include "tools/memory_pools.h"
#include "tools/render_flags.h"
#include "tools/why_text.h"

namespace farfield::tool {
namespace {

struct WhyArguments : RenderArguments {
  int frame = 0;
  PixelPlace pixel;
  bool as_json = false;
};

Result<void> run_why(WhyArguments& arguments) {
  use_one_memory_pool();
  PixelReport seen;
  const auto done = run_with_progress("why", arguments, [&](const RenderOptions& options) -> Result<RenderReport> {
    FARFIELD_TRY_LET(seen, explain_pixel(options, arguments.frame, arguments.pixel.x, arguments.pixel.y));
    return RenderReport();
  });
  if (!done) return tl::unexpected(done.error());
  fmt::print("{}", arguments.as_json ? pixel_json(seen) : pixel_text(seen));
  return {};
}

}  // namespace

void add_why_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<WhyArguments>();
  CLI::App* command = app.add_subcommand(
      "why", "Explain a pixel of a frame: which instances and levels it shows, and why nothing finer");
  add_picture_flags(command, *arguments, "");
  add_level_flags(command, arguments->options);
  add_frame_flag(command, arguments->frame);
  add_parsed_option(command, "--pixel", arguments->pixel, parse_pixel_place,
                    "X,Y from the picture's upper left corner, which is 0,0")
      ->required();
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->footer(
      "Give the flags that the frame was rendered with.\n"
      "Example:\n  farfield why forest.glb --frame 60 --size 960x540 --budget 2G --pixel 480,270");
  command->callback([arguments, &action] { action = [arguments] { return run_why(*arguments); }; });
}

}  // namespace farfield::tool
