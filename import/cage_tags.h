// SPDX-License-Identifier: Apache-2.0
// Tags of subdivision cages in OBJ files, as OpenSubdiv's own shapes have them: "t crease 2/1/0 4 3 2.5".
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "import/subdivision_options.h"

namespace farfield {

/// Reads what stands behind the "t" of a line: name, counts of integers / floats / strings, and those. Vertices and
/// faces count from 0. Returns what is wrong with it, in a few words; then nothing of it counts.
std::string read_cage_tag(std::string_view line, CageTags& tags);

/// Takes away creases and corners of vertices that do not exist. Returns how many.
size_t drop_tags_out_of_range(CageTags& tags, size_t vertex_count);

}  // namespace farfield
