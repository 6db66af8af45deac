// SPDX-License-Identifier: Apache-2.0
// What must hold for the arrays of a level, wherever they lie. The writer refuses what these refuse, so a written file
// always opens.
#pragma once

#include <optional>
#include <string>

#include "cache/level.h"

namespace farfield {

/// The first reason why following the level's indices could leave its arrays, or why a loop over it might not end:
/// header values, lengths of grouped arrays, every index, brick masks against densities. Nothing if it is sound.
/// Reads quads, morph map, brick table and bricks once; a few GB per second.
std::optional<std::string> find_structure_problem(const LevelView& level);

/// The first value that a sound level may still have wrong: positions and voxels outside the bounds or not finite,
/// self-shadowing of 0, reserved bytes. Requires that find_structure_problem found nothing.
std::optional<std::string> find_value_problem(const LevelView& level);

}  // namespace farfield
