// SPDX-License-Identifier: Apache-2.0
// farfield/farfield.h over farfield/runtime.h: copies values, turns Results into codes, and lets no exception out.
#include "farfield/farfield.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <type_traits>

#include "farfield/runtime.h"

using namespace farfield;

struct FfRuntime {
  std::unique_ptr<Runtime> runtime;
};

namespace {

thread_local std::string last_error;

FfStatus status_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
      return FF_INVALID_ARGUMENT;
    case ErrorCode::NotFound:
      return FF_NOT_FOUND;
    case ErrorCode::Io:
      return FF_IO;
    case ErrorCode::BadFile:
      return FF_BAD_FILE;
    case ErrorCode::Unsupported:
      return FF_UNSUPPORTED;
    case ErrorCode::OutOfBudget:
      return FF_OUT_OF_BUDGET;
    case ErrorCode::Cancelled:
      return FF_CANCELLED;
  }
  return FF_IO;
}

FfStatus failed(ErrorCode code, const std::string& message) {
  last_error = message;
  return status_of(code);
}

/// Runs what gives a Result<void>.
template <typename Call>
FfStatus guarded(Call&& call) {
  try {
    const Result<void> result = call();
    return result ? FF_OK : failed(result.error().code, result.error().message);
  } catch (const std::exception& exception) {
    return failed(ErrorCode::Io, exception.what());
  }
}

/// The caller's struct in this library's version: what it does not have stays at its default.
template <typename Struct>
Result<Struct> read_versioned(const Struct& given, const Struct& defaults) {
  if (given.size < sizeof(size_t) || given.size > sizeof(Struct)) {
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("a struct of {} bytes, and this library knows up to {}: set it up with its _INIT, and "
                    "use a library that is not older than the header",
                    given.size, sizeof(Struct)));
  }
  Struct read = defaults;
  std::memcpy(&read, &given, given.size);
  return read;
}

/// The same the other way: what the caller's version has room for.
template <typename Struct>
Result<void> write_versioned(Struct& target, Struct value) {
  const auto known = read_versioned(target, value);
  if (!known) return tl::unexpected(known.error());
  value.size = target.size;
  std::memcpy(&target, &value, target.size);
  return {};
}

glm::vec3 to_vec3(const float v[3]) { return {v[0], v[1], v[2]}; }
std::vector<TessellationCamera> to_cameras(const FfCamera* cameras, size_t count) {
  std::vector<TessellationCamera> all;
  for (size_t i = 0; i < count; ++i) {
    all.push_back({to_vec3(cameras[i].position), cameras[i].pixel_width, cameras[i].pixel_spread});
  }
  return all;
}
ScatterSample to_sample(const FfScatterSample& sample) {
  return {to_vec3(sample.wi), to_vec3(sample.weight), sample.pdf};
}
void copy(const glm::vec3& v, float to[3]) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

glm::mat4x3 to_matrix(const float m[12]) {
  return glm::mat4x3(to_vec3(m), to_vec3(m + 3), to_vec3(m + 6), to_vec3(m + 9));
}

// ---- what lies in the bytes of C structs ----

static_assert(std::is_trivially_copyable_v<RayContext> && std::is_trivially_copyable_v<Interaction> &&
              std::is_trivially_copyable_v<Rng>);
static_assert(sizeof(RayContext) <= sizeof(FfRayContext) && alignof(RayContext) <= alignof(FfRayContext));
static_assert(offsetof(RayContext, embree) == offsetof(FfRayContext, embree) &&
              offsetof(RayContext, cone_width) == offsetof(FfRayContext, cone_width) &&
              offsetof(RayContext, cone_spread) == offsetof(FfRayContext, cone_spread) &&
              offsetof(RayContext, path_seed) == offsetof(FfRayContext, path_seed) &&
              offsetof(RayContext, ray_seed) == offsetof(FfRayContext, ray_seed));
static_assert(sizeof(Interaction) <= sizeof(FfInteraction::state) && sizeof(Rng) == sizeof(FfRng));

RayContext& context_in(FfRayContext& context) { return *std::launder(reinterpret_cast<RayContext*>(&context)); }
const RayContext& context_in(const FfRayContext& context) {
  return *std::launder(reinterpret_cast<const RayContext*>(&context));
}

/// Interactions are aligned more than C sees to.
Interaction interaction_in(const FfInteraction& interaction) {
  Interaction copied;
  std::memcpy(static_cast<void*>(&copied), interaction.state, sizeof copied);
  return copied;
}

/// Calls with the stream that the bytes hold, and puts it back.
template <typename Call>
auto with_rng(FfRng& bytes, Call&& call) {
  Rng rng(0);
  std::memcpy(static_cast<void*>(&rng), &bytes, sizeof rng);
  auto result = call(rng);
  std::memcpy(&bytes, &rng, sizeof rng);
  return result;
}

