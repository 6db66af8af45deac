// SPDX-License-Identifier: Apache-2.0
// The path tracer against the real Runtime: a white sphere whose levels are meshes, haze and dense voxels.
#include "path_tracer/integrator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "base/parallel.h"
#include "path_tracer/asset_view.h"
#include "tests/support/files.h"
#include "tests/support/image_statistics.h"
#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

constexpr float kAllLevels[] = {0, 0.5f, 1, 2, 2.5f, 3, 4.5f, 5};

// One sphere asset on disk for all tests of this file.
class PathTrace : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    std::vector<LevelData> levels = test::white_sphere(32);
    test::write_asset(white(), levels);
    for (LevelData& level : levels) test::set_diffuse(level, vec3(0.7f, 0.4f, 0.1f));
    test::write_asset(brown(), levels);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::filesystem::path white() { return folder_->path() / "white.farfield"; }
  static std::filesystem::path brown() { return folder_->path() / "brown.farfield"; }

  static std::unique_ptr<AssetView> open(const std::filesystem::path& folder, float lambda) {
    auto view = AssetView::open(folder, lambda);
    EXPECT_TRUE(view) << view.error().message;
    return std::move(*view);
  }
  // The whole sphere, with a border.
  static ViewOptions view_options(int side, int spp, LightStrategy strategy = LightStrategy::Mis) {
    ViewOptions options;
    options.width_world = 2.4f;
    options.width = options.height = side;
    options.direction = {-1, -0.5f, -0.25f};
    options.trace.samples_per_pixel = spp;
    options.trace.max_depth = 1 << 20;
    options.trace.strategy = strategy;
    options.trace.seed = 7;
    return options;
  }
  static Lights constant_light(const vec3& radiance = vec3(1.0f)) { return {Environment::constant(radiance), {}}; }
  static Lights sun_light() {
    SunSkyOptions options = default_sun_sky();
    options.sun_angle_rad = 0.2f;  // so that rays that scatter by chance find it too
    return {Environment::sun_sky(options), {}};
  }

  static test::TemporaryFolder* folder_;
};
test::TemporaryFolder* PathTrace::folder_ = nullptr;

TEST_F(PathTrace, WhiteFurnaceIsOneForEachPathAtEveryLevel) {
  // Without next-event estimation every path ends in the light with the throughput 1: no noise at all.
  for (const float lambda : kAllLevels) {
    const auto view = open(white(), lambda);
    const auto images = view->render(view_options(24, 4, LightStrategy::ScatterRays), constant_light());
    ASSERT_TRUE(images) << images.error().message;
    for (size_t i = 0; i < images->mean.values.size(); i += 4) {
      const float alpha = images->mean.values[i + 3];
      for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(images->mean.values[i + c], alpha, 2e-3f) << "lambda " << lambda;
    }
  }
}

TEST_F(PathTrace, WhiteFurnaceIsOneInTheMeanWithEveryStrategy) {
  for (const float lambda : {0.0f, 2.0f, 3.0f}) {
    const auto view = open(white(), lambda);
    for (const LightStrategy strategy : {LightStrategy::Mis, LightStrategy::LightSamples}) {
      const auto images = view->render(view_options(24, 64, strategy), constant_light());
      ASSERT_TRUE(images);
      const test::MeanEstimate difference = test::estimate_of(*images, [](const float* p) { return p[1] - p[3]; });
      EXPECT_LT(std::abs(difference.value), test::kSigmas * difference.standard_error + 1e-4)
          << "lambda " << lambda << ": " << difference.value << " +- " << difference.standard_error;
    }
  }
}

