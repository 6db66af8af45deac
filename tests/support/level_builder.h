// SPDX-License-Identifier: Apache-2.0
// Levels made in memory: shapes for what rays see, and one of everything for what files hold.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/vec.h"
#include "cache/level.h"

namespace farfield::test {

// --- Parts -----------------------------------------------------------------------------------------------------------

struct Triangle {
  uint32_t a, b, c;
};

/// An empty level k of resolution r.
LevelData empty_level(uint32_t k, float resolution);

/// Makes these quads a level's surface (v2 == v3: a lone triangle), with room for Embree to read past the last
/// position.
void set_quads(LevelData& level, std::vector<vec3> positions, const std::vector<Quad>& quads);
/// The same of lone triangles.
void set_triangles(LevelData& level, std::vector<vec3> positions, const std::vector<Triangle>& triangles);

/// Adds a brick volume of `dims` bricks, lower corner at `origin`. density(x, y, z) in 1 / scene unit is sampled per
/// voxel; sggx(x, y, z), if given, too.
void set_volume(LevelData& level, const ivec3& dims, const vec3& origin,
                const std::function<float(int, int, int)>& density,
                const std::function<SymMat3(int, int, int)>& sggx = nullptr);
/// Fills mask, prefix and payload_base from the densities of all bricks, in order.
void finish_bricks(std::vector<Brick>& bricks);
/// Extends a level's bounds by the box of its bricks.
void extend_by_volume(LevelHeader& header);

/// Gives every face and voxel of a level this diffuse albedo.
void set_diffuse(LevelData& level, const vec3& albedo);

// --- Levels ----------------------------------------------------------------------------------------------------------

/// `count` random triangles of size about `size` in the unit cube.
LevelData triangle_soup(uint32_t count, float size, uint64_t seed);

/// Foliage of five levels that get four times lighter each, the coarser ones with voxels; in the unit cube.
std::vector<LevelData> foliage(uint32_t leaves, uint64_t seed);

/// A closed sphere of quads, latitude-longitude, with lone triangles at the poles.
LevelData sphere_level(const vec3& center, float radius, uint32_t rings, uint32_t k = 0, float resolution = 0.1f);

/// A white sphere of radius 1 around the origin: level 0 and 1 meshes, level 2 a mesh in thin haze, level 3 and 5
/// (there is no 4) dense voxels. `rings` sets the size of level 0.
std::vector<LevelData> white_sphere(uint32_t rings = 64);

/// A level with every section of the format's first version: two quads (a pair and a lone triangle) and two bricks of a
/// 2x1x1 table.
LevelData full_level();
/// The same with those of the second version too.
LevelData full_level_of_version_2();
/// And with those of the third.
LevelData full_level_of_version_3();
/// And with those of the fourth.
LevelData full_level_of_version_4();
/// And of the fifth.
LevelData full_level_of_version_5();

/// The same with fog instead of flakes, and all that only fog has.
LevelData full_level_of_version_6();
/// Version 4 with what version 7 added: shapes of sheets.
LevelData full_level_of_version_7();
/// Version 2 with what version 8 added: its second quad is a part that stands in two places.
LevelData full_level_of_version_8();

/// A random sound level: `quads` quads, `bricks` bricks, channels picked by the seed.
LevelData random_level(uint64_t seed, uint32_t quads, uint32_t bricks);

}  // namespace farfield::test