FfInteraction to_c(const Interaction& in, const InstanceData& data) {
  FfInteraction out{};
  out.size = sizeof out;
  out.kind = static_cast<FfKind>(in.kind);
  out.instance = in.instance, out.level = in.level;
  out.lambda = in.lambda, out.footprint = in.footprint;
  copy(in.position, out.position), copy(in.wo, out.wo);
  copy(in.geometric_normal, out.geometric_normal), copy(in.shading_normal, out.shading_normal);
  copy(in.albedo, out.albedo), copy(in.emission, out.emission);
  copy(in.reflectance.diffuse, out.diffuse), copy(in.reflectance.specular, out.specular);
  copy(in.reflectance.transmission, out.transmission);
  out.roughness = in.reflectance.roughness, out.self_shadowing = in.reflectance.self_shadowing;
  std::ranges::copy(in.reflectance.sggx, out.sggx);
  out.material = in.material, out.source_face = in.source_face;
  out.barycentric[0] = in.barycentric.x, out.barycentric[1] = in.barycentric.y;
  out.uv[0] = in.uv.x, out.uv[1] = in.uv.y;
  out.instance_data.id = data.id;
  copy(data.tint, out.instance_data.tint);
  out.sigma_t = in.sigma_t;
  copy(in.reflectance.fog, out.fog), out.anisotropy = in.reflectance.anisotropy;
  std::memcpy(out.state, static_cast<const void*>(&in), sizeof in);
  return out;
}

}  // namespace

