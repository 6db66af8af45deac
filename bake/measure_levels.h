// SPDX-License-Identifier: Apache-2.0
// What baked levels take on this machine, against what their manifest says.
#pragma once

#include "cache/verify.h"

namespace farfield {

/// verify_asset() with every level and every morph loaded as the runtime does it, one after the other.
VerifyResult verify_and_measure_asset(const std::filesystem::path& asset_dir);

}  // namespace farfield
