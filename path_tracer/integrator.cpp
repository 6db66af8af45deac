// SPDX-License-Identifier: Apache-2.0
// Unidirectional path tracing with next-event estimation and multiple importance sampling [Veach 1997, 9.2 and 10.3].
//
// A vertex is a surface or a volume Interaction; both are asked the same three questions (sample, eval, pdf), so the
// loop does not tell them apart. Visibility of the environment is sampled twice per vertex, by a shadow ray towards a
// direction drawn from the light, and by the ray that scatters on. Both carry the same cone for the same direction,
// so both see the same levels, and the two estimates mix without bias.
#include "path_tracer/integrator.h"

#include <algorithm>
#include <mutex>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "base/parallel.h"
#include "path_tracer/scene_names.h"

namespace farfield {

namespace {

constexpr int kTileSide = 16;

// The power heuristic with exponent 2 for one sample of each kind.
float power_weight(float pdf, float other_pdf) {
  const float ratio = other_pdf / pdf;  // squared after the division: pdfs of discs squared leave a float's range
  return pdf > 0 ? 1.0f / (1.0f + ratio * ratio) : 0.0f;
}

// A ray on its way, with the cone it carries.
struct PathRay {
  vec3 origin{0.0f};
  vec3 direction{0.0f};
  float cone_width = 0;
  float cone_spread = 0;
  // With which the direction was drawn at the vertex it leaves, per steradian: by scattering, and towards the light.
  float scatter_pdf = 0;
  float light_pdf = 0;
};

class PathTracer {
 public:
  /// view_axis: the camera's, along which depth is measured.
  PathTracer(const TraceScene& scene, const TraceOptions& options, const vec3& view_axis)
      : scene_(scene), lights_(*scene.lights), options_(options), view_axis_(view_axis) {}

  /// time: of the open shutter, in [0, 1]. light_choice: uniform in [0, 1), for the first event's EnvironmentSample.
  FilmSample trace(const CameraRay& camera_ray, float time, uint64_t path_key, float light_choice);

  TraceStats stats;

 private:
  bool intersect(const PathRay& ray);
  bool is_occluded(const PathRay& ray, float distance);
  void set_context(RayContext& context, const PathRay& ray);
  PathRay leave(const Interaction& vertex, const ScatterSample& sample, float light_pdf, const PathRay& incoming) const;
  void add_environment(const PathRay& ray);
  void add_sampled_environment(const Interaction& vertex, const PathRay& incoming);
  bool is_worth_a_ray(const Interaction& vertex, vec3& scattered);
  void add_point_lights(const Interaction& vertex, const PathRay& incoming);
  void add(const vec3& radiance);
  bool survives_roulette();
  void describe(const Interaction& seen, const CameraRay& camera_ray, FilmSample& sample) const;

  const TraceScene& scene_;
  const Lights& lights_;
  const TraceOptions& options_;
  const vec3 view_axis_;

