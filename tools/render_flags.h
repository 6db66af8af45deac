// SPDX-License-Identifier: Apache-2.0
// What `farfield render`, `farfield shot` and `farfield trade` have in common.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "path_tracer/render_job.h"

namespace CLI {
class App;
}

namespace farfield::tool {

struct RenderArguments {
  RenderOptions options;
  std::string scene, assets, environment, output;
  int threads = 0;
  bool with_stats = false;  ///< print what levels did at the end
};

/// Adds the scene, -o (with `output_help`; none where that is empty) and what the picture is of: size, samples, light,
/// camera, assets.
void add_picture_flags(CLI::App* command, RenderArguments& arguments, const std::string& output_help);
/// Adds how coarse levels are, by budget, pixel error and bake, where the sun stands, and what else is written.
void add_level_flags(CLI::App* command, RenderOptions& options);

/// Adds --frame of commands about one frame.
void add_frame_flag(CLI::App* command, int& frame);
/// Adds --stats of commands that render.
void add_stats_flag(CLI::App* command, RenderArguments& arguments);

/// Puts the files that the flags named into the options.
void set_files(RenderArguments& arguments);

using RenderTask = std::function<Result<RenderReport>(const RenderOptions&)>;

/// Runs `task` as `command` ("render", "shot") with the parsed options, progress on a terminal, and Ctrl-C; prints
/// messages of the task when a person reads them.
Result<RenderReport> run_with_progress(std::string_view command, RenderArguments& arguments, const RenderTask& task);

/// The same for `farfield trade`, the process `parent`, whose end is the end of this one: progress comes as lines on
/// standard output, warnings are left to shot.json unless the task fails, and a cancelled task has no message.
Result<RenderReport> run_for_parent(RenderArguments& arguments, int parent, const RenderTask& task);

}  // namespace farfield::tool
