// SPDX-License-Identifier: Apache-2.0
// Figures as people read them: percent, and words for what is unknown. Never "0.00 %" for what is not exactly 0.
#pragma once

#include <string>

#include "cache/manifest.h"
#include "evaluate/estimate.h"

namespace farfield {

/// "5.31 %"; "<0.01 %" below what two digits show; "unknown, 0.10 to 0.35 %" or "unknown, at most 0.35 %".
std::string size_text(const ErrorSize& size);
std::string size_text(const Bounded& size);

/// "+1.20 +- 0.03 %": signed, with its standard error, which is never shown as 0 unless it is. Infinite: "unbounded".
std::string estimate_text(const Estimate& estimate);

}  // namespace farfield
