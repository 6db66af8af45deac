// SPDX-License-Identifier: Apache-2.0
// A shot: the camera pulls back from one instance of an asset until a field of them is a texture on the ground. Near
// and far are drawn with the same number of rays and the same budget; what changes is which levels the rays meet.
// Read minimal_host first. New here: the cameras of a whole shot, what they cost, and direct light with eval().
//
//   pull_back ASSET.farfield FOLDER [FRAMES [BUDGET_MIB [shot|frame]]]
//
// Writes FOLDER/frame_000.ppm and so on, and a line per frame. `shot` (the default) plans once, for the cameras of all
// frames: no instance changes its level for another reason than that rays came nearer or went away, and nothing is
// loaded twice. `frame` plans anew for each frame: what only the near frames needed is given back on the way, and each
// frame's levels are loaded while the one before is rendered.
#include <farfield/embree.h>
#include <farfield/runtime.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <vector>

#include "../common/host.h"

using glm::vec3;

namespace {

constexpr const char* kUsage = "usage: pull_back ASSET.farfield FOLDER [FRAMES [BUDGET_MIB [shot|frame]]]";
constexpr int kWidth = 320, kHeight = 180, kSamples = 16, kMaxDepth = 8;
constexpr float kFieldOfView = 0.6f;                 // vertical, rad
constexpr int kSide = 15;                            // instances along a side of the field
constexpr float kNearest = 0.9f, kFarthest = 40.0f;  // distances of the camera, in sizes of the asset
const vec3 kTowardsCamera = glm::normalize(vec3(0.3f, 0.6f, 1.0f));
const vec3 kTowardsSun = glm::normalize(vec3(1.0f, 1.5f, 0.6f));
const vec3 kSunIrradiance(3.0f, 2.8f, 2.4f);
constexpr float kSunSpread = 0.009f;  // the sun is half a degree wide

struct Arguments {
  const char* asset;
  std::filesystem::path folder;
  int frames = 12;
  uint64_t budget_bytes = uint64_t{1} << 30;
  bool plans_each_frame = false;
};

Arguments parse(int argc, char** argv) {
  if (argc < 3 || argc > 6) host::fail(kUsage);
  Arguments arguments{argv[1], argv[2]};
  if (argc > 3) arguments.frames = static_cast<int>(host::parse_count(argv[3], 1000, kUsage));
  if (argc > 4) arguments.budget_bytes = uint64_t{host::parse_count(argv[4], host::kMaxMib, kUsage)} << 20;
  if (argc > 5) {
    arguments.plans_each_frame = std::strcmp(argv[5], "frame") == 0;
    if (!arguments.plans_each_frame && std::strcmp(argv[5], "shot") != 0) host::fail(kUsage);
  }
  return arguments;
}

/// A field of instances around the asset's own place, each turned about its vertical axis.
void add_field(farfield::Runtime& runtime, farfield::AssetId asset, const host::Box& bounds) {
  const vec3 foot(bounds.center().x, bounds.lower.y, bounds.center().z);
  for (int i = 0; i < kSide * kSide; ++i) {
    const float angle = 2.4f * static_cast<float>(i);  // the golden angle: no two neighbours are turned alike
    const float c = std::cos(angle), s = std::sin(angle);
    const vec3 place(static_cast<float>(i % kSide - kSide / 2), 0.0f, static_cast<float>(i / kSide - kSide / 2));
    glm::mat4x3 local_to_world(vec3(c, 0, -s), vec3(0, 1, 0), vec3(s, 0, c), vec3(0));
    local_to_world[3] = foot + bounds.longest_side() * place - glm::mat3(local_to_world) * foot;
    host::or_fail(runtime.add_instance(asset, local_to_world));
  }
}

/// The cameras of all frames: the distance grows by the same factor from each to the next.
std::vector<host::Camera> pull_back_cameras(const host::Box& bounds, int frames) {
  std::vector<host::Camera> cameras;
  for (int i = 0; i < frames; ++i) {
    const float time = frames > 1 ? static_cast<float>(i) / static_cast<float>(frames - 1) : 0.0f;
    const float distance = bounds.longest_side() * kNearest * std::pow(kFarthest / kNearest, time);
    const vec3 target = bounds.center();
    cameras.push_back({target + distance * kTowardsCamera, target, kFieldOfView, kWidth, kHeight});
  }
  return cameras;
}

vec3 sky(const vec3& direction) {
  return glm::mix(vec3(0.75f, 0.8f, 0.85f), vec3(0.25f, 0.45f, 0.8f), std::max(direction.y, 0.0f));
}

struct Pixel {
  vec3 radiance{0.0f};
  uint32_t finest_level = ~0u;  ///< that its paths met
};

/// One path at a time. Where it stands: the end of `context` that the host fills for every ray.
class PathTracer {
 public:
  PathTracer(RTCScene scene, const farfield::Runtime& runtime) : scene_(scene), runtime_(runtime) {}

