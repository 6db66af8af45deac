/* SPDX-License-Identifier: Apache-2.0
 * The runtime for C, and for languages that call C: the calls of farfield/runtime.h, where they are described in full.
 *
 *   FfOptions options = FF_OPTIONS_INIT;
 *   options.budget_bytes = 4ull << 30;
 *   FfRuntime* runtime;
 *   if (ff_create(device, &options, &runtime) != FF_OK) fail(ff_last_error());
 *   uint32_t oak, instance;
 *   unsigned geometry;
 *   ff_open_asset(runtime, "oak.farfield", &oak);
 *   ff_add_instance(runtime, oak, local_to_world, NULL, &instance);
 *   ff_set_cameras(runtime, &camera, 1);
 *   ff_plan_frame(runtime, NULL);
 *   ff_attach(runtime, scene, &geometry);
 *   rtcCommitScene(scene);
 *
 *   FfRayContext context;  // per ray
 *   ff_ray_context_init(&context);
 *   context.cone_spread = pixel_spread;
 *   rtcIntersect1(scene, &context.embree, &ray_hit);
 *   if (ray_hit.hit.geomID == geometry) {
 *     FfInteraction hit;
 *     hit.size = sizeof hit;
 *     ff_interaction(runtime, &ray_hit, &context, &hit);
 *   }
 *
 * Structs whose first member is `size` are versioned: their _INIT sets it and the defaults. A library that is older
 * than the header it is called with refuses sizes that it does not know (FF_UNSUPPORTED); a newer one takes defaults
 * for what an older header lacks. Vectors are x, y, z; transforms are 3 columns and the translation, 12 floats, as
 * Embree's RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR. Thread rules are those of farfield/runtime.h. Pointers must not be null
 * unless it is said. */
#ifndef FARFIELD_FARFIELD_H
#define FARFIELD_FARFIELD_H

#include <farfield/embree.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FF_API __attribute__((visibility("default")))

typedef struct FfRuntime FfRuntime;

typedef enum FfStatus {
  FF_OK = 0,
  FF_INVALID_ARGUMENT = 1,
  FF_NOT_FOUND = 2,
  FF_IO = 3,
  FF_BAD_FILE = 4,
  FF_UNSUPPORTED = 5,
  FF_OUT_OF_BUDGET = 6,
  FF_CANCELLED = 7
} FfStatus;

/* One line on the last call of this thread that did not return FF_OK; "" before the first. Valid until the next such.
 */
FF_API const char* ff_last_error(void);

typedef enum FfSeverity { FF_INFO = 0, FF_WARNING = 1, FF_ERROR = 2 } FfSeverity;
/* Called from any thread, never concurrently. */
typedef void (*FfMessageSink)(void* user, FfSeverity severity, const char* message);

typedef struct FfOptions {
  size_t size;
  uint64_t budget_bytes;
  float pixel_error;                 /* pixels, > 0 */
  int is_progressive;                /* 0: rays wait for levels; else coarser ones serve meanwhile */
  int has_geometry_filters;          /* RuntimeOptions::has_geometry_filters */
  uint32_t scene_bytes_per_instance; /* 120, or 64 for a scene of RTC_BUILD_QUALITY_LOW */
  FfMessageSink messages;            /* may be null */
  void* messages_user;
} FfOptions;
#define FF_OPTIONS_INIT \
  { sizeof(FfOptions), 1ull << 32, 1.0f, 0, 0, 120, NULL, NULL }

FF_API FfStatus ff_create(RTCDevice host_device, const FfOptions* options, FfRuntime** runtime);
FF_API void ff_destroy(FfRuntime* runtime); /* null: nothing */

FF_API FfStatus ff_open_asset(FfRuntime* runtime, const char* folder, uint32_t* asset);
FF_API FfStatus ff_bounds(FfRuntime* runtime, uint32_t asset, float lower[3], float upper[3]);

typedef struct FfInstanceData {
  uint64_t id;
  float tint[3];
} FfInstanceData;
/* data: may be null. */
FF_API FfStatus ff_add_instance(FfRuntime* runtime, uint32_t asset, const float local_to_world[12],
                                const FfInstanceData* data, uint32_t* instance);
FF_API FfStatus ff_move_instance(FfRuntime* runtime, uint32_t instance, const float local_to_world[12]);
/* `count` transforms, 12 floats each: motion while the shutter is open, at evenly spaced values of RTCRay::time. */
FF_API FfStatus ff_move_instance_keys(FfRuntime* runtime, uint32_t instance, const float* keys, size_t count);
FF_API FfStatus ff_set_visible(FfRuntime* runtime, uint32_t instance, int is_visible);
FF_API FfStatus ff_remove_instance(FfRuntime* runtime, uint32_t instance);
/* Both levels included; 0 and 255: no limits. */
FF_API FfStatus ff_limit_instance_levels(FfRuntime* runtime, uint32_t instance, uint8_t finest, uint8_t coarsest);
FF_API FfStatus ff_limit_asset_levels(FfRuntime* runtime, uint32_t asset, uint8_t finest, uint8_t coarsest);

typedef struct FfCamera {
  float position[3];
  float pixel_width; /* a pixel is pixel_width + pixel_spread * distance wide */
  float pixel_spread;
} FfCamera;
FF_API FfStatus ff_set_cameras(FfRuntime* runtime, const FfCamera* cameras, size_t count);

