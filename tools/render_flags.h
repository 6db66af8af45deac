// SPDX-License-Identifier: Apache-2.0
// What `farfield render` and `farfield shot` have in common.
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
};

/// Adds the scene, the common flags and -o (with `output_help`).
void add_render_flags(CLI::App* command, RenderArguments& arguments, const std::string& output_help);

/// Runs `job` as `command` ("render", "shot") with the parsed options, progress on a terminal, and Ctrl-C; prints
/// messages of the job when a person reads them.
Result<RenderReport> run_with_progress(std::string_view command, RenderArguments& arguments,
                                       const std::function<Result<RenderReport>(const RenderOptions&)>& job);

}  // namespace farfield::tool
