// SPDX-License-Identifier: Apache-2.0
// trade.html: the trade for people, in one file that needs no other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "evaluate/trade.h"

namespace farfield {

/// One setting beside full detail in the frame where it is farthest from it, as PNG files' bytes.
struct TradePicture {
  size_t row = 0, light = 0;  ///< indices into Trade
  int frame = 0;
  std::string full, setting, difference;
};

/// The pictures of all settings but full detail, means of their parts, as small as a page needs. `output`: the folder
/// of the trade. Errors: those of read_frame_parts and write_png.
Result<std::vector<TradePicture>> trade_pictures(const Trade& trade, const std::filesystem::path& output);

/// The page: advice, tables, plots, pictures; well-formed as XML.
std::string trade_page(const Trade& trade, const std::vector<TradePicture>& pictures);

}  // namespace farfield