  /// Adds the light of one path to a pixel. At each surface: the sun by a ray towards it, the sky by going on.
  void trace(vec3 origin, vec3 direction, float pixel_spread, farfield::Rng& rng, Pixel& pixel) const {
    vec3 throughput(1.0f);
    farfield::RayContext context;
    context.path_seed = rng.next_uint();
    context.cone_spread = pixel_spread;
    for (int depth = 0; depth < kMaxDepth && throughput != vec3(0.0f); ++depth) {
      RTCRayHit ray = host::make_ray(origin, direction);
      context.ray_seed = rng.next_uint();
      rtcIntersect1(scene_, &context.embree, &ray);
      if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        pixel.radiance += throughput * sky(direction);
        return;
      }
      context.cone_width += context.cone_spread * ray.ray.tfar;
      if (ray.hit.geomID == runtime_.geometry_id()) {
        const farfield::Interaction interaction = runtime_.interaction(ray, context);
        context.set_origin(context.hit);
        pixel.finest_level = std::min(pixel.finest_level, interaction.level);
        pixel.radiance += throughput * interaction.emission;
        const vec3 sun = interaction.eval(kTowardsSun, rng);
        pixel.radiance += throughput * sun * sunlight(interaction.ray_origin(kTowardsSun), context, rng);
        const farfield::ScatterSample sample = interaction.sample(rng);
        throughput *= sample.weight;
        context.cone_spread = interaction.next_cone_spread(sample, context.cone_spread);
        origin = interaction.ray_origin(sample.wi);
        direction = sample.wi;
      } else {  // the ground: Lambert's law
        context.origin_instance = farfield::kNoInstance;
        origin = host::above_ground(ray);
        throughput *= host::kGroundAlbedo;
        pixel.radiance += throughput * (kTowardsSun.y / host::kPi) * sunlight(origin, context, rng);
        context.cone_spread += 0.25f;
        direction = host::cosine_direction_up(rng);
      }
    }
  }

 private:
  /// What of the sun's light reaches a point. The ray goes on with the path's cone, now as wide as the sun. It keeps
  /// the path's seed and origin: it meets the levels that the path meets, so nothing shadows itself.
  vec3 sunlight(const vec3& point, const farfield::RayContext& path, farfield::Rng& rng) const {
    farfield::RayContext context = path;
    context.cone_spread = kSunSpread;
    context.ray_seed = rng.next_uint();
    RTCRay ray = host::make_ray(point, kTowardsSun).ray;
    rtcOccluded1(scene_, &context.embree, &ray);
    return ray.tfar < 0.0f ? vec3(0.0f) : kSunIrradiance;
  }

  RTCScene scene_;
  const farfield::Runtime& runtime_;
};

struct Picture {
  std::vector<vec3> pixels;
  uint32_t finest_level = ~0u;
};

