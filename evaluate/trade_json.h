// SPDX-License-Identifier: Apache-2.0
// trade.json.
#pragma once

#include <string>

#include "evaluate/trade.h"

namespace farfield {

/// The trade and its advice as JSON text (docs/trade.md, "Files"). What is unknown or not finite is null.
std::string to_json(const Trade& trade);

}  // namespace farfield
