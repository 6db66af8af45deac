// SPDX-License-Identifier: Apache-2.0
// NanoVDB files (.nvdb) [Museth 2021] as grids of OpenVDB. NanoVDB's own reader trusts what it reads; here every size
// and offset is checked before it is used. Part of the module.
#pragma once

#include <openvdb/openvdb.h>

#include <string>
#include <vector>

#include "base/result.h"

namespace farfield {

/// By the first bytes.
bool is_nanovdb_file(const std::string& path);

struct NanoVdbGrids {
  std::vector<openvdb::GridBase::Ptr> grids;  ///< with their voxels: of float, double, Fp4, Fp8, Fp16 and Vec3f
  std::vector<std::string> others;            ///< "\"name\" (type)" of grids of other types
};
/// Memory: the grid in the file, unpacked, and OpenVDB's tree. Errors: Io; BadFile (cut short, offsets that lead
/// nowhere, nodes with two parents), with the place; Unsupported (another major version, Blosc).
Result<NanoVdbGrids> read_nanovdb(const std::string& path);

}  // namespace farfield
