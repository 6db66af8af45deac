// SPDX-License-Identifier: Apache-2.0
// Runs a program and catches all it says.
#pragma once

#include <string>
#include <vector>

namespace farfield {

struct ProcessOutput {
  int exit_code = -1;  ///< 128 + signal if it was killed, as shells say it
  std::string out, err;
};

/// Runs `arguments[0]` with both outputs into pipes and no input. interrupt_after_ms > 0: sends SIGINT then.
ProcessOutput run_process(const std::vector<std::string>& arguments, int interrupt_after_ms = 0);

}  // namespace farfield