TEST_F(PathTrace, AllStrategiesGiveTheSameImage) {
  const Lights lights = sun_light();
  for (const float lambda : {0.0f, 0.5f, 2.0f, 3.0f, 4.5f}) {
    const auto view = open(brown(), lambda);
    const auto mean = [&](LightStrategy strategy, int channel) {
      const auto images = view->render(view_options(24, 128, strategy), lights);
      return test::estimate_of(*images, [channel](const float* p) { return p[channel]; });
    };
    for (const int channel : {0, 2}) {
      const test::MeanEstimate mixed = mean(LightStrategy::Mis, channel);
      EXPECT_GT(mixed.value, 0.02);
      for (const LightStrategy strategy : {LightStrategy::LightSamples, LightStrategy::ScatterRays}) {
        const test::MeanEstimate other = mean(strategy, channel);
        EXPECT_LT(std::abs(mixed.value - other.value),
                  test::kSigmas * std::hypot(mixed.standard_error, other.standard_error))
            << "lambda " << lambda << " channel " << channel << ": " << mixed.value << " and " << other.value;
        EXPECT_LT(mixed.standard_error, 1.2 * other.standard_error) << "lambda " << lambda;
      }
    }
  }
}

TEST_F(PathTrace, RouletteDoesNotChangeTheMean) {
  const auto view = open(brown(), 3);
  ViewOptions early = view_options(24, 128), late = early;
  early.trace.roulette_depth = 1;
  late.trace.roulette_depth = 1000;
  late.trace.seed = 8;
  const auto green = [](const float* p) { return p[1]; };
  const test::MeanEstimate a = test::estimate_of(*view->render(early, constant_light()), green);
  const test::MeanEstimate b = test::estimate_of(*view->render(late, constant_light()), green);
  EXPECT_LT(std::abs(a.value - b.value), test::kSigmas * std::hypot(a.standard_error, b.standard_error));
}

TEST_F(PathTrace, ConvexDiffuseSurfaceShowsItsAlbedoUnderAConstantSky) {
  const auto view = open(brown(), 0);
  ViewOptions options = view_options(8, 256);
  options.width_world = 0.5f;
  const auto images = view->render(options, constant_light());
  const auto expected = unpack_color(pack_color(vec3(0.7f, 0.4f, 0.1f)));
  for (int c = 0; c < 3; ++c) {
    const test::MeanEstimate mean = test::estimate_of(*images, [c](const float* p) { return p[c]; });
    EXPECT_NEAR(mean.value, expected[c], test::kSigmas * mean.standard_error + 1e-4);
  }
}

TEST_F(PathTrace, PointLightFollowsTheInverseSquareLaw) {
  const auto view = open(white(), 0);
  for (const float distance : {2.0f, 5.0f}) {
    ViewOptions options = view_options(1, 64);
    options.width_world = 0.01f;
    options.direction = {0, 0, -1};
    Lights lights;
    lights.points.push_back({});
    lights.points[0].position = {0, 0, 1 + distance};
    lights.points[0].intensity = vec3(10, 20, 30);
    const auto images = view->render(options, lights);
    // Lambert: albedo / pi * intensity / distance^2; the mesh lies a little below the sphere.
    EXPECT_NEAR(images->mean.values[1], 20 / (kPi * distance * distance), 0.02f * 20 / (kPi * distance * distance));
  }
  ViewOptions behind = view_options(1, 16);
  behind.width_world = 0.01f;
  behind.direction = {0, 0, -1};
  Lights lights;
  lights.points.push_back({});
  lights.points[0].position = {0, 0, -3};
  lights.points[0].intensity = vec3(10);
  EXPECT_EQ(view->render(behind, lights)->mean.values[1], 0.0f);  // the sphere's own shadow
}

TEST_F(PathTrace, AlphaIsTheShareOfRaysThatHit) {
  for (const float lambda : {0.0f, 3.0f}) {
    const auto view = open(white(), lambda);
    const auto images = view->render(view_options(48, 16), constant_light());
    const test::MeanEstimate alpha = test::estimate_of(*images, [](const float* p) { return p[3]; });
    EXPECT_NEAR(alpha.value, 3.14159 / (2.4 * 2.4), lambda == 0 ? 0.01 : 0.1);
  }
}

