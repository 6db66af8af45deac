// SPDX-License-Identifier: Apache-2.0
// What `farfield why` prints.
#pragma once

#include <string>

#include "path_tracer/pixel_report.h"

namespace farfield::tool {

std::string pixel_text(const PixelReport& report);
std::string pixel_json(const PixelReport& report);

}  // namespace farfield::tool
