// SPDX-License-Identifier: Apache-2.0
// What a budget costs, in a line.
#pragma once

#include <optional>
#include <string>

#include "path_tracer/render_job.h"

namespace farfield {

/// "the budget of 1.70 MiB makes levels coarser than asked in 3 of 5 frames; at most, in frame 0: oak by 3.2 levels,
/// ground by 1.0; 4.20 MiB would do". Nothing if no frame gave anything up.
std::optional<std::string> budget_notice(const RenderReport& report);
/// "the budget of 1.70 MiB has no room for 2 morphs in frame 3: those levels dissolve; in 1 of 5 frames". Nothing if
/// there was room for all.
std::optional<std::string> morph_notice(const RenderReport& report);

}  // namespace farfield