TEST_F(PathTrace, SamePixelsForAnyNumberOfThreadsAndColdOrWarm) {
  const Lights lights = sun_light();
  std::vector<Image> images;
  for (const int threads : {1, 2, 1}) {
    const ThreadLimit limit(threads);
    const auto view = open(brown(), 2.5f);  // two levels, loaded on first touch
    images.push_back(view->render(view_options(50, 3), lights)->mean);
    images.push_back(view->render(view_options(50, 3), lights)->mean);
  }
  for (const Image& image : images)
    EXPECT_EQ(std::memcmp(image.values.data(), images[0].values.data(), image.values.size() * sizeof(float)), 0);
}

TEST_F(PathTrace, OtherSeedsGiveOtherImages) {
  const auto view = open(brown(), 1);
  ViewOptions options = view_options(16, 2);
  const auto first = view->render(options, sun_light());
  options.trace.seed = 8;
  EXPECT_NE(first->mean.values, view->render(options, sun_light())->mean.values);
}

TEST_F(PathTrace, MaxDepthZeroSeesNoScatteredLight) {
  const auto view = open(white(), 0);
  ViewOptions options = view_options(8, 1);
  options.trace.max_depth = 0;
  const auto images = view->render(options, constant_light());
  EXPECT_EQ(*std::max_element(images->mean.values.begin(), images->mean.values.end()), 1.0f);  // alpha
  for (size_t i = 0; i < images->mean.values.size(); i += 4) EXPECT_EQ(images->mean.values[i], 0.0f);
}

TEST_F(PathTrace, ClampingOnlyTakesAway) {
  const auto view = open(white(), 3);
  ViewOptions options = view_options(16, 16);
  const auto green = [](const float* p) { return p[1]; };
  const double open_mean = test::estimate_of(*view->render(options, constant_light()), green).value;
  options.trace.clamp_indirect = 0.05f;
  EXPECT_LT(test::estimate_of(*view->render(options, constant_light()), green).value, 0.9 * open_mean);
}

// A runtime that chooses levels by footprint, seen by a perspective camera.
class PathTraceScene : public PathTrace {
 protected:
  void SetUp() override {
    device_ = std::move(*make_embree_device(thread_count()));
    RuntimeOptions options;
    runtime_ = std::move(*Runtime::create(device_.get(), options));
    const AssetId asset = *runtime_->open_asset(white().string());
    ASSERT_TRUE(runtime_->add_instance(asset, mat4x3(1.0f)));
    scene_ = std::move(*make_scene(device_.get(), *runtime_));
  }
  Result<TraceStats> trace(const Camera& camera, Film& film, const TraceOptions& options, const Job& job = {}) {
    runtime_->set_cameras({camera.tessellation()});
    EXPECT_TRUE(runtime_->plan_frame());
    return path_trace({scene_.get(), runtime_.get(), &lights_}, camera, options, film, job);
  }
  static Camera camera_at(float distance, int side) {
    return Camera::perspective({0, 0, distance}, {0, 0, -1}, {0, 1, 0}, 2 * std::atan(1.2f / distance), side, side);
  }

  EmbreeDevice device_;
  std::unique_ptr<Runtime> runtime_;
  EmbreeScene scene_;
  Lights lights_ = constant_light();
};

