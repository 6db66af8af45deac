// SPDX-License-Identifier: Apache-2.0
// OpenVDB files for tests, written and looked at by OpenVDB itself.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/vec.h"

namespace farfield::test {

struct VdbVoxel {
  ivec3 at{0};
  double value = 1;
  vec3 color{0.0f};  ///< of Kind::Color
};
/// All voxels from lower to upper, both included; as tiles where they cover whole nodes.
struct VdbTile {
  ivec3 lower{0}, upper{0};
  double value = 1;
};

struct VdbGrid {
  enum class Kind { Float, Half, Double, Color, LevelSet };

  std::string name = "density";
  Kind kind = Kind::Float;
  glm::dmat4 index_to_source{1.0};  ///< of voxel centres, as OpenVDB has them
  double background = 0;
  std::vector<VdbVoxel> voxels;
  std::vector<VdbTile> tiles;
};

/// A cube of side^3 voxels from `lower` on with value(voxel); those that are 0 stay inactive.
std::vector<VdbVoxel> filled_cube(const ivec3& lower, int side, const std::function<double(const ivec3&)>& value);

void write_vdb(const std::filesystem::path& path, const std::vector<VdbGrid>& grids);
/// The same of one grid of floats as NanoVDB's own writer has it; `fp8`: quantised.
void write_nvdb(const std::filesystem::path& path, const VdbGrid& grid, bool fp8, bool zip);
/// One grid "density" in a frustum.
void write_frustum_vdb(const std::filesystem::path& path);

/// A grid as OpenVDB reads it.
struct VdbContent {
  std::string name, type;  ///< "float", "vec3s", "int32"
  bool is_fog = false;
  glm::dmat4 index_to_source{1.0};
  std::vector<VdbVoxel> voxels;                 ///< that are active: value, of vectors color
  std::map<std::string, std::string> metadata;  ///< as text
};
/// All grids of a file, in the file's order.
std::vector<VdbContent> read_vdb(const std::filesystem::path& path);

struct VdbRay {
  dvec3 origin{0.0}, direction{0.0, 0.0, 1.0};  ///< in the source's space; unit
  double length = 1;
};
/// exp(-scale times the integral of the grid "density") by midpoints of `steps`, with OpenVDB's sampler of nearest
/// voxels.
std::vector<double> march_vdb(const std::filesystem::path& path, std::span<const VdbRay> rays, double scale, int steps);

}  // namespace farfield::test
