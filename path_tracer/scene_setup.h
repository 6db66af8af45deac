// SPDX-License-Identifier: Apache-2.0
// From a glTF scene to what the path tracer takes: camera, lights, instances.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "import/gltf_scene.h"
#include "path_tracer/camera.h"
#include "path_tracer/integrator.h"
#include "path_tracer/render_job.h"

namespace farfield {

/// glTF's lights are photometric; one watt of ours is 683 lumens of theirs, as Blender's exporter has it.
inline constexpr float kLumensPerWatt = 683.0f;

/// The index of a scene's camera: the first for an empty name, the first of that name, else the name as a number.
/// Errors: InvalidArgument, with a list of the cameras.
Result<size_t> find_camera(const GltfScene& scene, const std::string& name);

/// The scene's camera `index` at a time, for images of width x height. It keeps its vertical angle (or extent),
/// whatever the file's aspect ratio. A scene without a camera is seen whole, from above and in front.
Camera make_camera(const GltfScene& scene, size_t index, double seconds, int width, int height);

/// Environment: options.environment, or sun and sky, or darkness where options.sky is off. The sky's sun is the
/// brightest directional light, in its direction, colour and strength; without one default_sun_sky(). All other lights
/// come as they are. options.turn_sun turns the sky and all directional lights. What cannot be rendered (directional
/// lights beside an environment image, which is not turned either) and what leaves nothing to be seen adds a line to
/// `warnings`. Errors: those of Environment::from_file.
Result<Lights> make_lights(const GltfScene& scene, const RenderOptions& options, std::vector<std::string>& warnings);

}  // namespace farfield
