// SPDX-License-Identifier: Apache-2.0
// A part of the module farfield_volumes: see write_volume() for what it does.
#pragma once

#include <string>

#include "import/write_volume.h"

namespace farfield {

Result<void> write_openvdb(const std::string& path, const VolumeFile& file, const Job& job);

}  // namespace farfield