  // Of the path in hand.
  Rng rng_{0};
  uint32_t path_seed_ = 0;
  float time_ = 0;
  float light_choice_ = 0;
  int depth_ = 0;  ///< scattering events so far
  vec3 throughput_{1.0f};
  vec3 color_{0.0f};
  HitRecord last_hit_;  ///< what the present ray leaves; instance kNoInstance for the camera
  RayContext context_;  ///< of the last intersect()
  EmbreeRayHit ray_hit_{};
};

void PathTracer::set_context(RayContext& context, const PathRay& ray) {
  context = RayContext();
  context.cone_width = ray.cone_width;
  context.cone_spread = ray.cone_spread;
  context.path_seed = path_seed_;
  context.ray_seed = rng_.next_uint();
  if (last_hit_.instance != kNoInstance) context.set_origin(last_hit_);
}

bool PathTracer::intersect(const PathRay& ray) {
  set_context(context_, ray);
  ray_hit_ = make_ray_hit(ray.origin, ray.direction);
  ray_hit_.ray.time = time_;
  ++stats.rays;
  return trace_nearest(scene_.embree, context_.embree, ray_hit_) &&
         ray_hit_.hit.geomID == scene_.runtime->geometry_id();
}

bool PathTracer::is_occluded(const PathRay& ray, float distance) {
  RayContext context;
  set_context(context, ray);
  EmbreeRay shadow_ray = make_ray(ray.origin, ray.direction, 0, distance);
  shadow_ray.time = time_;
  ++stats.rays;
  return trace_occlusion(scene_.embree, context.embree, shadow_ray);
}

// The ray from a vertex into sample.wi. Its cone starts as wide as the incoming one is there, and spreads as directions
// lie apart that scattering *and* the light's own sampling draw: towards a sun they lie close, and a lobe's wide cone
// would take the shadows of trees from their coarsest levels.
PathRay PathTracer::leave(const Interaction& vertex, const ScatterSample& sample, float light_pdf,
                          const PathRay& incoming) const {
  const float distance = glm::length(vertex.position - incoming.origin);
  PathRay ray;
  ray.origin = vertex.ray_origin(sample.wi);
  ray.direction = sample.wi;
  ray.cone_width = incoming.cone_width + incoming.cone_spread * distance;
  ScatterSample drawn = sample;
  drawn.pdf += light_pdf;
  ray.cone_spread = vertex.next_cone_spread(drawn, incoming.cone_spread);
  ray.scatter_pdf = sample.pdf;
  ray.light_pdf = light_pdf;
  return ray;
}

void PathTracer::add(const vec3& radiance) {
  vec3 contribution = throughput_ * radiance;
  if (options_.clamp_indirect > 0 && depth_ > 1) {
    const float largest = max_component(contribution);
    if (largest > options_.clamp_indirect) contribution *= options_.clamp_indirect / largest;
  }
  color_ += contribution;
}

// A ray that met nothing arrives at the environment.
void PathTracer::add_environment(const PathRay& ray) {
  const vec3 radiance = lights_.environment.radiance(ray.direction);
  if (depth_ == 0) {
    if (!options_.transparent) add(radiance);
    return;
  }
  if (options_.strategy == LightStrategy::LightSamples) return;
  const bool mixed = options_.strategy == LightStrategy::Mis;
  add(mixed ? radiance * power_weight(ray.scatter_pdf, ray.light_pdf) : radiance);
}

// Next-event estimation of the environment.
void PathTracer::add_sampled_environment(const Interaction& vertex, const PathRay& incoming) {
  if (options_.strategy == LightStrategy::ScatterRays) return;
  const EnvironmentSample light = lights_.environment.sample(depth_ == 1 ? light_choice_ : rng_.next(), rng_);
  if (!(light.pdf > 0)) return;
  vec3 scattered = vertex.eval(light.wi, rng_);
  if (!is_worth_a_ray(vertex, scattered)) return;
  const ScatterSample as_scattered{light.wi, vec3(0.0f), vertex.pdf(light.wi)};
  if (is_occluded(leave(vertex, as_scattered, light.pdf, incoming), kInfinity)) return;
  const bool mixed = options_.strategy == LightStrategy::Mis;
  const float weight = mixed ? power_weight(light.pdf, as_scattered.pdf) : 1.0f;
  add(scattered * light.radiance * (weight / light.pdf));
}

// Light that a vertex hardly scatters (a flake's far side, a face at grazing) is looked for less often, and counts the
// more: most shadow rays of volumes would otherwise carry next to nothing.
bool PathTracer::is_worth_a_ray(const Interaction& vertex, vec3& scattered) {
  constexpr float kFaint = 0.1f;  // of what a Lambertian surface of that albedo scatters at most
  const float brightest = max_component(scattered), usual = kFaint * kInvPi * max_component(vertex.albedo);
  if (!(brightest > 0)) return false;
  if (brightest >= usual) return true;
  const float probability = brightest / usual;
  if (!(rng_.next() < probability)) return false;
  scattered /= probability;
  return true;
}

// Lights without extent are only ever sampled, so they need no weight.
void PathTracer::add_point_lights(const Interaction& vertex, const PathRay& incoming) {
  for (const PointLight& light : lights_.points) {
    const vec3 to_light = light.position - vertex.position;
    const float distance2 = glm::dot(to_light, to_light);
    if (!(distance2 > 0)) continue;
    const float distance = std::sqrt(distance2);
    const vec3 wi = to_light / distance;
    const float falloff = spot_falloff(light, -wi);
    if (falloff <= 0) continue;
    vec3 scattered = vertex.eval(wi, rng_);
    if (!is_worth_a_ray(vertex, scattered)) continue;
    const PathRay ray = leave(vertex, ScatterSample{.wi = wi}, kInfinity, incoming);  // spreads no cone
    if (is_occluded(ray, glm::length(light.position - ray.origin))) continue;
    add(scattered * light.intensity * (falloff / distance2));
  }
}

// Ends paths that carry little, in proportion to what they carry; what survives makes up for the rest.
bool PathTracer::survives_roulette() {
  if (depth_ < options_.roulette_depth) return true;
  const float probability = std::min(max_component(throughput_), 1.0f);
  if (!(rng_.next() < probability)) return false;
  throughput_ /= probability;
  return true;
}

// What the camera ray met, for all channels but the colour.
void PathTracer::describe(const Interaction& seen, const CameraRay& camera_ray, FilmSample& sample) const {
  sample.alpha = 1;
  sample.lod_level = static_cast<float>(seen.level);
  sample.lod_blend = seen.lambda - std::floor(seen.lambda);
  sample.footprint = seen.footprint;
  sample.lod_volume = seen.kind == Interaction::Kind::Volume ? 1.0f : 0.0f;
  sample.albedo = seen.albedo;
  sample.normal = seen.shading_normal;
  sample.depth = glm::dot(seen.position - camera_ray.origin, view_axis_);
  if (!scene_.ids) return;
  sample.ids[size_t(IdLayer::Object)] = scene_.ids->object(seen);
  sample.ids[size_t(IdLayer::Material)] = scene_.ids->material(seen);
}

FilmSample PathTracer::trace(const CameraRay& camera_ray, float time, uint64_t path_key, float light_choice) {
  rng_ = Rng(path_key);
  path_seed_ = rng_.next_uint();
  time_ = time;
  light_choice_ = light_choice;
  depth_ = 0;
  throughput_ = vec3(1.0f);
  color_ = vec3(0.0f);
  last_hit_ = HitRecord();

  FilmSample result;
  PathRay ray{camera_ray.origin, camera_ray.direction, camera_ray.cone_width, camera_ray.cone_spread};
  for (;;) {
    if (!intersect(ray)) {
      add_environment(ray);
      break;
    }
    const Interaction vertex = scene_.runtime->interaction(ray_hit_, context_);
    last_hit_ = context_.hit;
    stats.hits.add(scene_.runtime->asset_of({last_hit_.instance}).value, last_hit_.level_slot + last_hit_.is_coarser);
    if (depth_ == 0) describe(vertex, camera_ray, result);
    if (max_component(vertex.emission) > 0) add(vertex.emission);
    if (++depth_ > options_.max_depth) break;
    add_sampled_environment(vertex, ray);
    add_point_lights(vertex, ray);
    const ScatterSample next = vertex.sample(rng_);
    if (!(next.pdf > 0) || !(max_component(next.weight) > 0)) break;
    throughput_ *= next.weight;
    if (!survives_roulette()) break;
    ray = leave(vertex, next, lights_.environment.pdf(next.wi), ray);
  }
  if (is_finite(color_)) {
    result.color = color_;
  } else {
    ++stats.invalid_samples;
  }
  return result;
}

// The three numbers of a path that matter most, spread evenly over a pixel's samples: its place in the pixel and the
// light of its first event. A rank-1 lattice with irrational steps, powers of the root of x^4 = x + 1 [Roberts 2018],
// from a random start per pixel: each number alone is uniform, so nothing is biased.
class PixelLattice {
 public:
  explicit PixelLattice(uint64_t pixel_key) {
    Rng rng(pixel_key, 1);
    for (uint32_t& start : start_) start = rng.next_uint();
  }
  float value(int sample, int dimension) const {
    constexpr uint32_t kSteps[3] = {3518319155u, 2882110345u, 2360945575u};  // 2^32 / root^(1, 2, 3)
    const uint32_t bits = start_[dimension] + static_cast<uint32_t>(sample) * kSteps[dimension];
    return static_cast<float>(bits >> 8) * 0x1p-24f;
  }