Picture render(const PathTracer& tracer, const host::Camera& camera) {
  std::vector<Pixel> pixels(static_cast<size_t>(kWidth) * kHeight);
  host::for_each_row(kHeight, host::processor_count(), [&](int y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t index = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      farfield::Rng rng(index);
      for (int sample = 0; sample < kSamples; ++sample) {
        const float dx = rng.next(), dy = rng.next();
        const vec3 direction = camera.direction(static_cast<float>(x) + dx, static_cast<float>(y) + dy);
        tracer.trace(camera.eye, direction, camera.pixel_spread(), rng, pixels[index]);
      }
    }
  });
  Picture picture;
  for (const Pixel& pixel : pixels) {
    picture.pixels.push_back(pixel.radiance / static_cast<float>(kSamples));
    picture.finest_level = std::min(picture.finest_level, pixel.finest_level);
  }
  return picture;
}

/// Decides which levels rays may meet while these cameras look.
void plan_for(farfield::Runtime& runtime, const std::vector<host::Camera>& cameras) {
  std::vector<farfield::TessellationCamera> tessellation;
  for (const host::Camera& camera : cameras) tessellation.push_back(camera.tessellation());
  runtime.set_cameras(std::move(tessellation));
  const farfield::PlanSummary plan = host::or_fail(runtime.plan_frame());
  if (plan.bias > 0.0) std::printf("the budget makes levels %.2f coarser than asked, on average\n", plan.bias);
}

void print_frame(size_t frame, const Picture& picture, const farfield::Stats& before, const farfield::Stats& now) {
  const std::string finest = picture.finest_level == ~0u ? "-" : std::to_string(picture.finest_level);
  std::printf("frame %3zu: finest level %s, %.2f MiB accounted, %llu levels loaded, %llu released, %llu fallbacks\n",
              frame, finest.c_str(), static_cast<double>(now.accounted_bytes) / (1 << 20),
              static_cast<unsigned long long>(now.levels_loaded - before.levels_loaded),
              static_cast<unsigned long long>(now.levels_released - before.levels_released),
              static_cast<unsigned long long>(now.fallbacks - before.fallbacks));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);
  farfield::RuntimeOptions options;
  options.budget_bytes = arguments.budget_bytes;
  options.messages = host::messages_to_stderr();
  const std::unique_ptr<farfield::Runtime> runtime = host::or_fail(farfield::Runtime::create(device, options));
  const farfield::AssetId asset = host::or_fail(runtime->open_asset(arguments.asset));
  host::Box bounds;
  runtime->bounds(asset, bounds.lower, bounds.upper);
  add_field(*runtime, asset, bounds);

  // Instances do not move in this shot: the scene is committed once, whatever is planned and loaded later.
  host::or_fail(runtime->attach(scene));
  const vec3 foot(bounds.center().x, bounds.lower.y, bounds.center().z);
  host::add_ground(device, scene, foot, 1000.0f * bounds.longest_side());
  rtcCommitScene(scene);

  std::error_code error;
  std::filesystem::create_directories(arguments.folder, error);
  if (error) host::fail("cannot make the folder " + arguments.folder.string() + ": " + error.message());
  const std::vector<host::Camera> cameras = pull_back_cameras(bounds, arguments.frames);
  if (!arguments.plans_each_frame) plan_for(*runtime, cameras);
  const PathTracer tracer(scene, *runtime);
  for (size_t frame = 0; frame < cameras.size(); ++frame) {
    const farfield::Stats before = runtime->stats();
    if (arguments.plans_each_frame) {
      plan_for(*runtime, {cameras[frame]});
      // What the next frame needs is loaded while this one is rendered, if the budget has room for both.
      if (frame + 1 < cameras.size()) runtime->look_ahead({cameras[frame + 1].tessellation()});
    }
    const Picture picture = render(tracer, cameras[frame]);
    print_frame(frame, picture, before, runtime->stats());
    char name[32];
    std::snprintf(name, sizeof name, "frame_%03zu.ppm", frame);
    host::write_ppm((arguments.folder / name).string(), kWidth, kHeight, picture.pixels);
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
