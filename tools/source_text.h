// SPDX-License-Identifier: Apache-2.0
// What `farfield info` says of a model that is not baked yet.
#pragma once

#include <string>

#include "evaluate/source_summary.h"

namespace farfield::tool {

/// A head, a table with a row per material, what looks wrong and the import's warnings. `name`: the source as the user
/// called it.
std::string source_table(const std::string& name, const SourceSummary& summary);

/// The same as JSON.
std::string source_json(const std::string& name, const SourceSummary& summary);

}  // namespace farfield::tool