typedef struct FfPlan {
  size_t size;
  uint64_t planned_bytes;
  uint64_t asked_bytes; /* a budget that gives nothing up */
  double bias;          /* mean of how many levels coarser than asked */
} FfPlan;
#define FF_PLAN_INIT \
  { sizeof(FfPlan), 0, 0, 0.0 }
/* plan: may be null. */
FF_API FfStatus ff_plan_frame(FfRuntime* runtime, FfPlan* plan);
FF_API FfStatus ff_prefetch(FfRuntime* runtime);
/* The next frame's cameras, to load for while rays of this one fly; see Runtime::look_ahead. */
FF_API FfStatus ff_look_ahead(FfRuntime* runtime, const FfCamera* cameras, size_t count);
FF_API FfStatus ff_attach(FfRuntime* runtime, RTCScene scene, unsigned* geometry_id);

typedef struct FfStats {
  size_t size;
  uint64_t accounted_bytes;
  uint64_t peak_accounted_bytes;
  uint64_t levels_loaded;
  uint64_t levels_resident;
  uint64_t fallbacks;
  double load_seconds;
  double wait_seconds; /* of all threads, for levels */
} FfStats;
#define FF_STATS_INIT \
  { sizeof(FfStats), 0, 0, 0, 0, 0, 0.0, 0.0 }
FF_API FfStatus ff_stats(const FfRuntime* runtime, FfStats* stats);

/* A farfield::RayContext: pass `embree` to rtcIntersect1 and rtcOccluded1. */
typedef struct FfRayContext {
  struct RTCIntersectContext embree; /* leave its flags alone */
  float cone_width;                  /* world units at the ray's origin */
  float cone_spread;                 /* world units per unit of t */
  uint32_t path_seed;                /* constant along a path */
  uint32_t ray_seed;                 /* different for every ray */
  uint64_t state[40];                /* the library's: where the ray starts, its differential, and what it hit */
} FfRayContext;
FF_API void ff_ray_context_init(FfRayContext* context);
/* The ray starts at the hit of `from`, which may be the same context. */
FF_API void ff_set_origin(FfRayContext* context, const FfRayContext* from);
/* The next occlusion query with this context passes volumes, and ff_transmittance() is the share of light that they let
   through; RayContext::transmittance. */
FF_API void ff_measure_transmittance(FfRayContext* context);
FF_API float ff_transmittance(const FfRayContext* context);
/* A differential in place of the cone: d origin / dx, d origin / dy, d direction / dx, d direction / dy, world units
   per pixel, of a ray with this unit direction. The longer axis of the footprint asks for levels, or the shorter. */
FF_API void ff_set_differential(FfRayContext* context, const float differential[12], const float unit_direction[3],
                                int by_longer_axis);
/* The ray starts elsewhere. */
FF_API void ff_clear_origin(FfRayContext* context);

typedef enum FfKind { FF_NONE = 0, FF_SURFACE = 1, FF_VOLUME = 2 } FfKind;

typedef struct FfInteraction {
  size_t size;
  FfKind kind;
  uint32_t instance, level;
  float lambda, footprint;
  float position[3], wo[3], geometric_normal[3], shading_normal[3];
  float albedo[3], emission[3];
  float diffuse[3], specular[3], transmission[3], roughness, sggx[6], self_shadowing; /* farfield::Reflectance */
  uint32_t material, source_face;                                                     /* 0xffffffff: unknown */
  float barycentric[2], uv[2];
  FfInstanceData instance_data;
  uint64_t state[80];       /* the library's: how light scatters */
  float sigma_t;            /* volumes: extinction along the ray, 1 / world unit; 0 on surfaces */
  float fog[3], anisotropy; /* farfield::Reflectance */
} FfInteraction;
/* Set interaction->size to sizeof(FfInteraction) before. Of what is no hit of ours: FF_OK, and kind is FF_NONE. Use it
 * before the next ff_plan_frame(). */
FF_API FfStatus ff_interaction(const FfRuntime* runtime, const struct RTCRayHit* ray_hit, const FfRayContext* context,
                               FfInteraction* interaction);

typedef struct FfRng {
  uint64_t state[2];
} FfRng;
FF_API void ff_rng_init(FfRng* rng, uint64_t seed, uint64_t sequence);
FF_API float ff_rng_next(FfRng* rng); /* uniform in [0, 1) */

typedef struct FfScatterSample {
  float wi[3], weight[3], pdf; /* weight 0: a failed sample, the path ends */
} FfScatterSample;
/* Of an interaction that ff_interaction() has filled in; see farfield/interaction.h. */
FF_API void ff_sample(const FfInteraction* interaction, FfRng* rng, FfScatterSample* sample);
FF_API void ff_eval(const FfInteraction* interaction, const float wi[3], FfRng* rng, float value[3]);
FF_API float ff_pdf(const FfInteraction* interaction, const float wi[3]);
FF_API void ff_ray_origin(const FfInteraction* interaction, const float wi[3], float origin[3]);
/* The context of the ray that goes on in the sampled direction, t along the ray that came: its origin, its level, its
   cone or differential; ray_seed is still to be given. */
FF_API void ff_spawn(const FfInteraction* interaction, const FfScatterSample* sample, float t, FfRayContext* context);
FF_API float ff_next_cone_spread(const FfInteraction* interaction, const FfScatterSample* sample, float cone_spread);

#ifdef __cplusplus
}
#endif

#endif
