// SPDX-License-Identifier: Apache-2.0
// The contact sheet of an evaluation: one row per level, source | level | difference.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "path_tracer/image.h"

namespace farfield {

/// One row: the same view of source and level (R, G, B, A, premultiplied, linear), and two lines of text below.
struct SheetRow {
  Image source, level;
  std::vector<std::string> captions;
};

/// Lays the rows out below each other, every picture scaled to fit a cell of `cell_px` pixels (whole pixels: repeated
/// or averaged), over mid-grey. The difference column shows 0.5 + 2 (level - source) in display values: grey is equal,
/// brighter is too bright. Exposure is common to all rows. Linear R, G, B. No rows: an empty image.
Image make_sheet(std::span<const SheetRow> rows, int cell_px = 256);

}  // namespace farfield
