// SPDX-License-Identifier: Apache-2.0
// Reading OpenVDB and NanoVDB files (.vdb, .nvdb): the density of a fog volume, with albedos if there are any.
//
// Grids: density is "density", or the only float grid that is a fog volume, or what the options name; float, half and
// double. Albedos are a vec3 grid "albedo" or "Cd" (of "X_level_2": "albedo_level_2") on its lattice. Emission (flame)
// is not modelled: as a density it is refused, beside one it is ignored and said to be. What else is there is ignored,
// and said to be, too.
//
// Voxels that are no cubes are resampled (resample_volume.h), and said to be.
//
// OpenVDB's voxel (i, j, k) is a sample whose *centre* is where its transform puts (i, j, k): half a voxel is
// subtracted once, here.
#pragma once

#include <filesystem>

#include "base/job.h"
#include "base/result.h"
#include "import/fog_options.h"
#include "import/source_volume.h"

namespace farfield {

/// Whether a file is one of those, by its first bytes or, if it cannot be opened, by its name.
bool is_volume_file(const std::filesystem::path& path);

/// Bounds of what a file's grid may hold, in the source's space, from its header alone.
struct VolumeExtent {
  dvec3 lower{0.0}, upper{0.0};
};
/// Errors: those of read_volume(), as far as the header tells.
Result<VolumeExtent> read_volume_extent(const std::filesystem::path& path, const FogOptions& options = {});

/// Memory: 2 KiB for each 8^3 voxels that hold any density (tiles share theirs), 4 bytes for each that the bounds
/// enclose, and OpenVDB's own tree while it is read. Errors: NotFound, Io; BadFile (broken; densities that are negative
/// by more than rounding, NaN or infinite: with the first such voxel; nothing with a density); Unsupported (no such
/// grid, several to choose from, level sets without the option, a frustum, emission, more voxels or a
/// larger extent than a level can hold); InvalidArgument (options); Cancelled.
Result<SourceVolume> read_volume(const std::filesystem::path& path, const FogOptions& options = {},
                                 const Job& job = {});

/// Errors: InvalidArgument, naming the option as the command calls it.
Result<void> check_options(const FogOptions& options);

/// The source_hash that read_volume() would give. Errors: those of reading the file.
Result<uint64_t> hash_volume(const std::filesystem::path& path, const FogOptions& options);

}  // namespace farfield