 private:
  uint32_t start_[3];
};

// When the paths of a pixel see the scene: golden steps from a random start.
class PixelTimes {
 public:
  PixelTimes(uint64_t pixel_key, bool does_move) : start_(Rng(pixel_key, 2).next_uint()), does_move_(does_move) {}
  float of(int sample) const {
    constexpr uint32_t kStep = 2654435769u;  // 2^32 / golden ratio
    return does_move_ ? static_cast<float>((start_ + static_cast<uint32_t>(sample) * kStep) >> 8) * 0x1p-24f : 0.0f;
  }

 private:
  uint32_t start_;
  bool does_move_;
};

// The pixels of one tile; every path's random numbers follow from the seed, the pixel and the sample alone.
void trace_tile(PathTracer& tracer, std::span<const Camera> keys, const TraceOptions& options, int tile_x, int tile_y,
                Film& film) {
  const int x_end = std::min((tile_x + 1) * kTileSide, film.width());
  const int y_end = std::min((tile_y + 1) * kTileSide, film.height());
  for (int y = tile_y * kTileSide; y < y_end; ++y) {
    for (int x = tile_x * kTileSide; x < x_end; ++x) {
      const uint64_t pixel_key = mix64(options.seed, static_cast<uint64_t>(y) * film.width() + x);
      const PixelLattice lattice(pixel_key);
      const PixelTimes times(pixel_key, keys.size() > 1);
      PixelSums sums(film.has_ids());
      for (int s = 0; s < options.samples_per_pixel; ++s) {
        const float time = times.of(s);
        const CameraRay ray = ray_at(keys, static_cast<float>(x) + lattice.value(s, 0),
                                     static_cast<float>(y) + lattice.value(s, 1), time);
        sums.add(tracer.trace(ray, time, mix64(pixel_key, static_cast<uint64_t>(s)), lattice.value(s, 2)));
      }
      film.set_pixel(x, y, sums);
    }
  }
}

}  // namespace

float spot_falloff(const PointLight& light, const vec3& direction) {
  const float cosine = glm::dot(light.direction, direction);
  if (light.cos_outer <= -1 || cosine >= light.cos_inner) return 1;
  if (cosine <= light.cos_outer) return 0;
  const float t = (cosine - light.cos_outer) / (light.cos_inner - light.cos_outer);
  return t * t;  // as KHR_lights_punctual recommends
}

Result<EmbreeScene> make_scene(EmbreeDeviceRef device, Runtime& runtime, bool is_small) {
  EmbreeScene scene = new_scene(device);
  if (is_small) set_build(scene.get(), SceneBuild::Small);
  FARFIELD_TRY(runtime.attach(scene.get()));
  commit_scene(scene.get());
  FARFIELD_TRY(check_embree(device, "build the scene"));
  return scene;
}

Result<TraceStats> path_trace(const TraceScene& scene, std::span<const Camera> keys, const TraceOptions& options,
                              Film& film, const Job& job) {
  if (keys.empty()) return make_error(ErrorCode::InvalidArgument, "there is no camera");
  const Camera& camera = keys[keys.size() / 2];
  if (camera.width() != film.width() || camera.height() != film.height())
    return make_error(ErrorCode::InvalidArgument, "camera and film differ in size");
  if (options.samples_per_pixel < 1 || options.max_depth < 0)
    return make_error(ErrorCode::InvalidArgument, "samples per pixel must be at least 1, the depth at least 0");

  const int columns = (film.width() + kTileSide - 1) / kTileSide;
  const int rows = (film.height() + kTileSide - 1) / kTileSide;
  const auto tile_count = static_cast<size_t>(columns) * static_cast<size_t>(rows);
  // Only counters: nothing else is published through them.
  std::atomic<uint64_t> rays{0}, invalid_samples{0}, tiles_done{0};
  LevelHits hits;
  std::mutex hits_mutex;

  parallel_for(tile_count, 1, [&](size_t begin, size_t end) {
    for (size_t tile = begin; tile < end && !job.is_cancelled(); ++tile) {
      PathTracer tracer(scene, options, camera.forward());
      trace_tile(tracer, keys, options, static_cast<int>(tile) % columns, static_cast<int>(tile) / columns, film);
      {
        const std::lock_guard lock(hits_mutex);
        hits.add(tracer.stats.hits);
      }
      rays += tracer.stats.rays;
      invalid_samples += tracer.stats.invalid_samples;
      const uint64_t done = ++tiles_done;
      job.report(static_cast<double>(done) / static_cast<double>(tile_count), "render");
    }
  });
  if (tiles_done < tile_count) return make_error(ErrorCode::Cancelled, "cancelled");
  return TraceStats{std::move(hits), rays, invalid_samples};
}

}  // namespace farfield
