// SPDX-License-Identifier: Apache-2.0
// A shot rendered by `farfield shot` in a process of its own, so that each setting meets the same conditions: nothing
// loaded, nothing cached, no memory that another has left.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "path_tracer/render_job.h"
#include "path_tracer/shot_job.h"

namespace farfield {

/// The command that renders a shot as render_shot(options, frames, out) does. It ends with this process and reports its
/// progress in lines "progress DONE STAGE".
std::vector<std::string> shot_command(const std::string& program, const RenderOptions& options,
                                      const FrameRange& frames, const std::filesystem::path& out);

/// Runs that command; progress and cancelling go by `job`. Returns the shot's report. Errors: Io (it cannot be
/// started), BadFile (it failed: it has said why on standard error; or left no record), Cancelled.
Result<RenderReport> run_shot(const std::string& program, const RenderOptions& options, const FrameRange& frames,
                              const std::filesystem::path& out, const Job& job);

}  // namespace farfield