TEST_F(PathTraceScene, LodChannelsTellWhatCameraRaysHit) {
  // r_0 is 0.02: a pixel of 0.02 * 2^k asks for level k at the instance's nearest point.
  for (const auto& [side, level, volume] : {std::tuple{200, 0.0f, 0.0f}, std::tuple{12, 3.0f, 1.0f}}) {
    const float distance = 100;
    Film film(side, side);
    TraceOptions options;
    options.samples_per_pixel = 8;
    ASSERT_TRUE(trace(camera_at(distance, side), film, options));
    const float* pixel = film.image().pixel(side / 2, side / 2);
    const float pixel_size = 2.4f / static_cast<float>(side);
    EXPECT_EQ(pixel[3], 1.0f);
    EXPECT_NEAR(pixel[6], pixel_size, 0.03f * pixel_size);
    const float lambda = std::max(0.0f, std::log2(0.99f * pixel_size / 0.02f));
    EXPECT_NEAR(pixel[5], lambda - std::floor(lambda), 0.03f);
    EXPECT_NEAR(pixel[4], level, level == 0 ? 0.0f : 1.0f);
    EXPECT_EQ(pixel[7], volume);
    const float* corner = film.image().pixel(0, 0);
    EXPECT_EQ(corner[3], 0.0f);
    EXPECT_EQ(corner[6], 0.0f);
    EXPECT_NEAR(corner[1], 1.0f, 1e-6f);  // the background
  }
}

TEST_F(PathTraceScene, BackgroundIsLeftOutWhenTransparent) {
  Film film(8, 8);
  TraceOptions options;
  options.transparent = true;
  ASSERT_TRUE(trace(camera_at(50, 8), film, options));
  EXPECT_EQ(film.image().pixel(0, 0)[1], 0.0f);
}

TEST_F(PathTraceScene, ASmallSceneOfManyInstancesShowsTheSame) {
  for (int i = 0; i < 500; ++i) {
    mat4x3 place(1.0f);
    place[3] = 0.7f * vec3(i % 10, i / 10 % 10, -2 - i / 100);
    ASSERT_TRUE(runtime_->add_instance(AssetId{0}, place));
  }
  TraceOptions options;
  options.samples_per_pixel = 4;
  std::vector<float> values[2];
  for (const bool is_small : {false, true}) {
    scene_ = std::move(*make_scene(device_.get(), *runtime_, is_small));
    Film film(64, 64);
    ASSERT_TRUE(trace(camera_at(20, 64), film, options));
    values[is_small] = film.image().values;
  }
  EXPECT_EQ(values[0], values[1]);
}

// A ball of radius 1 that crosses three of its radii while the shutter is open covers what it passes for as long as it
// does; whether it or the camera moves is the same.
TEST_F(PathTraceScene, ShuttersBlurWhatMoves) {
  constexpr int kSide = 240, kRows = 4;
  constexpr float kWay = 3.0f, kWidth = 6.0f;
  const auto camera_beside = [](float x) {
    return Camera::orthographic({x, 0, 10}, {0, 0, -1}, {0, 1, 0}, kWidth, kSide, kRows);
  };
  mat4x3 right(1.0f);
  right[3].x = kWay;
  TraceOptions options;
  options.samples_per_pixel = 64;
  for (const bool does_camera_move : {true, false}) {
    ASSERT_TRUE(runtime_->move_instance(InstanceId{0}, std::vector<mat4x3>{mat4x3(1.0f), right}));
    std::vector<Camera> keys(3, camera_beside(0.5f * kWay));
    if (does_camera_move) {
      ASSERT_TRUE(runtime_->move_instance(InstanceId{0}, mat4x3(1.0f)));
      keys = {camera_beside(0.5f * kWay), camera_beside(0.0f), camera_beside(-0.5f * kWay)};
    }
    runtime_->set_cameras({keys[0].tessellation(), keys[2].tessellation()});
    ASSERT_TRUE(runtime_->plan_frame());
    scene_ = std::move(*make_scene(device_.get(), *runtime_));
    Film film(kSide, kRows);
    ASSERT_TRUE(path_trace({scene_.get(), runtime_.get(), &lights_}, keys, options, film));
    for (int x = 0; x < kSide; ++x) {
      const float place = (static_cast<float>(x) + 0.5f) * kWidth / kSide - 0.5f * kWidth + 0.5f * kWay;
      const float first = std::max(0.0f, (place - 1) / kWay), last = std::min(1.0f, (place + 1) / kWay);
      EXPECT_NEAR(film.image().pixel(x, kRows / 2)[3], std::max(0.0f, last - first), 0.06f)
          << x << " " << does_camera_move;
    }
  }
}

