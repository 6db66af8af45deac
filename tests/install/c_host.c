/* SPDX-License-Identifier: Apache-2.0
 * c_host ASSET: a host in C99. What it sees of a white furnace around the asset, and what calls say that cannot do. */
#include <farfield/farfield.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                              \
  do {                                                                                                \
    if (!(condition)) {                                                                               \
      fprintf(stderr, "c_host: line %d: %s (last error: %s)\n", __LINE__, #condition, ff_last_error()); \
      exit(1);                                                                                        \
    }                                                                                                 \
  } while (0)

enum { kSide = 64, kMostBounces = 64 };

typedef struct Host {
  RTCDevice device;
  RTCScene scene;
  FfRuntime* runtime;
  unsigned geometry;
  int messages;
} Host;

static void count_message(void* user, FfSeverity severity, const char* message) {
  if (severity != FF_INFO && message[0] != '\0') ++((Host*)user)->messages;
}

static void plan_and_commit(Host* host, const float eye[3]) {
  FfCamera camera = {{eye[0], eye[1], eye[2]}, 0.0f, 0.01f};
  FfPlan plan = FF_PLAN_INIT;
  CHECK(ff_set_cameras(host->runtime, &camera, 1) == FF_OK);
  CHECK(ff_plan_frame(host->runtime, &plan) == FF_OK);
  CHECK(plan.planned_bytes > 0 && plan.bias == 0.0);
  CHECK(ff_look_ahead(host->runtime, &camera, 1) == FF_OK);
  CHECK(ff_attach(host->runtime, host->scene, &host->geometry) == FF_OK);
  rtcCommitScene(host->scene);
}

static struct RTCRayHit make_ray(const float origin[3], const float direction[3]) {
  struct RTCRayHit ray;
  memset(&ray, 0, sizeof ray);
  ray.ray.org_x = origin[0], ray.ray.org_y = origin[1], ray.ray.org_z = origin[2];
  ray.ray.dir_x = direction[0], ray.ray.dir_y = direction[1], ray.ray.dir_z = direction[2];
  ray.ray.tfar = INFINITY;
  ray.ray.mask = 0xffffffffu;
  ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

/* Green light that comes along a path from everywhere, 1. Returns the number of hits. */
static int trace_path(const Host* host, const float eye[3], const float toward[3], uint64_t seed, float* green) {
  float origin[3], direction[3];
  FfRayContext context;
  FfRng rng;
  int hits = 0;
  memcpy(origin, eye, sizeof origin), memcpy(direction, toward, sizeof direction);
  ff_ray_context_init(&context);
  ff_rng_init(&rng, seed, 0);
  context.path_seed = (uint32_t)seed;
  context.cone_spread = 0.01f;
  for (*green = 1.0f; hits < kMostBounces; ++hits) {
    struct RTCRayHit ray = make_ray(origin, direction);
    FfInteraction hit;
    FfScatterSample sample;
    context.ray_seed = (uint32_t)(16777216.0f * ff_rng_next(&rng));
    rtcIntersect1(host->scene, &context.embree, &ray);
    if (ray.hit.geomID != host->geometry) break;
    hit.size = sizeof hit;
    CHECK(ff_interaction(host->runtime, &ray, &context, &hit) == FF_OK);
    CHECK(hit.kind == FF_SURFACE || hit.kind == FF_VOLUME);
    CHECK(hit.instance == 0 && hit.instance_data.id == 42 && hit.footprint > 0.0f && hit.diffuse[1] > 0.0f);
    CHECK((hit.sigma_t > 0.0f) == (hit.kind == FF_VOLUME));
    ff_sample(&hit, &rng, &sample);
    CHECK(sample.pdf <= 0.0f || ff_pdf(&hit, sample.wi) > 0.0f);
    *green *= sample.weight[1];
    ff_spawn(&hit, &sample, ray.ray.tfar, &context);
    ff_ray_origin(&hit, sample.wi, origin);
    memcpy(direction, sample.wi, sizeof direction);
    if (!(*green > 0.0f)) break;
  }
  return hits;
}

/* Paths of an image of the asset: how many meet it, and what they bring on average. */
static int look(const Host* host, const float eye[3], float* mean) {
  int seen = 0, x, y;
  double sum = 0;
  for (y = 0; y < kSide; ++y) {
    for (x = 0; x < kSide; ++x) {
      const float dx = ((float)x + 0.5f) / kSide - 0.5f, dy = ((float)y + 0.5f) / kSide - 0.5f;
      const float length = sqrtf(dx * dx + dy * dy + 1.0f);
      const float toward[3] = {dx / length, dy / length, -1.0f / length};
      float green;
      if (trace_path(host, eye, toward, (uint64_t)(y * kSide + x), &green) == 0) continue;
      ++seen;
      sum += green;
    }
  }
  *mean = seen ? (float)(sum / seen) : 0.0f;
  return seen;
}

static void refusals(Host* host, uint32_t asset) {
  FfOptions newer = FF_OPTIONS_INIT, no_budget = FF_OPTIONS_INIT;
  FfRuntime* none = NULL;
  uint32_t id;
  const float flat[12] = {0};
  float lower[3], upper[3];
  newer.size = sizeof newer + 8;
  CHECK(ff_create(host->device, &newer, &none) == FF_UNSUPPORTED && none == NULL);
  CHECK(strstr(ff_last_error(), "this library knows up to") != NULL);
  no_budget.budget_bytes = 0;
  CHECK(ff_create(host->device, &no_budget, &none) == FF_INVALID_ARGUMENT);
  CHECK(ff_open_asset(host->runtime, "/nowhere.farfield", &id) == FF_NOT_FOUND);
  CHECK(strstr(ff_last_error(), "/nowhere.farfield") != NULL);
  CHECK(ff_add_instance(host->runtime, asset, flat, NULL, &id) == FF_INVALID_ARGUMENT);
  CHECK(ff_add_instance(host->runtime, asset + 1, flat, NULL, &id) == FF_INVALID_ARGUMENT);
  CHECK(ff_bounds(host->runtime, asset + 1, lower, upper) == FF_INVALID_ARGUMENT);
  CHECK(ff_attach(host->runtime, NULL, &id) == FF_INVALID_ARGUMENT);
  ff_destroy(NULL);
}

int main(int argc, char** argv) {
  Host host;
  FfOptions options = FF_OPTIONS_INIT;
  FfStats stats = FF_STATS_INIT;
  const FfInstanceData data = {42, {1, 1, 1}};
  float identity[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  const float keys[24] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1e5f, 0, 0};
  float lower[3], upper[3], eye[3], mean;
  uint32_t asset, instance;
  int seen;
  if (argc != 2) return fprintf(stderr, "usage: c_host ASSET\n"), 1;
  memset(&host, 0, sizeof host);
  host.device = rtcNewDevice("");
  host.scene = rtcNewScene(host.device);
  options.messages = count_message;
  options.messages_user = &host;
  options.size = offsetof(FfOptions, messages_user) + sizeof options.messages_user; /* as an older header's */
  CHECK(ff_create(host.device, &options, &host.runtime) == FF_OK);
  CHECK(ff_open_asset(host.runtime, argv[1], &asset) == FF_OK);
  CHECK(ff_bounds(host.runtime, asset, lower, upper) == FF_OK);
  CHECK(ff_add_instance(host.runtime, asset, identity, &data, &instance) == FF_OK && instance == 0);
  eye[0] = 0.5f * (lower[0] + upper[0]), eye[1] = 0.5f * (lower[1] + upper[1]);
  eye[2] = upper[2] + (upper[0] - lower[0]);
  plan_and_commit(&host, eye);
  CHECK(ff_prefetch(host.runtime) == FF_OK);
  seen = look(&host, eye, &mean);
  printf("%d of %d pixels see it, %.3f of the light comes back\n", seen, kSide * kSide, mean);
  CHECK(seen > 100 && mean > 0.0f && mean < 1.0f);

  refusals(&host, asset);
  identity[11] = 1e5f; /* behind the camera */
  CHECK(ff_move_instance(host.runtime, instance, identity) == FF_OK);
  plan_and_commit(&host, eye);
  CHECK(look(&host, eye, &mean) == 0);
  identity[11] = 0;
  CHECK(ff_move_instance(host.runtime, instance, identity) == FF_OK);
  CHECK(ff_move_instance_keys(host.runtime, instance, keys, 2) == FF_OK);
  plan_and_commit(&host, eye);
  CHECK(look(&host, eye, &mean) == seen); /* rays are at time 0 */
  CHECK(ff_move_instance_keys(host.runtime, instance, keys, 0) == FF_INVALID_ARGUMENT);
  CHECK(ff_move_instance(host.runtime, instance, identity) == FF_OK);
  CHECK(ff_set_visible(host.runtime, instance, 0) == FF_OK);
  plan_and_commit(&host, eye);
  CHECK(look(&host, eye, &mean) == 0);
  CHECK(ff_set_visible(host.runtime, instance, 1) == FF_OK);
  plan_and_commit(&host, eye);
  CHECK(look(&host, eye, &mean) == seen);
  CHECK(ff_remove_instance(host.runtime, instance) == FF_OK);
  CHECK(ff_remove_instance(host.runtime, instance) == FF_INVALID_ARGUMENT);
  plan_and_commit(&host, eye);
  CHECK(look(&host, eye, &mean) == 0);

  CHECK(ff_stats(host.runtime, &stats) == FF_OK && stats.levels_loaded > 0 && stats.fallbacks == 0);
  CHECK(stats.peak_accounted_bytes <= options.budget_bytes && host.messages == 0);
  ff_destroy(host.runtime);
  rtcReleaseScene(host.scene);
  rtcReleaseDevice(host.device);
  return 0;
}
