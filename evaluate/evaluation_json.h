// SPDX-License-Identifier: Apache-2.0
// What `farfield evaluate --json` writes.
#pragma once

#include <string>

#include "evaluate/evaluate.h"

namespace farfield {

/// The evaluation as JSON text (docs/error_metric.md, "Files"). What is unknown or not finite is null.
std::string to_json(const Evaluation& evaluation);

}  // namespace farfield
