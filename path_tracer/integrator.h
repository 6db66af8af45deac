// SPDX-License-Identifier: Apache-2.0
// A path tracer over Farfield geometry: the loop that a host would write.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/embree.h"
#include "base/job.h"
#include "base/result.h"
#include "farfield/runtime.h"
#include "path_tracer/camera.h"
#include "path_tracer/environment.h"
#include "path_tracer/film.h"
#include "path_tracer/level_hits.h"

namespace farfield {

/// A point or spot light (KHR_lights_punctual). Intensity in W / sr.
struct PointLight {
  vec3 position{0.0f};
  vec3 intensity{0.0f};         ///< linear RGB
  vec3 direction{0.0f, -1, 0};  ///< spot axis, unit
  float cos_inner = -1;         ///< full intensity inside; -1 with cos_outer -1: all around
  float cos_outer = -1;         ///< none outside
};

/// How much of its intensity a light sends into a unit direction that leaves it, in [0, 1].
float spot_falloff(const PointLight& light, const vec3& direction);

struct Lights {
  Environment environment = Environment::constant(vec3(0.0f));
  std::vector<PointLight> points;
};

class SceneIds;

/// What a path meets. `embree` is committed and holds the runtime's user geometry.
struct TraceScene {
  EmbreeSceneRef embree = nullptr;
  const Runtime* runtime = nullptr;
  const Lights* lights = nullptr;
  const SceneIds* ids = nullptr;  ///< for Film::has_ids()
};

/// How direct light of the environment is found. All three converge to the same image.
enum class LightStrategy : uint8_t {
  Mis,           ///< both, weighted by the power heuristic [Veach 1997]
  LightSamples,  ///< directions drawn from the lights only
  ScatterRays,   ///< rays that scatter into a light only; point lights are still sampled
};

struct TraceOptions {
  int samples_per_pixel = 16;
  uint64_t seed = 0;
  int max_depth = 4096;      ///< scattering events per path; paths end earlier by Russian roulette, without bias. Light
                             ///< in a white cloud is scattered hundreds of times
  int roulette_depth = 4;    ///< first event after which Russian roulette may end the path
  float clamp_indirect = 0;  ///< > 0: bounds each indirect contribution (biased, fewer fireflies); 0: unbiased
  bool transparent = false;  ///< camera rays that miss give 0 instead of the environment
  LightStrategy strategy = LightStrategy::Mis;
};

struct TraceStats {
  LevelHits hits;                ///< of camera and scattered rays
  uint64_t rays = 0;             ///< camera, scattered and shadow rays
  uint64_t invalid_samples = 0;  ///< paths whose value was not finite; they count as black
};

/// A committed scene that holds the runtime's geometry and nothing else; a small one takes less memory for its
/// instances (kSmallSceneBytesPerInstance) and a little more time. Errors: those of Runtime::attach, Io (Embree).
Result<EmbreeScene> make_scene(EmbreeDeviceRef device, Runtime& runtime, bool is_small = false);

/// Renders what a camera sees while its shutter is open (see ray_at() for the keys; one stands still, and sees the
/// instances at ray time 0) into `film` (same size) on all threads of parallel_for. The image depends on the arguments
/// alone, not on threads or time. The job reports from several threads at once and is polled for each tile of 16 x 16
/// pixels. Errors: Cancelled (the film is part done); InvalidArgument (sizes differ, no samples).
Result<TraceStats> path_trace(const TraceScene& scene, std::span<const Camera> keys, const TraceOptions& options,
                              Film& film, const Job& job = {});
inline Result<TraceStats> path_trace(const TraceScene& scene, const Camera& camera, const TraceOptions& options,
                                     Film& film, const Job& job = {}) {
  return path_trace(scene, std::span(&camera, 1), options, film, job);
}

}  // namespace farfield