extern "C" {

const char* ff_last_error(void) { return last_error.c_str(); }

FfStatus ff_create(RTCDevice host_device, const FfOptions* options, FfRuntime** runtime) {
  return guarded([&]() -> Result<void> {
    *runtime = nullptr;
    const auto given = read_versioned(*options, FfOptions(FF_OPTIONS_INIT));
    if (!given) return tl::unexpected(given.error());
    RuntimeOptions all;
    all.budget_bytes = given->budget_bytes;
    all.pixel_error = given->pixel_error;
    all.residency = given->is_progressive ? Residency::Progressive : Residency::Wait;
    all.has_geometry_filters = given->has_geometry_filters != 0;
    all.scene_bytes_per_instance = given->scene_bytes_per_instance;
    if (given->messages) {
      all.messages = [sink = given->messages, user = given->messages_user](Severity severity, const std::string& text) {
        sink(user, static_cast<FfSeverity>(severity), text.c_str());
      };
    }
    auto made = Runtime::create(host_device, all);
    if (!made) return tl::unexpected(made.error());
    *runtime = new FfRuntime{std::move(*made)};
    return {};
  });
}

void ff_destroy(FfRuntime* runtime) { delete runtime; }

FfStatus ff_open_asset(FfRuntime* runtime, const char* folder, uint32_t* asset) {
  return guarded([&] { return runtime->runtime->open_asset(folder).map([&](AssetId id) { *asset = id.value; }); });
}

FfStatus ff_bounds(FfRuntime* runtime, uint32_t asset, float lower[3], float upper[3]) {
  return guarded([&]() -> Result<void> {
    glm::vec3 from, to;
    runtime->runtime->bounds(AssetId{asset}, from, to);
    if (!(from.x <= to.x)) return make_error(ErrorCode::InvalidArgument, fmt::format("there is no asset {}", asset));
    copy(from, lower), copy(to, upper);
    return {};
  });
}

FfStatus ff_add_instance(FfRuntime* runtime, uint32_t asset, const float local_to_world[12], const FfInstanceData* data,
                         uint32_t* instance) {
  return guarded([&] {
    const InstanceData of_host = data ? InstanceData{data->id, to_vec3(data->tint)} : InstanceData();
    return runtime->runtime->add_instance(AssetId{asset}, to_matrix(local_to_world), of_host).map([&](InstanceId id) {
      *instance = id.value;
    });
  });
}

FfStatus ff_move_instance(FfRuntime* runtime, uint32_t instance, const float local_to_world[12]) {
  return guarded([&] { return runtime->runtime->move_instance(InstanceId{instance}, to_matrix(local_to_world)); });
}

FfStatus ff_move_instance_keys(FfRuntime* runtime, uint32_t instance, const float* keys, size_t count) {
  return guarded([&] {
    std::vector<glm::mat4x3> places;
    for (size_t i = 0; i < count; ++i) places.push_back(to_matrix(keys + 12 * i));
    return runtime->runtime->move_instance(InstanceId{instance}, places);
  });
}

FfStatus ff_set_visible(FfRuntime* runtime, uint32_t instance, int is_visible) {
  return guarded([&] { return runtime->runtime->set_visible(InstanceId{instance}, is_visible != 0); });
}

FfStatus ff_remove_instance(FfRuntime* runtime, uint32_t instance) {
  return guarded([&] { return runtime->runtime->remove_instance(InstanceId{instance}); });
}

FfStatus ff_limit_instance_levels(FfRuntime* runtime, uint32_t instance, uint8_t finest, uint8_t coarsest) {
  return guarded([&] { return runtime->runtime->set_level_limits(InstanceId{instance}, {finest, coarsest}); });
}

FfStatus ff_limit_asset_levels(FfRuntime* runtime, uint32_t asset, uint8_t finest, uint8_t coarsest) {
  return guarded([&] { return runtime->runtime->set_level_limits(AssetId{asset}, {finest, coarsest}); });
}

FfStatus ff_set_cameras(FfRuntime* runtime, const FfCamera* cameras, size_t count) {
  return guarded([&]() -> Result<void> {
    runtime->runtime->set_cameras(to_cameras(cameras, count));
    return {};
  });
}

FfStatus ff_plan_frame(FfRuntime* runtime, FfPlan* plan) {
  return guarded([&]() -> Result<void> {
    const auto made = runtime->runtime->plan_frame();
    if (!made) return tl::unexpected(made.error());
    if (!plan) return {};
    return write_versioned(*plan, FfPlan{sizeof(FfPlan), made->planned_bytes, made->asked_bytes, made->bias});
  });
}

FfStatus ff_prefetch(FfRuntime* runtime) {
  return guarded([&]() -> Result<void> {
    runtime->runtime->prefetch();
    return {};
  });
}

FfStatus ff_look_ahead(FfRuntime* runtime, const FfCamera* cameras, size_t count) {
  return guarded([&]() -> Result<void> {
    runtime->runtime->look_ahead(to_cameras(cameras, count));
    return {};
  });
}

FfStatus ff_attach(FfRuntime* runtime, RTCScene scene, unsigned* geometry_id) {
  return guarded([&] { return runtime->runtime->attach(scene).map([&](unsigned id) { *geometry_id = id; }); });
}

FfStatus ff_stats(const FfRuntime* runtime, FfStats* stats) {
  return guarded([&] {
    const Stats now = runtime->runtime->stats();
    return write_versioned(*stats,
                           FfStats{sizeof(FfStats), now.accounted_bytes, now.peak_accounted_bytes, now.levels_loaded,
                                   now.levels_resident, now.fallbacks, now.load_seconds, now.wait_seconds});
  });
}

void ff_ray_context_init(FfRayContext* context) {
  std::memset(static_cast<void*>(context), 0, sizeof *context);
  new (context) RayContext;
}

void ff_set_origin(FfRayContext* context, const FfRayContext* from) {
  context_in(*context).set_origin(context_in(*from).hit);
}

void ff_measure_transmittance(FfRayContext* context) { context_in(*context).transmittance = 1; }

float ff_transmittance(const FfRayContext* context) { return context_in(*context).transmittance; }

void ff_set_differential(FfRayContext* context, const float differential[12], const float unit_direction[3],
                         int by_longer_axis) {
  const RayDifferential of_ray{to_vec3(differential), to_vec3(differential + 3), to_vec3(differential + 6),
                               to_vec3(differential + 9)};
  context_in(*context).set_differential(of_ray, to_vec3(unit_direction),
                                        by_longer_axis ? FootprintAxis::Longer : FootprintAxis::Shorter);
}

void ff_clear_origin(FfRayContext* context) { context_in(*context).set_origin(HitRecord()); }

FfStatus ff_interaction(const FfRuntime* runtime, const RTCRayHit* ray_hit, const FfRayContext* context,
                        FfInteraction* interaction) {
  return guarded([&] {
    const Interaction made = runtime->runtime->interaction(*ray_hit, context_in(*context));
    return write_versioned(*interaction, to_c(made, runtime->runtime->instance_data(made)));
  });
}

void ff_rng_init(FfRng* rng, uint64_t seed, uint64_t sequence) {
  const Rng made(seed, sequence);
  std::memcpy(rng, &made, sizeof made);
}

float ff_rng_next(FfRng* rng) {
  return with_rng(*rng, [](Rng& stream) { return stream.next(); });
}

void ff_sample(const FfInteraction* interaction, FfRng* rng, FfScatterSample* sample) {
  const ScatterSample drawn = with_rng(*rng, [&](Rng& stream) { return interaction_in(*interaction).sample(stream); });
  copy(drawn.wi, sample->wi), copy(drawn.weight, sample->weight);
  sample->pdf = drawn.pdf;
}

void ff_eval(const FfInteraction* interaction, const float wi[3], FfRng* rng, float value[3]) {
  copy(with_rng(*rng, [&](Rng& stream) { return interaction_in(*interaction).eval(to_vec3(wi), stream); }), value);
}

float ff_pdf(const FfInteraction* interaction, const float wi[3]) {
  return interaction_in(*interaction).pdf(to_vec3(wi));
}

void ff_ray_origin(const FfInteraction* interaction, const float wi[3], float origin[3]) {
  copy(interaction_in(*interaction).ray_origin(to_vec3(wi)), origin);
}

void ff_spawn(const FfInteraction* interaction, const FfScatterSample* sample, float t, FfRayContext* context) {
  interaction_in(*interaction).spawn(to_sample(*sample), t, context_in(*context));
}

float ff_next_cone_spread(const FfInteraction* interaction, const FfScatterSample* sample, float cone_spread) {
  return interaction_in(*interaction).next_cone_spread(to_sample(*sample), cone_spread);
}

}  // extern "C"
