// SPDX-License-Identifier: Apache-2.0
// The commands, each in its own .cpp (CLI11 is slow to compile).
#pragma once

#include <functional>

#include "base/result.h"

namespace CLI {
class App;
}

namespace farfield::tool {

/// What the chosen command does once its arguments are parsed. Its error becomes the one line on standard error.
using Action = std::function<Result<void>()>;

/// Each adds its command to `app`; when the command is the one on the command line, `action` is set.
void add_bake_command(CLI::App& app, Action& action);
void add_info_command(CLI::App& app, Action& action);
void add_analyse_command(CLI::App& app, Action& action);
void add_verify_command(CLI::App& app, Action& action);
void add_evaluate_command(CLI::App& app, Action& action);
void add_export_command(CLI::App& app, Action& action);
void add_render_command(CLI::App& app, Action& action);
void add_shot_command(CLI::App& app, Action& action);
void add_trade_command(CLI::App& app, Action& action);
void add_sky_command(CLI::App& app, Action& action);
void add_why_command(CLI::App& app, Action& action);

}  // namespace farfield::tool
