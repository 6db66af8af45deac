// SPDX-License-Identifier: Apache-2.0
// Why a ray sees the levels that it sees.
#pragma once

#include <vector>

#include "bvh/instance_geometry.h"
#include "farfield/runtime.h"

namespace farfield {

/// See Runtime::explain().
std::vector<RayVisit> explain_ray(const InstanceGeometry& geometry, const EmbreeRay& ray, const RayContext& context);

}  // namespace farfield
