// SPDX-License-Identifier: Apache-2.0
// What levels did in a render: the table of --stats.
#pragma once

#include <string>

#include "path_tracer/render_job.h"

namespace farfield::tool {

/// A line per level that any frame used: loads and their seconds, bytes, hits of rays, how often a coarser level had to
/// serve; and per asset how many levels the budget took at most. Of all frames of the report.
std::string use_table(const RenderReport& report);

}  // namespace farfield::tool
