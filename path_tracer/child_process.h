// SPDX-License-Identifier: Apache-2.0
// Another program, run for what it says on its standard output.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/job.h"
#include "base/result.h"

namespace farfield {

/// The path of the program that runs here, to run it again.
std::string this_program();

/// "exit code 2", "signal 9": what waitpid() says, for messages.
std::string how_it_ended(int status);

/// Runs a program (its path, then its arguments) and hands on each line of its standard output, without the line break,
/// from this thread; standard error stays ours, so its progress line and its error line are seen. When the job is
/// cancelled, the program is asked to stop by SIGTERM. Returns what waitpid() says of how it ended. Errors: Io (it
/// cannot be started), Cancelled.
Result<int> run_child(const std::vector<std::string>& command, const Job& job,
                      const std::function<void(std::string_view line)>& line);

}  // namespace farfield
