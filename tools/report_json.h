// SPDX-License-Identifier: Apache-2.0
// What `farfield bake --report` writes.
#pragma once

#include <string>

#include "bake/bake.h"

namespace farfield::tool {

/// The report as JSON text: levels with sizes and seconds, warnings, totals.
std::string bake_report_json(const BakeReport& report);

}  // namespace farfield::tool