// A sun's shadow is as sharp as the sun is small: a lobe's wide cone would take it from the coarsest level.
TEST_F(PathTraceScene, ShadowsOfASunComeFromFineLevels) {
  const auto thorn = folder_->path() / "thorn.farfield";
  test::write_asset(
      thorn, {test::sphere_level({0, 0, 0}, 0.1f, 16, 0, 0.02f), test::sphere_level({0, 0, 0}, 1.0f, 16, 5, 0.64f)});
  const AssetId asset = *runtime_->open_asset(thorn.string());
  mat4x3 above(1.0f);
  above[3] = vec3(0, 10, 0);
  const auto instance = runtime_->add_instance(asset, above);
  ASSERT_TRUE(instance);
  scene_ = std::move(*make_scene(device_.get(), *runtime_));
  DistantLight sun;
  sun.irradiance = vec3(1.0f);
  lights_.environment = Environment::constant(vec3(0.0f)).with({&sun, 1});
  const int side = 120;
  const Camera camera = Camera::orthographic({0, 0, 10}, {0, 0, -1}, {0, 1, 0}, 2.4f, side, side);
  TraceOptions options;
  options.samples_per_pixel = 4;
  options.max_depth = 1;  // what scatters on may see coarse levels
  const auto seen_between = [&](uint8_t finest, uint8_t coarsest) {
    EXPECT_TRUE(runtime_->set_level_limits(*instance, {finest, coarsest}));
    Film film(side, side);
    EXPECT_TRUE(trace(camera, film, options));
    return film.image().values;
  };
  const std::vector<float> chosen = seen_between(0, 5);
  EXPECT_EQ(chosen, seen_between(0, 0));
  EXPECT_NE(chosen, seen_between(5, 5));
}

TEST_F(PathTraceScene, CancelStopsEarly) {
  Film film(256, 256);
  TraceOptions options;
  options.samples_per_pixel = 16;
  std::atomic<bool> cancel{false};
  std::atomic<int> calls{0};
  const auto count = [&](double done, const std::string&) {
    EXPECT_GT(done, 0.0);
    if (++calls == 3) cancel = true;
  };
  const auto traced = trace(camera_at(10, 256), film, options, {count, &cancel});
  ASSERT_FALSE(traced);
  EXPECT_EQ(traced.error().code, ErrorCode::Cancelled);
  EXPECT_LT(calls, 100);  // of 256 tiles
}

TEST_F(PathTraceScene, ProgressReachesOneAndRaysAreCounted) {
  Film film(40, 20);
  TraceOptions options;
  options.samples_per_pixel = 2;
  std::atomic<double> last{0};
  const auto traced = trace(Camera::perspective({0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 1, 40, 20), film, options,
                            {[&](double done, const std::string&) { last = std::max(last.load(), done); }});
  ASSERT_TRUE(traced);
  EXPECT_EQ(last, 1.0);
  EXPECT_GE(traced->rays, 1600u);
  EXPECT_EQ(traced->invalid_samples, 0u);
}

TEST_F(PathTraceScene, LightThatIsNotFiniteIsBlackAndCounted) {
  lights_ = constant_light(vec3(std::numeric_limits<float>::infinity()));
  Film film(4, 4);
  const auto traced = trace(camera_at(5, 4), film, TraceOptions());
  ASSERT_TRUE(traced);
  EXPECT_GT(traced->invalid_samples, 0u);
  for (const float value : film.image().values) EXPECT_TRUE(std::isfinite(value));
}

TEST_F(PathTraceScene, RefusesFilmsOfAnotherSizeAndNoSamples) {
  Film film(8, 8);
  EXPECT_EQ(trace(camera_at(5, 4), film, TraceOptions()).error().code, ErrorCode::InvalidArgument);
  TraceOptions options;
  options.samples_per_pixel = 0;
  EXPECT_EQ(trace(camera_at(5, 8), film, options).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace farfield
