// SPDX-License-Identifier: Apache-2.0
// The lights of an evaluation (docs/error_metric.md, "Lights"). Suns stand relative to the camera, so that every view
// is seen lit from the front and from behind.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "evaluate/views.h"
#include "path_tracer/image.h"
#include "path_tracer/integrator.h"

namespace farfield {

enum class Light : uint8_t {
  Daylight,  ///< default_sun_sky(), the same for every view
  Front,     ///< a sun alone, behind the camera's shoulder: what is seen is lit
  Behind,    ///< a sun alone, behind the asset: what is seen glows or is a silhouette
  Above,     ///< a sun alone, overhead (+y)
  Sky,       ///< a constant sky alone, all around
};

/// All of them, in this order.
std::span<const Light> all_lights();
/// "daylight", "front", "behind", "above", "sky".
std::string_view name_of(Light light);
/// Reads names with commas between them, each once: "front,sky". Errors: InvalidArgument.
Result<std::vector<Light>> parse_lights(std::string_view names);

/// The light as it shines on one view.
Lights lights_for(Light light, const OrthoView& view);
/// The same as another renderer needs it. Daylight's sky is in environment.exr.
Metadata light_metadata(Light light, const OrthoView& view);

}  // namespace farfield
