// SPDX-License-Identifier: Apache-2.0
// Runs a program and catches all it says.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace farfield {

struct ProcessOutput {
  int exit_code = -1;  ///< 128 + signal if it was killed, as shells say it
  std::string out, err;
};

/// Runs `arguments[0]` with both outputs into pipes and no input. Once `interrupt_when` (polled, may be empty) says so,
/// the process gets one SIGINT.
ProcessOutput run_process(const std::vector<std::string>& arguments, const std::function<bool()>& interrupt_when = {});

}  // namespace farfield
