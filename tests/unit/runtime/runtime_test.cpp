// SPDX-License-Identifier: Apache-2.0
#include "farfield/runtime.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <limits>
#include <set>
#include <thread>

#include "base/parallel.h"
#include "base/vec.h"
#include "bvh/level_scene.h"
#include "cache/manifest.h"
#include "cache/placed_parts.h"
#include "tests/support/asset_writer.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

using test::hash_of_hits;
using test::Host;
using test::set_diffuse;
using test::TemporaryFolder;
using test::white_sphere;
using test::write_asset;

/// The white sphere on disk, once for all tests.
class RuntimeTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    write_asset(sphere(), white_sphere());
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::filesystem::path path_of(const std::string& name) { return folder_->path() / name; }
  static std::filesystem::path sphere() { return folder_->path() / "sphere.farfield"; }
  /// A copy that a test may break.
  static std::filesystem::path copy(const char* name) {
    const auto target = folder_->path() / name;
    std::filesystem::remove_all(target);
    std::filesystem::copy(sphere(), target);
    return target;
  }

 private:
  static TemporaryFolder* folder_;
};
TemporaryFolder* RuntimeTest::folder_ = nullptr;

void flip_byte(const std::filesystem::path& file, uint64_t offset) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  const char byte = static_cast<char>(stream.get() ^ 0x55);
  stream.seekp(static_cast<std::streamoff>(offset));
  stream.put(byte);
}

/// The number of bytes that an OutOfBudget error says would do: the largest in it.
uint64_t number_in(const std::string& message) {
  uint64_t largest = 0;
  for (size_t i = 0; i < message.size(); ++i) {
    if (!std::isdigit(message[i])) continue;
    size_t digits = 0;
    largest = std::max<uint64_t>(largest, std::stoull(message.substr(i), &digits));
    i += digits;
  }
  return largest;
}

RuntimeOptions with_budget(uint64_t bytes) {
  RuntimeOptions options;
  options.budget_bytes = bytes;
  return options;
}

RuntimeOptions with_lambda(float lambda) {
  RuntimeOptions options;
  options.forced_lambda = lambda;
  return options;
}

RuntimeOptions morphing(float lambda) {
  RuntimeOptions options = with_lambda(lambda);
  options.blend = Blend::Morph;
  return options;
}

// --- Opening ---------------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, CreateRefusesImpossibleOptions) {
  const EmbreeDevice device = std::move(*make_embree_device());
  const auto refuses = [&](const RuntimeOptions& options) {
    const auto runtime = Runtime::create(device.get(), options);
    return !runtime && runtime.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_TRUE(refuses(with_budget(0)));
  for (const float scale :
       {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    RuntimeOptions options;
    options.pixel_error = scale;
    EXPECT_TRUE(refuses(options));
  }
  EXPECT_TRUE(refuses(with_lambda(std::numeric_limits<float>::quiet_NaN())));
  EXPECT_FALSE(Runtime::create(nullptr, {}));
  EXPECT_TRUE(Runtime::create(device.get(), {}));
}

TEST_F(RuntimeTest, OpensAnAssetAndDescribesIt) {
  Host host;
  const auto asset = host.runtime().open_asset(sphere().string());
  ASSERT_TRUE(asset) << asset.error().message;
  const std::vector<LevelInfo>& levels = host.runtime().levels(*asset);
  ASSERT_EQ(levels.size(), 5u);
  EXPECT_EQ(levels[4].level, 5u);
  EXPECT_EQ(levels[0].triangles, 2u * 128 + 62u * 128 * 2);
  EXPECT_GT(levels[3].voxels, 0u);
  EXPECT_GT(levels[0].resident_bytes, levels[1].resident_bytes);
  vec3 lower, upper;
  host.runtime().bounds(*asset, lower, upper);
  EXPECT_LE(lower.x, -1.0f);
  EXPECT_GE(upper.z, 1.0f);
  EXPECT_EQ(host.runtime().stats().levels_resident, 1u);  // the root
}

TEST_F(RuntimeTest, TheSameFolderIsTheSameAsset) {
  Host host;
  const auto a = host.runtime().open_asset(sphere().string());
  const auto b = host.runtime().open_asset((sphere() / ".." / "sphere.farfield/").string());
  const auto other = host.runtime().open_asset(copy("other.farfield").string());
  ASSERT_TRUE(a && b && other);
  EXPECT_EQ(a->value, b->value);
  EXPECT_NE(a->value, other->value);
  EXPECT_EQ(host.runtime().stats().levels_loaded, 2u);
}

TEST_F(RuntimeTest, OpeningSaysWhatIsWrong) {
  Host host;
  const auto error_of = [&](const std::filesystem::path& folder) {
    const auto asset = host.runtime().open_asset(folder.string());
    EXPECT_FALSE(asset);
    return asset ? Error{ErrorCode::Io, ""} : asset.error();
  };
  EXPECT_EQ(error_of("/nowhere/at/all.farfield").code, ErrorCode::NotFound);

  const auto no_manifest = copy("no_manifest.farfield");
  std::filesystem::remove(no_manifest / "manifest.json");
  EXPECT_EQ(error_of(no_manifest).code, ErrorCode::NotFound);

  const auto no_level = copy("no_level.farfield");
  std::filesystem::remove(no_level / "level_1.ffl");
  const Error missing = error_of(no_level);
  EXPECT_EQ(missing.code, ErrorCode::NotFound);
  EXPECT_NE(missing.message.find("level_1.ffl"), std::string::npos) << missing.message;

  const auto cut = copy("cut.farfield");
  std::filesystem::resize_file(cut / "level_0.ffl", 1000);
  EXPECT_EQ(error_of(cut).code, ErrorCode::BadFile);

  const auto broken_root = copy("broken_root.farfield");
  flip_byte(broken_root / "level_5.ffl", std::filesystem::file_size(broken_root / "level_5.ffl") / 2);
  EXPECT_EQ(error_of(broken_root).code, ErrorCode::BadFile);

  const auto swapped = copy("swapped.farfield");  // a good file of another level
  std::filesystem::copy_file(swapped / "level_3.ffl", swapped / "level_5.ffl",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(error_of(swapped).code, ErrorCode::BadFile);
  EXPECT_TRUE(host.messages.empty());  // the caller has been told

  EXPECT_TRUE(host.runtime().open_asset(sphere().string()));  // and the runtime still works
}

TEST_F(RuntimeTest, ABudgetBelowTheRootsIsRefusedWithTheNumberThatWouldDo) {
  uint64_t enough = 0;
  {
    Host host(with_budget(1000));
    const auto asset = host.runtime().open_asset(sphere().string());
    ASSERT_FALSE(asset);
    ASSERT_EQ(asset.error().code, ErrorCode::OutOfBudget);
    enough = number_in(asset.error().message);
  }
  ASSERT_GT(enough, 1000u);
  Host host(with_budget(enough));
  const auto asset = host.runtime().open_asset(sphere().string());
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, enough);
  EXPECT_FALSE(Host(with_budget(enough - 1)).runtime().open_asset(sphere().string()));
}

TEST_F(RuntimeTest, AManifestThatPromisesLessThanItsFilesIsRefused) {
  const auto liar = copy("liar.farfield");
  Manifest manifest = *read_manifest(liar);
  manifest.levels[1].resident_bytes = 10, manifest.levels[1].build_peak_bytes = 10;
  ASSERT_TRUE(write_manifest(liar, manifest));
  Host host;
  const auto asset = host.runtime().open_asset(liar.string());
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().code, ErrorCode::BadFile);
  EXPECT_NE(asset.error().message.find("level 1"), std::string::npos) << asset.error().message;
}

TEST_F(RuntimeTest, ALoadNeverTakesMoreThanTheBudgetHoweverTheManifestLies) {
  const auto liar = copy("small_liar.farfield");
  Manifest manifest = *read_manifest(liar);
  LevelEntry& finest = manifest.levels[0];
  const uint64_t truth = finest.resident_bytes + finest.build_peak_bytes;
  finest.resident_bytes = finest.file_bytes, finest.build_peak_bytes = 0;
  ASSERT_TRUE(write_manifest(liar, manifest));
  ASSERT_GT(truth, finest.file_bytes * 3 / 2);
  const uint64_t budget = finest.file_bytes + (truth - finest.file_bytes) / 2;
  Host host(with_budget(budget));
  host.add(liar);
  EXPECT_EQ(host.plan(vec3(0, 0, 2)).finest_level[0], 0u) << "the plan believes the manifest";
  hash_of_hits(host);
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, budget);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("level_0.ffl: the BVH of"), std::string::npos) << host.messages[0];
  EXPECT_NE(host.messages[0].find("farfield verify"), std::string::npos) << host.messages[0];
  EXPECT_GT(host.runtime().stats().fallbacks, 0u);
}

TEST_F(RuntimeTest, AHullThatWouldCutALevelIsRefused) {
  const auto cut = copy("cut_hull.farfield");
  Manifest manifest = *read_manifest(cut);
  for (int i = 0; i < 8; ++i) manifest.hull.push_back(manifest.bounds.corner(i));
  ASSERT_TRUE(write_manifest(cut, manifest));
  {
    Host host;
    EXPECT_TRUE(host.runtime().open_asset(cut.string()));
  }
  for (vec3& point : manifest.hull) point *= 0.1f;
  ASSERT_TRUE(write_manifest(cut, manifest));
  Host host;
  const auto asset = host.runtime().open_asset(cut.string());
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().code, ErrorCode::BadFile);
  EXPECT_NE(asset.error().message.find("sticks out of the hull"), std::string::npos) << asset.error().message;
}

TEST_F(RuntimeTest, AssetsCanBeOpenedWhileTheLoaderWorks) {
  RuntimeOptions options;
  options.residency = Residency::Progressive;
  Host host(options);
  for (int i = 0; i < 40; ++i) {
    host.add(copy(("progressive" + std::to_string(i) + ".farfield").c_str()));
    host.plan(vec3(0, 0, 2));
    host.runtime().prefetch();
  }
  EXPECT_EQ(host.messages, std::vector<std::string>{});
  EXPECT_GE(host.runtime().stats().levels_resident, 40u);
}

// --- Instances and scenes --------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, InstancesNeedAnAssetAndATransformThatCanBeInverted) {
  Host host;
  const AssetId asset = host.add(sphere(), {});
  EXPECT_FALSE(host.runtime().add_instance(AssetId{7}, mat4x3(1.0f)));
  EXPECT_FALSE(host.runtime().add_instance(asset, mat4x3(0.0f)));
  const auto first = host.runtime().add_instance(asset, mat4x3(1.0f));
  const auto second = host.runtime().add_instance(asset, mat4x3(2.0f));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->value, 0u);
  EXPECT_EQ(second->value, 1u);
}

TEST_F(RuntimeTest, InstancesKeepTheirDataForTheHost) {
  Host host;
  const AssetId asset = host.add(sphere());  // instance 0, without data
  const InstanceData data{uint64_t{1} << 40, vec3(0.5f, 1, 2)};
  ASSERT_TRUE(host.runtime().add_instance(asset, mat4x3(1.0f), data).has_value());
  ASSERT_TRUE(host.runtime().add_instance(asset, mat4x3(1.0f)).has_value());
  Interaction seen;
  EXPECT_EQ(host.runtime().instance_data(seen), InstanceData()) << "no hit";
  for (uint32_t i = 0; i < 4; ++i) {
    seen.instance = i;
    EXPECT_EQ(host.runtime().instance_data(seen), i == 1 ? data : InstanceData()) << i;
  }
}

TEST_F(RuntimeTest, AttachingAgainTakesNewInstancesAndKeepsTheId) {
  Host host;
  const AssetId asset = host.add(sphere());
  host.plan();
  const unsigned id = host.runtime().geometry_id();
  RayContext context;
  EmbreeRayHit hit;
  EXPECT_FALSE(host.trace({5, 0, 10}, {0, 0, -1}, context, hit));
  mat4x3 moved(1.0f);
  moved[3] = vec3(5, 0, 0);
  ASSERT_TRUE(host.runtime().add_instance(asset, moved));
  host.plan();
  EXPECT_EQ(host.runtime().geometry_id(), id);
  ASSERT_TRUE(host.trace({5, 0, 10}, {0, 0, -1}, context, hit));
  EXPECT_EQ(hit.hit.primID, 1u);
  EXPECT_FALSE(host.runtime().attach(nullptr));
}

TEST_F(RuntimeTest, ASceneOfAnotherDeviceIsRefusedAndNothingChanges) {
  Host host;
  host.add(sphere());
  host.plan();
  const unsigned id = host.runtime().geometry_id();
  for (int i = 0; i < 3; ++i) {  // would release the device too often if it did so once too often
    Host other;
    const EmbreeScene foreign = new_scene(other.device());
    const auto attached = host.runtime().attach(foreign.get());
    ASSERT_FALSE(attached);
    EXPECT_EQ(attached.error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(host.runtime().geometry_id(), id);
  RayContext context;
  EmbreeRayHit hit;
  EXPECT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
}

TEST_F(RuntimeTest, AttachingToAnotherSceneLeavesTheFirst) {
  Host host;
  host.add(sphere());
  host.plan();
  ASSERT_TRUE(host.runtime().attach(new_scene(host.device()).get()));
  host.commit();  // back to the first: there once, not twice
  RayContext context;
  EmbreeRayHit hit;
  EXPECT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
  EXPECT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
}

TEST_F(RuntimeTest, ASceneWithoutInstancesIsEmpty) {
  Host host;
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  EXPECT_FALSE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
}

TEST_F(RuntimeTest, OriginsFarFromZeroDoNotCostPrecision) {
  const TemporaryFolder folder;
  write_asset(folder.path() / "far.farfield", white_sphere(16), dvec3(1e7, -3e7, 1e7));
  Host host(with_lambda(0.0f));
  mat4x3 back(1.0f);
  back[3] = vec3(-1e7f, 3e7f, -1e7f);
  const AssetId asset = host.add(folder.path() / "far.farfield", {back});
  vec3 lower, upper;
  host.runtime().bounds(asset, lower, upper);
  EXPECT_NEAR(lower.x, 1e7f, 4.0f);
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0.1f, 0.2f, 10}, {0, 0, -1}, context, hit));
  EXPECT_NEAR(hit.ray.tfar, 10 - std::sqrt(1 - 0.05f), 0.02f);
}

// --- Plans -----------------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, PlanningNeedsACameraUnlessLambdaIsForced) {
  Host host;
  host.add(sphere());
  const auto plan = host.runtime().plan_frame();
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::InvalidArgument);
  Host forced(with_lambda(1.0f));
  forced.add(sphere());
  const auto forced_plan = forced.runtime().plan_frame();
  ASSERT_TRUE(forced_plan);
  EXPECT_EQ(forced_plan->finest_level[0], 1u);
}

TEST_F(RuntimeTest, TheNearerTheCameraTheFinerThePlan) {
  Host host;
  host.add(sphere());
  uint32_t last = 0;
  std::vector<bool> seen(6, false);
  for (float distance = 2.0f; distance < 5000.0f; distance *= 1.3f) {
    const uint32_t finest = host.plan(vec3(0, 0, distance)).finest_level[0];
    EXPECT_GE(finest, last);
    last = finest;
    seen[finest] = true;
  }
  EXPECT_EQ(seen, (std::vector<bool>{true, true, true, true, false, true}));
}

TEST_F(RuntimeTest, LodScaleAndInstanceScaleMoveTheLevel) {
  const auto finest = [](float pixel_error, float instance_scale) {
    RuntimeOptions options;
    options.pixel_error = pixel_error;
    Host host(options);
    host.add(sphere(), {mat4x3(instance_scale)});
    return host.plan(vec3(0, 0, 1000), 0.1e-3f).finest_level[0];  // 0.1 wide: lambda 2.3 at scale 1
  };
  EXPECT_EQ(finest(1.0f, 1.0f), 2u);
  EXPECT_EQ(finest(0.5f, 1.0f), 1u);
  EXPECT_EQ(finest(2.0f, 1.0f), 3u);
  EXPECT_EQ(finest(1.0f, 2.0f), 1u);
  EXPECT_EQ(finest(1.0f, 0.5f), 3u);
}

TEST_F(RuntimeTest, MoreBudgetNeverGivesACoarserPlanAndTheBudgetAlwaysHolds) {
  double last_bias = 1e9;
  bool saw_coarse = false, saw_finest = false;
  for (uint64_t budget = 300 << 10; budget < (64 << 20); budget = budget * 5 / 4) {
    Host host(with_budget(budget));
    const auto asset = host.runtime().open_asset(sphere().string());
    if (!asset) continue;
    ASSERT_TRUE(host.runtime().add_instance(*asset, mat4x3(1.0f)));
    const PlanSummary plan = host.plan(vec3(0, 0, 5));
    EXPECT_LE(plan.planned_bytes, budget);
    EXPECT_LE(plan.bias, last_bias);
    last_bias = plan.bias;
    saw_coarse = saw_coarse || plan.finest_level[0] >= 3;
    saw_finest = saw_finest || plan.finest_level[0] == 0;
    hash_of_hits(host, 0.1f);  // loads what the plan allows
    const Stats stats = host.runtime().stats();
    EXPECT_LE(stats.peak_accounted_bytes, budget);
    EXPECT_LE(stats.accounted_bytes, plan.planned_bytes);
    EXPECT_EQ(stats.fallbacks, 0u);
    EXPECT_TRUE(host.messages.empty()) << host.messages[0];
  }
  EXPECT_TRUE(saw_coarse && saw_finest);
}

TEST_F(RuntimeTest, MovingAwayReleasesAndComingBackReloads) {
  Host host;
  host.add(sphere());
  host.plan(vec3(0, 0, 5));
  const uint64_t near_hash = hash_of_hits(host);
  const uint64_t near_bytes = host.runtime().stats().accounted_bytes;
  host.plan(vec3(0, 0, 5000));
  const Stats far = host.runtime().stats();
  EXPECT_LT(far.accounted_bytes, near_bytes / 2);
  EXPECT_EQ(far.levels_resident, 1u);
  EXPECT_GT(far.levels_released, 0u);
  hash_of_hits(host);
  host.plan(vec3(0, 0, 5));
  EXPECT_EQ(hash_of_hits(host), near_hash);
}

TEST_F(RuntimeTest, PrefetchLoadsWhatCameraRaysNeed) {
  Host host;
  host.add(sphere());
  host.plan(vec3(0, 0, 40));  // 0.04 wide: lambda just below 1
  host.runtime().prefetch();
  const uint64_t loaded = host.runtime().stats().levels_loaded;
  EXPECT_EQ(loaded, 3u);  // root, 0, 1
  hash_of_hits(host);
  EXPECT_EQ(host.runtime().stats().levels_loaded, loaded);
}

/// Whether so much is accounted soon.
bool comes_to_hold(Host& host, uint64_t bytes) {
  for (int wait = 0; wait < 2000; ++wait) {
    if (host.runtime().stats().accounted_bytes == bytes) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST_F(RuntimeTest, LevelsLoadedAheadChangeNothingButHowLongRaysWait) {
  const auto files = copy("ahead.farfield");
  const vec3 near(0, 0, 5), far(0, 0, 5000);
  Host plain, ahead;
  plain.add(sphere());
  ahead.add(files);
  const auto loaded = [](Host& host) { return host.runtime().stats().levels_loaded; };
  plain.plan(near);
  plain.runtime().prefetch();
  const uint64_t near_hash = hash_of_hits(plain), near_bytes = plain.runtime().stats().accounted_bytes;
  plain.plan(far);
  const uint64_t far_hash = hash_of_hits(plain);

  ahead.plan(far);
  const uint64_t far_bytes = ahead.runtime().stats().accounted_bytes;
  ahead.runtime().look_ahead({{near, 0.0f, 1e-3f}});
  ASSERT_TRUE(comes_to_hold(ahead, near_bytes));
  EXPECT_EQ(hash_of_hits(ahead), far_hash);
  EXPECT_EQ(loaded(ahead), 1u);  // the root: nothing else was asked for
  for (const LevelInfo& level : ahead.runtime().levels({0}))
    std::filesystem::remove(files / ("level_" + std::to_string(level.level) + ".ffl"));
  ahead.plan(near);
  ahead.runtime().prefetch();
  EXPECT_EQ(hash_of_hits(ahead), near_hash);
  EXPECT_EQ(ahead.runtime().stats().accounted_bytes, near_bytes);
  EXPECT_GT(loaded(ahead), 1u);
  EXPECT_TRUE(ahead.messages.empty()) << ahead.messages[0];

  // A guess that was wrong, and one that is taken back, are dropped by the next plan.
  plain.runtime().look_ahead({{near, 0.0f, 1e-3f}});
  ASSERT_TRUE(comes_to_hold(plain, near_bytes));
  plain.runtime().look_ahead({});
  EXPECT_EQ(hash_of_hits(plain), far_hash);
  plain.plan(far);
  EXPECT_EQ(plain.runtime().stats().accounted_bytes, far_bytes);
  EXPECT_EQ(hash_of_hits(plain), far_hash);
}

TEST_F(RuntimeTest, WhatIsBrokenAheadIsSaidByTheFrameThatNeedsIt) {
  const auto broken = copy("broken_ahead.farfield");
  const vec3 near(0, 0, 40), far(0, 0, 5000);  // near: levels 0 and 1
  Host host, sound;
  host.add(broken);
  sound.add(sphere());
  sound.plan(near);
  sound.runtime().prefetch();
  const std::vector<LevelRecord> records = sound.runtime().level_stats({0});
  host.plan(far);
  const uint64_t far_bytes = host.runtime().stats().accounted_bytes;
  flip_byte(broken / "level_0.ffl", std::filesystem::file_size(broken / "level_0.ffl") / 2);
  host.runtime().look_ahead({{near, 0.0f, 1e-3f}});
  ASSERT_TRUE(comes_to_hold(host, far_bytes + records[1].resident_bytes));  // level 0, the larger, was tried before
  hash_of_hits(host);
  EXPECT_EQ(host.plan(near).finest_level[0], 0u);
  EXPECT_TRUE(host.messages.empty()) << host.messages[0];
  host.runtime().prefetch();
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("level_0.ffl"), std::string::npos) << host.messages[0];
  hash_of_hits(host);
  host.runtime().look_ahead({{near, 0.0f, 1e-3f}});
  host.plan(near);
  hash_of_hits(host);
  EXPECT_EQ(host.messages.size(), 1u);
}

TEST_F(RuntimeTest, WhatIsLoadedAheadMakesRoomForInstancesAndAssets) {
  const auto other = copy("beside.farfield");
  const vec3 near(0, 0, 5), far(0, 0, 5000);
  Host probe;
  probe.add(sphere());
  const uint64_t budget = probe.plan(near).planned_bytes;
  probe.runtime().prefetch();
  const uint64_t near_bytes = probe.runtime().stats().accounted_bytes;
  Host host(with_budget(budget + 1000));
  const AssetId asset = host.add(sphere());
  for (const bool adds_instances : {true, false}) {
    host.plan(far);
    host.runtime().look_ahead({{near, 0.0f, 1e-3f}});
    if (adds_instances) {
      ASSERT_TRUE(comes_to_hold(host, near_bytes));
      for (uint64_t i = 0; i < (budget - near_bytes) / 184 + 100; ++i)
        ASSERT_TRUE(host.runtime().add_instance(asset, mat4x3(1.0f)));
      EXPECT_LT(host.runtime().stats().accounted_bytes, near_bytes);
    } else {
      ASSERT_TRUE(host.runtime().open_asset(other.string()));
    }
    hash_of_hits(host);
  }
  EXPECT_TRUE(host.messages.empty()) << host.messages[0];
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, budget + 1000);
}

TEST_F(RuntimeTest, OpeningAnotherAssetMakesRoomForItsRoot) {
  const auto other = copy("second.farfield");
  // The budget holds the first sphere whole, or both roots, but not the first sphere and a second root.
  Host probe;
  probe.add(sphere());
  const uint64_t whole = probe.plan(vec3(0, 0, 2)).planned_bytes;
  Host host(with_budget(whole + 1000));
  host.add(sphere());
  host.plan(vec3(0, 0, 2));
  hash_of_hits(host, 0.3f);
  const auto opened = host.runtime().open_asset(other.string());
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, whole + 1000);
  host.plan(vec3(0, 0, 2));
  hash_of_hits(host);
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, whole + 1000);
}

TEST_F(RuntimeTest, ALevelThatDidNotFitIsLoadedOnceAPlanHasRoom) {
  // The first asset takes more than its manifest says, so the second does not fit beside it.
  const auto liar = copy("liar.farfield"), honest = copy("honest.farfield");
  Manifest manifest = *read_manifest(liar);
  LevelEntry& level = manifest.levels[0];
  level.resident_bytes -= (level.resident_bytes + level.build_peak_bytes - level.file_bytes) / 2;
  ASSERT_TRUE(write_manifest(liar, manifest));
  const vec3 far(1000, 0, 0);
  mat4x3 moved(1.0f);
  moved[3] = far;
  const auto add_both = [&](Host& host) {
    host.add(liar);
    host.add(honest, {moved});
    host.runtime().set_cameras({{vec3(0, 0, 2), 0.0f, 1e-3f}, {far + vec3(0, 0, 2), 0.0f, 1e-3f}});
    const auto plan = host.runtime().plan_frame();
    EXPECT_TRUE(plan);
    host.commit();
    return *plan;
  };
  Host probe;
  Host host(with_budget(add_both(probe).planned_bytes));
  ASSERT_EQ(add_both(host).finest_level, (std::vector<uint32_t>{0, 0}));
  const auto level_seen_at = [&](const vec3& middle, float cone_width = 0.0f) {
    RayContext context;
    context.cone_width = cone_width;
    EmbreeRayHit hit;
    EXPECT_TRUE(host.trace(middle + vec3(0, 0, 2), {0, 0, -1}, context, hit));
    return host.interaction(hit, context).level;
  };
  for (float width = 4; width > 1e-3f; width /= 2)
    level_seen_at(vec3(0), width), level_seen_at(far, width);  // the rest
  EXPECT_EQ(level_seen_at(vec3(0)), 0u);
  EXPECT_GT(level_seen_at(far), 0u);
  EXPECT_EQ(host.messages.size(), 1u);
  ASSERT_EQ(host.plan(far + vec3(0, 0, 2)).finest_level[1], 0u);
  EXPECT_EQ(level_seen_at(far), 0u);
}

TEST_F(RuntimeTest, AnInstanceThatDoesNotFitIsRefusedAtOnceWithTheNumberThatWouldDo) {
  constexpr uint64_t kSmall = 4 << 20;
  Host host(with_budget(kSmall));
  const AssetId asset = host.add(sphere());
  host.plan(vec3(0, 0, 3));
  hash_of_hits(host);  // levels are loaded, and have to go
  uint32_t count = 1;
  Error error;
  for (; count < 50000; ++count) {
    const auto added = host.runtime().add_instance(asset, mat4x3(1.0f));
    if (!added) {
      error = added.error();
      break;
    }
    ASSERT_EQ(added->value, count);
  }
  EXPECT_EQ(error.code, ErrorCode::OutOfBudget);
  EXPECT_GT(count, 10000u);
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, kSmall);
  EXPECT_LE(host.plan(vec3(0, 0, 3)).planned_bytes, kSmall);  // what there is works on

  const uint64_t enough = number_in(error.message);
  EXPECT_EQ(*Runtime::least_budget({sphere().string(), (sphere() / ".").string()}, count + 1), enough);
  for (const uint64_t budget : {enough, enough - 1}) {
    Host other(with_budget(budget));
    other.add(sphere(), std::vector<mat4x3>(count, mat4x3(1.0f)));
    EXPECT_EQ(other.runtime().add_instance(asset, mat4x3(1.0f)).has_value(), budget == enough);
  }
  EXPECT_EQ(Runtime::least_budget({"/nowhere"}, 1).error().code, ErrorCode::NotFound);
}

TEST_F(RuntimeTest, TheLeastBudgetIsEnoughForMorphsToo) {
  RuntimeOptions options;
  options.blend = Blend::Morph;
  const uint64_t least = *Runtime::least_budget({sphere().string()}, 1, options);
  for (const uint64_t budget : {least, least - 1}) {
    options.budget_bytes = budget;
    Host host(options);
    const auto asset = host.runtime().open_asset(sphere().string());
    const bool fits = asset && host.runtime().add_instance(*asset, mat4x3(1.0f));
    EXPECT_EQ(fits, budget == least);
    EXPECT_TRUE(!fits || host.plan().planned_bytes <= least);
  }
}

// --- Instances that change -------------------------------------------------------------------------------------------

mat4x3 at(const vec3& place, float scale = 1.0f) {
  mat4x3 m(scale);
  m[3] = place;
  return m;
}

TEST_F(RuntimeTest, MovedHiddenAndRemovedInstancesAreSeenAsIfTheyHadNeverBeenElsewhere) {
  const std::vector<mat4x3> places = {at({0, 0, 0}), at({0.5f, 0.5f, 0}, 0.4f), at({-0.7f, 0, 0.2f}, 0.5f)};
  const auto hash = [](Host& host) {
    host.plan(vec3(0, 0, 25));
    return hash_of_hits(host, 0.02f);
  };
  Host changed;
  const AssetId asset = changed.add(sphere(), {at({9, 9, 9}), places[1], at({0, 0, -3}, 7.0f)});
  Runtime& runtime = changed.runtime();
  hash(changed);
  ASSERT_TRUE(runtime.move_instance(InstanceId{0}, places[0]));
  ASSERT_TRUE(runtime.move_instance(InstanceId{2}, places[2]));
  {
    Host host;
    host.add(sphere(), places);
    EXPECT_EQ(hash(changed), hash(host));
  }
  ASSERT_TRUE(runtime.set_visible(InstanceId{1}, false));
  {
    Host host;  // ids are part of the hash: the hidden one is out of sight instead
    host.add(sphere(), {places[0], at({1e6f, 0, 0}, 0.4f), places[2]});
    EXPECT_EQ(hash(changed), hash(host));
  }
  ASSERT_TRUE(runtime.set_visible(InstanceId{1}, true));
  ASSERT_TRUE(runtime.remove_instance(InstanceId{0}));
  EXPECT_FALSE(runtime.remove_instance(InstanceId{0}));
  EXPECT_FALSE(runtime.move_instance(InstanceId{0}, places[0]));
  EXPECT_FALSE(runtime.set_visible(InstanceId{0}, true));
  EXPECT_FALSE(runtime.move_instance(InstanceId{3}, places[0]));
  EXPECT_FALSE(runtime.move_instance(InstanceId{1}, mat4x3(0.0f)));  // it stays where it was
  {
    Host host;
    host.add(sphere(), {at({1e6f, 0, 0}), places[1], places[2]});
    EXPECT_EQ(hash(changed), hash(host));
  }
  const uint64_t bytes = runtime.stats().accounted_bytes;
  const auto again = runtime.add_instance(asset, places[0], {7, vec3(1.0f)});
  ASSERT_TRUE(again);
  EXPECT_EQ(again->value, 0u);
  EXPECT_EQ(runtime.stats().accounted_bytes, bytes + sizeof(InstanceData));  // its data; the record was there
  {
    Host host;
    host.add(sphere(), places);
    EXPECT_EQ(hash(changed), hash(host));
  }
  const uint64_t loads = runtime.stats().levels_loaded;
  ASSERT_TRUE(runtime.move_instance(InstanceId{1}, places[2]));
  ASSERT_TRUE(runtime.move_instance(InstanceId{2}, places[1]));
  hash(changed);
  EXPECT_EQ(runtime.stats().levels_loaded, loads);  // nothing was built anew
}

TEST_F(RuntimeTest, PlansFollowWhatMovesComesAndIsHidden) {
  Host host;
  const AssetId asset = host.add(sphere(), {at({0, 0, 0}), at({0, 0, -5000})});
  const auto finest = [&] { return host.plan(vec3(0, 0, 5)).finest_level[0]; };
  EXPECT_EQ(finest(), 0u);
  ASSERT_TRUE(host.runtime().set_visible(InstanceId{0}, false));
  EXPECT_EQ(finest(), 5u);
  ASSERT_TRUE(host.runtime().move_instance(InstanceId{1}, at({0, 0, -60})));
  EXPECT_EQ(finest(), 1u);
  ASSERT_TRUE(host.runtime().add_instance(asset, at({0, 0, 0})));
  EXPECT_EQ(finest(), 0u);
  ASSERT_TRUE(host.runtime().remove_instance(InstanceId{2}));
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(host.runtime().move_instance(InstanceId{1}, at({0, 0, -5000})));
  EXPECT_EQ(finest(), 5u);
  ASSERT_TRUE(host.runtime().remove_instance(InstanceId{1}));
  finest();
  RayContext context;
  EmbreeRayHit hit;
  EXPECT_FALSE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));  // all are hidden or removed
}

TEST_F(RuntimeTest, InstancesMoveWhileTheShutterIsOpen) {
  Host host;
  host.add(sphere(), {at({0, 0, 0}), at({0, 0, -5000})});
  Runtime& runtime = host.runtime();
  EXPECT_EQ(host.plan(vec3(0, 0, 5000)).finest_level[0], 5u);
  const uint64_t bytes = runtime.stats().accounted_bytes;
  ASSERT_TRUE(runtime.move_instance(InstanceId{1}, {at({-4, 0, 0}), at({4, 0, 0}), at({4, 8, 0})}));
  const uint64_t motion_bytes =
      3 * sizeof(mat4x3) + 128 + 2 * uint64_t{kMovingSceneBytesPerInstance - kSceneBytesPerInstance};
  EXPECT_EQ(runtime.stats().accounted_bytes - bytes, motion_bytes);
  ASSERT_TRUE(runtime.set_visible(InstanceId{0}, false));
  host.plan(vec3(0, 0, 10));

  // The ball passes x = 0 at time 1/4, and stands at (4, 4) at time 3/4.
  const auto seen_at = [&](const vec3& origin, float time) {
    RayContext context;
    EmbreeRayHit ray_hit = make_ray_hit(origin, {0, 0, -1});
    ray_hit.ray.time = time;
    host.trace(context, ray_hit);
    return ray_hit.hit.geomID == runtime.geometry_id() ? std::optional(host.interaction(ray_hit, context))
                                                       : std::nullopt;
  };
  EXPECT_TRUE(seen_at({0, 0, 10}, 0.25f));
  EXPECT_FALSE(seen_at({0, 0, 10}, 0.0f));
  EXPECT_FALSE(seen_at({0, 0, 10}, 0.5f));
  const auto aside = seen_at({4.6f, 4.0f, 10}, 0.75f);
  ASSERT_TRUE(aside);
  EXPECT_GT(aside->geometric_normal.x, 0.4f);  // of the ball where it is then
  EXPECT_NEAR(aside->geometric_normal.y, 0.0f, 0.2f);
  EXPECT_FALSE(seen_at({4.6f, 4.0f, 10}, 0.25f));

  for (const std::vector<mat4x3>& keys :
       {std::vector<mat4x3>{}, {at({0, 0, 0}), mat4x3(0.0f)}, {at({0, 0, 0}), at({0, 0, 0}, -1.0f)}}) {
    const auto moved = runtime.move_instance(InstanceId{1}, keys);
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_FALSE(runtime.move_instance(InstanceId{2}, {at({0, 0, 0}), at({1, 0, 0})}));
  host.plan(vec3(0, 0, 10));
  EXPECT_TRUE(seen_at({0, 0, 10}, 0.25f));  // it moves as before

  const uint64_t in_motion = runtime.stats().accounted_bytes;
  ASSERT_TRUE(runtime.move_instance(InstanceId{1}, at({0, 0, 0})));
  EXPECT_EQ(in_motion - runtime.stats().accounted_bytes, motion_bytes);
  host.plan(vec3(0, 0, 10));
  for (const float time : {0.0f, 0.25f, 0.5f, 1.0f}) EXPECT_TRUE(seen_at({0, 0, 10}, time));
}

TEST_F(RuntimeTest, LevelsAreAskedForWhereAMovingInstanceIsNearest) {
  Host host;
  host.add(sphere(), {at({0, 0, -5000})});
  EXPECT_EQ(host.plan(vec3(0, 0, 5)).finest_level[0], 5u);
  ASSERT_TRUE(host.runtime().move_instance(InstanceId{0}, {at({0, 0, -5000}), at({0, 0, 0}), at({0, 0, -5000})}));
  EXPECT_EQ(host.plan(vec3(0, 0, 5)).finest_level[0], 0u);
  ASSERT_TRUE(host.runtime().move_instance(InstanceId{0}, {at({0, 0, -5000}, 0.01f), at({0, 0, -5000})}));
  EXPECT_EQ(host.plan(vec3(0, 0, 5)).finest_level[0], 5u);
  ASSERT_TRUE(host.runtime().remove_instance(InstanceId{0}));
  host.plan(vec3(0, 0, 5));
}

TEST_F(RuntimeTest, MotionsCountAgainstTheBudgetAtOnce) {
  Host host(with_budget(300 << 10));
  host.add(sphere(), {at({0, 0, 0})});
  Runtime& runtime = host.runtime();
  Result<void> moved;
  size_t count = 1;
  for (; moved && count < 100; ++count) {
    ASSERT_TRUE(runtime.add_instance(AssetId{0}, at({0, 0, 0})));
    moved = runtime.move_instance(InstanceId{static_cast<uint32_t>(count)}, std::vector<mat4x3>(129, at({0, 0, 0})));
    EXPECT_LE(runtime.stats().accounted_bytes, 300u << 10);
  }
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::OutOfBudget);
  host.plan(vec3(0, 0, 10));  // what was refused stands still
}

// --- What rays see ---------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, ThreadsTemperatureAndBudgetDoNotChangeWhatRaysSee) {
  const auto hash = [](int threads, bool prefetch, uint64_t budget) {
    const ThreadLimit limit(threads);
    Host host(with_budget(budget));
    host.add(sphere(), {mat4x3(1.0f), mat4x3(0.4f)});
    host.plan(vec3(0, 0, 25));
    if (prefetch) host.runtime().prefetch();
    const uint64_t cold = hash_of_hits(host, 0.02f);
    EXPECT_EQ(hash_of_hits(host, 0.02f), cold);  // warm
    return cold;
  };
  const uint64_t reference = hash(1, false, 1 << 30);
  EXPECT_EQ(hash(0, false, 1 << 30), reference);
  EXPECT_EQ(hash(4, true, 1 << 30), reference);
  EXPECT_EQ(hash(0, false, 64 << 20), reference);  // the same plan in less memory
}

TEST_F(RuntimeTest, ABrokenLevelIsReportedOnceAndTheNextCoarserServes) {
  const auto broken = copy("broken.farfield");
  const uint64_t size = std::filesystem::file_size(broken / "level_1.ffl");
  Host host(with_lambda(1.0f));
  host.add(broken);
  host.plan();
  flip_byte(broken / "level_1.ffl", size / 2);  // after open_asset, before the first ray
  hash_of_hits(host);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("level 1"), std::string::npos) << host.messages[0];
  EXPECT_NE(host.messages[0].find("level_1.ffl"), std::string::npos) << host.messages[0];
  EXPECT_GT(host.runtime().stats().fallbacks, 1000u);

  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0, 0, 10}, {0.01f, 0, -1}, context, hit));
  EXPECT_EQ(host.interaction(hit, context).level, 2u);
  host.plan();
  hash_of_hits(host);
  EXPECT_EQ(host.messages.size(), 1u);
}

TEST_F(RuntimeTest, ALevelThatWasReplacedSinceTheAssetWasOpenedIsNotMixedIn) {
  const auto rebaked = copy("rebaked.farfield"), grey = copy("grey.farfield");
  std::vector<LevelData> levels = white_sphere();
  set_diffuse(levels[1], vec3(0.5f));
  write_asset(grey, levels);
  Host host(with_lambda(1.0f));
  host.add(rebaked);
  host.plan();
  std::filesystem::copy_file(grey / "level_1.ffl", rebaked / "level_1.ffl",
                             std::filesystem::copy_options::overwrite_existing);
  hash_of_hits(host);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("level_1.ffl"), std::string::npos) << host.messages[0];
}

/// What can happen to a file while a host has its asset open.
void damage(const std::filesystem::path& file, uint32_t how) {
  std::error_code ignored;
  if (how % 3 == 0) std::filesystem::resize_file(file, 100, ignored);
  if (how % 3 == 1) std::filesystem::remove(file, ignored);
  if (how % 3 == 2) {
    const std::string garbage(std::filesystem::file_size(file, ignored), '\xff');
    std::fstream(file, std::ios::in | std::ios::out | std::ios::binary) << garbage;
  }
}

TEST_F(RuntimeTest, WhatIsLoadedStaysAsItWasWhateverHappensToItsFiles) {
  const auto asset = copy("changed.farfield");
  Host host;
  host.add(asset);
  host.plan(vec3(0, 0, 25));
  const uint64_t before = hash_of_hits(host, 0.02f);
  uint32_t how = 0;
  for (const auto& entry : std::filesystem::directory_iterator(asset)) damage(entry.path(), how++);
  EXPECT_EQ(hash_of_hits(host, 0.02f), before);
  host.plan(vec3(0, 0, 25));
  EXPECT_EQ(hash_of_hits(host, 0.02f), before);
  EXPECT_TRUE(host.messages.empty()) << host.messages[0];
}

TEST_F(RuntimeTest, FilesThatAreDamagedWhileRaysFlyCostLevelsAndNothingElse) {
  const auto distance_of = [](int frame) { return 3.0f * std::exp2f(static_cast<float>(frame * 5 % 8)); };
  std::vector<uint64_t> sound_frames;
  {
    Host host;
    host.add(sphere());
    for (int frame = 0; frame < 8; ++frame) {
      host.plan(vec3(0, 0, distance_of(frame)));
      sound_frames.push_back(hash_of_hits(host, 0.005f));
    }
  }
  size_t frames_as_they_should_be = 0, frames_with_messages = 0;
  for (uint32_t trial = 0; trial < 12; ++trial) {
    const auto asset = copy("damaged.farfield");
    Host host;
    host.add(asset);
    std::thread vandal([&] {
      for (const uint32_t level : {0u, 1u, 2u, 3u, 5u}) {
        std::this_thread::sleep_for(std::chrono::milliseconds(trial));
        damage(asset / ("level_" + std::to_string(level) + ".ffl"), trial + level);
      }
    });
    for (int frame = 0; frame < 8; ++frame) {
      host.plan(vec3(0, 0, distance_of(frame)));
      const uint64_t fallbacks = host.runtime().stats().fallbacks;
      const bool is_as_it_should_be = hash_of_hits(host, 0.005f) == sound_frames[static_cast<size_t>(frame)];
      const bool was_said = !host.messages.empty() && host.runtime().stats().fallbacks > fallbacks;
      EXPECT_TRUE(is_as_it_should_be || was_said) << "trial " << trial << ", frame " << frame;
      frames_as_they_should_be += is_as_it_should_be;
      frames_with_messages += was_said;
    }
    vandal.join();
    EXPECT_LE(host.messages.size(), 5u);
  }
  EXPECT_GT(frames_as_they_should_be, 0u);
  EXPECT_GT(frames_with_messages, 0u);
}

TEST_F(RuntimeTest, ProgressiveRaysUseTheRootFirstAndThePlanInTheEnd) {
  RuntimeOptions options;
  options.residency = Residency::Progressive;
  Host host(options);
  host.add(sphere());
  host.plan(vec3(0, 0, 5));
  hash_of_hits(host);
  EXPECT_GT(host.runtime().stats().fallbacks, 0u);

  Host wait;
  wait.add(sphere());
  wait.plan(vec3(0, 0, 5));
  const uint64_t expected = hash_of_hits(wait);
  for (int i = 0; i < 2000 && hash_of_hits(host) != expected; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(hash_of_hits(host), expected);
  host.plan(vec3(0, 0, 5000));  // drops loads that wait and levels that are there
  host.plan(vec3(0, 0, 5));
  host.runtime().prefetch();
  host.plan(vec3(0, 0, 5000));
}

TEST_F(RuntimeTest, JustBelowAndAboveAnIntegerLambdaRaysSeeTheSame) {
  // Same seeds; lambda 1 -+ 1e-3: one path in a thousand may see another level, on either side.
  const auto levels_seen = [](float lambda) {
    Host host(with_lambda(lambda));
    host.add(sphere());
    host.plan();
    std::vector<float> seen;
    for (uint32_t i = 0; i < 20000; ++i) {
      Rng rng(i);
      const vec3 direction = test::random_unit(rng);
      RayContext context;
      context.path_seed = rng.next_uint();
      context.ray_seed = rng.next_uint();
      EmbreeRayHit hit;
      const bool is_hit = host.trace(0.9f * test::random_unit(rng) - 5.0f * direction, direction, context, hit);
      seen.push_back(is_hit ? hit.ray.tfar + static_cast<float>(context.hit.level_slot) : -1.0f);
    }
    return seen;
  };
  for (const float integer : {1.0f, 2.0f, 3.0f, 5.0f}) {
    const std::vector<float> below = levels_seen(integer - 1e-3f);
    const std::vector<float> above = levels_seen(integer + 1e-3f);
    int different = 0;
    for (size_t i = 0; i < below.size(); ++i) different += below[i] != above[i];
    EXPECT_LE(different, 80) << integer;  // expected 40 in 20000
  }
}

// --- Interactions ----------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, InteractionsSayWhereAndHow) {
  Host host(with_lambda(0.0f));
  mat4x3 transform(2.0f);
  transform[3] = vec3(1, 2, 3);
  host.add(sphere(), {transform});
  host.plan();
  RayContext context;
  context.cone_width = 0.01f;
  context.cone_spread = 0.001f;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({1, 2, 13}, {0, 0.01f, -1}, context, hit));
  const Interaction interaction = host.interaction(hit, context);
  EXPECT_EQ(interaction.kind, Interaction::Kind::Surface);
  EXPECT_NEAR(glm::length(interaction.position - vec3(1, 2, 3)), 2.0f, 0.01f);
  EXPECT_NEAR(glm::dot(interaction.geometric_normal, vec3(0, 0, 1)), 1.0f, 0.01f);
  EXPECT_NEAR(glm::length(interaction.wo), 1.0f, 1e-5f);
  EXPECT_NEAR(interaction.footprint, 0.01f + 0.001f * hit.ray.tfar, 1e-6f);
  EXPECT_EQ(interaction.level, 0u);
  EXPECT_EQ(interaction.instance, 0u);
  EXPECT_NEAR(interaction.albedo.x, 1.0f, 1e-5f);

  // From inside, the normal is on the other side.
  ASSERT_TRUE(host.trace({1, 2, 3}, {0, 0.01f, -1}, context, hit));
  EXPECT_NEAR(host.interaction(hit, context).geometric_normal.z, 1.0f, 0.01f);
}

/// White spheres with smooth normals: one that stands for itself, and a part in three places.
std::vector<LevelData> spheres_in_places() {
  LevelData level = test::sphere_level(vec3(0), 1, 16);
  const auto count = static_cast<uint32_t>(level.quads.size());
  const uint32_t faces = face_count(level), vertices = static_cast<uint32_t>(level.positions.size());
  const LevelData once = level;
  for (const vec3& p : once.positions) level.positions.push_back(p);
  for (const Quad& q : once.quads) {
    level.quads.push_back({q.v0 + vertices, q.v1 + vertices, q.v2 + vertices, q.v3 + vertices});
  }
  for (uint32_t i = 0; i < count; ++i) level.quad_first_face.push_back(once.quad_first_face[i] + faces);
  for (uint32_t q = 0; q < 2 * count; ++q) {
    const uint32_t first = level.quad_first_face[q];
    for (uint32_t side = 0; side < (level.quads[q].is_pair() ? 2u : 1u); ++side) {
      level.corner_vertex.push_back(level.quads[q].face(side) % vertices);
      level.source_face.push_back((first + side) << kSourceTurnBits);
    }
  }
  for (const vec3& p : once.positions) level.shading_normal.push_back(pack_normal(glm::normalize(p)));
  for (uint32_t f = 0; f < 2 * faces; ++f) level.face_opacity.push_back(f % 5 == 0 ? 0 : 255);  // holes
  level.part_first_quad = {count};
  level.placements = {{mat4x3(1, 0, 0, 0, 1, 0, 0, 0, 1, -3, 0, 0), 0, 0},
                      {mat4x3(0, 2, 0, -1, 0, 0, 0, 0, 1, 0, 4, 0), 0, 1000},   // squeezed
                      {mat4x3(-1, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 3), 0, 2000}};  // mirrored
  level.header.bounds = {vec3(-4, -4, -4), vec3(5, 4, 4)};
  set_diffuse(level, vec3(1));
  LevelData root = test::sphere_level(vec3(0), 1, 4, 5, 3.2f);
  root.header.bounds = level.header.bounds;
  set_diffuse(root, vec3(1));
  return {level, root};
}

TEST_F(RuntimeTest, InteractionsOnPartsAreThoseOfTheFlatLevel) {
  std::vector<LevelData> levels = spheres_in_places();
  write_asset(path_of("parts.farfield"), levels);
  levels[0] = flattened(view_of(levels[0]));
  write_asset(path_of("flat.farfield"), levels);
  Host parts(with_lambda(0.0f)), flat(with_lambda(0.0f));
  const mat4x3 transform(0, 2, 0.5f, -1.5f, 0, 0, 0.3f, 0, 2, 10, 20, 30);
  parts.add(path_of("parts.farfield"), {transform});
  flat.add(path_of("flat.farfield"), {transform});
  parts.plan();
  flat.plan();
  Rng rng(5);
  std::set<uint32_t> places;
  int hits = 0, different = 0;
  for (int i = 0; i < 4000; ++i) {
    const vec3 target = transform * vec4(4.0f * test::random_unit(rng), 1),
               origin = target + 20.0f * test::random_unit(rng);
    RayContext context, flat_context;
    EmbreeRayHit hit, flat_hit;
    const vec3 direction = glm::normalize(transform * vec4(0, 0, 0, 1) - origin);
    const bool is_hit = parts.trace(origin, direction, context, hit);
    ASSERT_EQ(flat.trace(origin, direction, flat_context, flat_hit), is_hit);
    if (!is_hit) continue;
    ++hits;
    places.insert(context.hit.placement);
    const Interaction a = parts.interaction(hit, context), b = flat.interaction(flat_hit, flat_context);
    EXPECT_NEAR(hit.ray.tfar, flat_hit.ray.tfar, 1e-4f);
    // Between its corners, a squeezed part's normals are squeezed after they are interpolated.
    const float tolerance = context.hit.placement == 1 ? 1.5e-2f : 2e-3f;
    const bool is_same = glm::length(a.geometric_normal - b.geometric_normal) < 1e-4f &&
                         glm::length(a.shading_normal - b.shading_normal) < tolerance && a.source_face == b.source_face;
    different += !is_same;
    EXPECT_NEAR(a.albedo.y, b.albedo.y, 1e-6f);
    // Nothing hides the hit from itself.
    RayContext next;
    next.set_origin(context.hit);
    EmbreeRayHit behind;
    const vec3 away = a.geometric_normal;
    if (parts.trace(a.ray_origin(away), away, next, behind)) {
      EXPECT_GT(behind.ray.tfar, 1e-3f);
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_EQ(places.size(), 4u);
  EXPECT_LT(different, hits / 200);  // at edges
  HitRecord broken;
  broken.instance = 0;
  RayContext of_nowhere;
  EmbreeRayHit hit;
  ASSERT_TRUE(parts.trace(transform * vec4(0, 0, 9, 1), -vec3(transform[2]), of_nowhere, hit));
  of_nowhere.hit.placement = 3;
  EXPECT_EQ(parts.interaction(hit, of_nowhere).kind, Interaction::Kind::None);
}

TEST_F(RuntimeTest, InteractionsSayWhatTheirLightMeets) {
  const TemporaryFolder folder;
  std::vector<LevelData> levels = white_sphere();
  const SymMat3 flat = SymMat3::outer(vec3(0, 0, 1)) + SymMat3::identity() * 0.01f;
  levels[4] = test::empty_level(5, levels[4].header.resolution);
  test::set_volume(
      levels[4], ivec3(1), vec3(-2.56f), [](int, int, int) { return 50.0f; }, [&](int, int, int) { return flat; });
  set_diffuse(levels[4], vec3(0.25f, 0.5f, 0.75f));
  write_asset(folder.path() / "a.farfield", levels);
  const auto at_lambda = [&](float lambda, const mat4x3& place) {
    Host host(with_lambda(lambda));
    host.add(folder.path() / "a.farfield", {place});
    host.plan();
    RayContext context;
    EmbreeRayHit hit;
    EXPECT_TRUE(host.trace({0.1f, 0.2f, 20}, {0, 0, -1}, context, hit));
    return host.interaction(hit, context);
  };
  const Interaction surface = at_lambda(0, mat4x3(1.0f));
  ASSERT_EQ(surface.kind, Interaction::Kind::Surface);
  EXPECT_EQ(surface.reflectance.diffuse, vec3(1.0f));
  EXPECT_EQ(surface.reflectance.specular, vec3(0.0f));
  EXPECT_EQ(surface.reflectance.sggx[0], 0.0f);

  const mat4x3 turned(vec3(0, 0, 1), vec3(0, 1, 0), vec3(-1, 0, 0), vec3(0.0f));  // z becomes -x
  for (const bool is_turned : {false, true}) {
    const Interaction volume = at_lambda(5, is_turned ? turned : mat4x3(1.0f));
    ASSERT_EQ(volume.kind, Interaction::Kind::Volume);
    EXPECT_NEAR(volume.reflectance.diffuse.y, 0.5f, 0.01f);
    EXPECT_EQ(volume.reflectance.self_shadowing, 1.0f);
    const float* s = volume.reflectance.sggx;
    EXPECT_NEAR(s[0] + s[1] + s[2], 1.0f, 1e-4f);
    EXPECT_GT(s[is_turned ? 0 : 2], 0.9f);
    EXPECT_LT(s[is_turned ? 2 : 0], 0.1f);
  }
}

/// Two levels of fog from 0 to 4 along each axis.
std::vector<LevelData> fog_levels(float fine, float coarse, const std::optional<SymMat3>& shape = std::nullopt) {
  std::vector<LevelData> levels;
  for (uint32_t k = 0; k < 2; ++k) {
    LevelData& level = levels.emplace_back(test::empty_level(k, k == 0 ? 0.5f : 1.0f));
    const int side = k == 0 ? 8 : 4;
    const auto density = [&](int x, int y, int z) {
      return std::max({x, y, z}) < side ? (k == 0 ? fine : coarse) : 0.0f;
    };
    if (shape)
      test::set_volume(level, ivec3(1), vec3(0.0f), density, [&](int, int, int) { return *shape; });
    else
      test::set_volume(level, ivec3(1), vec3(0.0f), density);
    level.header.medium = Medium::Fog;
    level.header.fog_albedo = vec3(0.5f);
  }
  return levels;
}

TEST_F(RuntimeTest, CollisionsInVolumesSayTheirExtinction) {
  const SymMat3 flat = SymMat3::outer(vec3(0, 0, 1)) + SymMat3::identity() * 0.04f;
  mat4x3 twice(2.0f);
  mat4x3 turned(vec3(0, 0, 2), vec3(0, 2, 0), vec3(-2, 0, 0), vec3(0.0f));  // z becomes -x
  const auto extinction = [&](const std::filesystem::path& asset, const RuntimeOptions& options, const mat4x3& place,
                              const vec3& origin, const vec3& direction) {
    Host host(options);
    host.add(asset, {place});
    host.plan();
    RayContext context;
    EmbreeRayHit hit;
    EXPECT_TRUE(host.trace(origin, direction, context, hit));
    const Interaction made = host.interaction(hit, context);
    EXPECT_EQ(made.kind, Interaction::Kind::Volume);
    return made.sigma_t;
  };
  write_asset(path_of("fog"), fog_levels(20, 60));
  const vec3 above(2.1f, 2.2f, 20), down(0, 0, -1);
  EXPECT_NEAR(extinction(path_of("fog"), with_lambda(0), mat4x3(1.0f), above, down), 20.0f, 1e-3f);
  EXPECT_NEAR(extinction(path_of("fog"), with_lambda(1), mat4x3(1.0f), above, down), 60.0f, 1e-3f);
  EXPECT_NEAR(extinction(path_of("fog"), with_lambda(0), mat4x3(1.0f), above, 7.0f * down), 20.0f, 1e-3f);
  EXPECT_NEAR(extinction(path_of("fog"), with_lambda(0), twice, above, down), 10.0f, 1e-3f);
  // A morph is both media, whichever was met.
  EXPECT_NEAR(extinction(path_of("fog"), morphing(0.25f), twice, above, 3.0f * down), 0.5f * (15 + 15), 1e-3f);

  write_asset(path_of("flat"), fog_levels(20, 20, flat));
  const SymMat3 largest_1 = flat * (1 / 1.04f);  // as levels have it
  const vec3 tilted = glm::normalize(vec3(0.6f, 0.1f, -1));
  const auto sigma = [&](const vec3& w) { return std::sqrt(largest_1.quadratic(w)); };
  for (const vec3& w : {down, tilted}) {
    EXPECT_NEAR(extinction(path_of("flat"), with_lambda(0), mat4x3(1.0f), vec3(2) - 9.0f * w, w), 20 * sigma(w), 0.2f);
  }
  EXPECT_NEAR(extinction(path_of("flat"), with_lambda(0), turned, vec3(-4, 4, 4) - 19.0f * down, down),
              10 * sigma({1, 0, 0}), 0.1f);

  Host host(with_lambda(0));
  host.add(sphere());
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0, 0, 10}, down, context, hit));
  EXPECT_EQ(host.interaction(hit, context).sigma_t, 0.0f);
}

TEST_F(RuntimeTest, ScenesThatAreInstancedAreRefusedInWords) {
  Host host;
  host.add(sphere());
  host.plan();
  const EmbreeScene outer = new_scene(host.device());
  const EmbreeGeometry instance(rtcNewGeometry(host.device(), RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(instance.get(), host.scene());
  const float shifted[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 0, 0};
  rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, shifted);
  commit_geometry(instance.get());
  attach_geometry(outer.get(), instance.get());
  commit_scene(outer.get());
  for (int i = 0; i < 3; ++i) {
    RayContext context;
    EmbreeRayHit hit = make_ray_hit({5, 0, 10}, {0, 0, -1});
    EmbreeRay shadow = hit.ray;
    EXPECT_FALSE(trace_nearest(outer.get(), context.embree, hit));
    EXPECT_FALSE(trace_occlusion(outer.get(), context.embree, shadow));
    EXPECT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));  // the scene itself goes on to be seen
  }
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("instanced"), std::string::npos) << host.messages[0];
}

TEST_F(RuntimeTest, HitsThatAreNotOursOrHaveGoneAreBlackAndSaidOnce) {
  Host host;
  host.add(sphere());
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0, 0, 10}, {0, 0.01f, -1}, context, hit));
  ASSERT_EQ(host.interaction(hit, context).kind, Interaction::Kind::Surface);

  const auto expect_none = [&](const HitRecord& record, const char* what) {
    RayContext other = context;
    other.hit = record;
    const Interaction interaction = host.interaction(hit, other);
    EXPECT_EQ(interaction.kind, Interaction::Kind::None) << what;
    Rng rng(1);
    EXPECT_EQ(interaction.sample(rng).weight, vec3(0.0f)) << what;
    EXPECT_EQ(interaction.eval({0, 0, 1}, rng), vec3(0.0f)) << what;
    EXPECT_EQ(interaction.pdf({0, 0, 1}), 0.0f) << what;
    EXPECT_EQ(interaction.ray_origin({0, 0, 1}), interaction.position) << what;
  };
  expect_none(HitRecord{}, "no hit");
  HitRecord record = context.hit;
  record.instance = 1;
  expect_none(record, "instance");
  record = context.hit;
  record.level_slot = 255;
  expect_none(record, "level");
  record = context.hit;
  record.element = 0xffffffffu;
  expect_none(record, "face");
  record.is_volume = true;
  expect_none(record, "voxel");

  // A plan from afar drops the level that was hit.
  host.runtime().set_cameras({{vec3(0, 0, 1e6f), 0.0f, 1e-3f}});
  ASSERT_TRUE(host.runtime().plan_frame());
  expect_none(context.hit, "stale");
  EXPECT_EQ(host.messages.size(), 1u);
}

TEST_F(RuntimeTest, HitsOfAnotherQueryThanTheContextsAreBlack) {
  Host host;
  host.add(sphere(), {at({0, 0, 0}), at({5, 0, 0})});
  host.plan();
  RayContext first, second;
  EmbreeRayHit hit, other;
  ASSERT_TRUE(host.trace({0, 0, 10}, {0, 0.01f, -1}, first, hit));
  ASSERT_TRUE(host.trace({5, 0, 10}, {0, 0.01f, -1}, second, other));
  EXPECT_EQ(host.interaction(hit, first).kind, Interaction::Kind::Surface);
  EXPECT_EQ(host.interaction(hit, second).kind, Interaction::Kind::None);
  // A used context whose flags are lost is answered as a foreign one: its record is of the query before.
  rtcInitIntersectContext(&first.embree);
  ASSERT_TRUE(host.trace({5, 0, 10}, {0, 0.01f, -1}, first, other));
  EXPECT_EQ(host.interaction(other, first).kind, Interaction::Kind::None);
  ASSERT_EQ(host.messages.size(), 2u);
  EXPECT_NE(host.messages[0].find("another query"), std::string::npos) << host.messages[0];
  EXPECT_NE(host.messages[1].find("flags"), std::string::npos) << host.messages[1];
}

TEST_F(RuntimeTest, UnknownAssetsHaveNoLevelsAndNoBounds) {
  Host host;
  const AssetId unknown{7};
  EXPECT_TRUE(host.runtime().levels(unknown).empty());
  vec3 lower(0.0f), upper(0.0f);
  host.runtime().bounds(unknown, lower, upper);
  EXPECT_GT(lower.x, upper.x);
  EXPECT_EQ(host.runtime().add_instance(unknown, mat4x3(1.0f)).error().code, ErrorCode::InvalidArgument);
}

TEST_F(RuntimeTest, SurfacesAndBlocksOfAlbedoOneAreWhiteFurnaces) {
  Rng transforms(21);
  for (const float lambda : {0.0f, 1.0f, 1.5f, 2.0f, 3.0f, 5.0f}) {
    Host host(with_lambda(lambda));
    mat4x3 transform;
    for (int column = 0; column < 3; ++column)
      transform[column] = (0.5f + transforms.next()) * test::random_unit(transforms);
    transform[3] = vec3(3, -2, 1);
    host.add(sphere(), {transform});
    host.plan();
    double sum = 0, sum_squares = 0;
    int hits = 0, open_paths = 0;
    constexpr int kPaths = 4000;
    for (uint32_t path = 0; path < kPaths; ++path) {
      Rng rng(path, 3);
      vec3 direction = test::random_unit(rng);
      vec3 origin = vec3(3, -2, 1) + 0.3f * test::random_unit(rng) - 8.0f * direction;
      vec3 throughput(1.0f);
      RayContext context;
      context.path_seed = path;
      int events = 0;
      for (; events < 3000; ++events) {
        context.ray_seed = rng.next_uint();
        EmbreeRayHit hit;
        if (!host.trace(origin, direction, context, hit)) break;
        const Interaction interaction = host.interaction(hit, context);
        const ScatterSample sample = interaction.sample(rng);
        throughput *= sample.weight;
        ASSERT_TRUE(is_finite(throughput));
        if (max_component(throughput) == 0.0f) break;
        origin = interaction.ray_origin(sample.wi);
        direction = sample.wi;
        context.set_origin(context.hit);
      }
      open_paths += events == 3000;
      hits += events > 0;
      sum += throughput.x;
      sum_squares += throughput.x * throughput.x;
    }
    EXPECT_GT(hits, kPaths / 3) << lambda;
    EXPECT_LE(open_paths, 2) << lambda;  // trapped by leaks into the mesh
    const double mean = sum / kPaths;
    const double error = std::sqrt(std::max(0.0, sum_squares / kPaths - mean * mean) / kPaths);
    EXPECT_NEAR(mean, 1.0, 4.0 * error + 2e-3) << lambda;
  }
}

TEST_F(RuntimeTest, RaysThatLeaveASurfaceDoNotMeetItAgain) {
  Rng rng(31);
  for (int i = 0; i < 30; ++i) {
    Host host(with_lambda(0.0f));
    mat4x3 transform;
    const float size = std::pow(10.0f, 6.0f * rng.next() - 3.0f);
    do {
      for (int column = 0; column < 3; ++column)
        transform[column] = size * (0.3f + rng.next()) * test::random_unit(rng);
    } while (std::abs(glm::determinant(mat3(transform))) < 0.05f * size * size * size);
    // Up to 1e3 sizes away from the origin of the world; in the last cases 1e7 units.
    const float far = i < 25 ? 1e3f * size * rng.next() : 1e7f;
    if (i >= 25) {
      for (int column = 0; column < 3; ++column) transform[column] *= 1e5f / size;
    }
    transform[3] = far * test::random_unit(rng);
    const float radius = i < 25 ? size : 1e5f;
    host.add(sphere(), {transform});
    host.plan();
    int self_hits = 0, rays = 0;
    for (int k = 0; k < 500; ++k) {
      const vec3 direction = test::random_unit(rng);
      RayContext context;
      EmbreeRayHit hit;
      if (!host.trace(transform[3] - 4.0f * radius * direction, direction, context, hit)) continue;
      const Interaction interaction = host.interaction(hit, context);
      ASSERT_TRUE(is_finite(interaction.position) && is_finite(interaction.geometric_normal));
      for (int out = 0; out < 4; ++out) {
        vec3 wi = test::random_unit(rng);
        if (glm::dot(wi, interaction.geometric_normal) < 0.0f) wi = -wi;
        RayContext next;
        next.set_origin(context.hit);
        EmbreeRayHit again;
        ++rays;
        // A sphere is convex: whatever leaves it meets nothing. Its facets are nearly so.
        self_hits += host.trace(interaction.ray_origin(wi), wi, next, again);
      }
    }
    EXPECT_GT(rays, 500);
    EXPECT_EQ(self_hits, 0) << "transform " << i << " size " << size << " at " << far;
  }
}

// --- Limits ----------------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, LimitsHoldTheLevelsOfInstancesAndAssets) {
  Host host;
  mat4x3 beside(1.0f);
  beside[3] = vec3(5, 0, 0);
  const AssetId asset = host.add(sphere(), {mat4x3(1.0f), beside});
  const auto lambda = [&](float x) {
    RayContext context;
    EmbreeRayHit hit;
    EXPECT_TRUE(host.trace({x, 0, 10}, {0, 0, -1}, context, hit));
    return context.hit.lambda;
  };
  host.plan(vec3(0, 0, 2));  // close: level 0
  EXPECT_EQ(host.runtime().plan_frame()->finest_level[0], 0u);
  EXPECT_EQ(lambda(0.1f), 0.0f);

  ASSERT_TRUE(host.runtime().set_level_limits(asset, {2, 3}));
  EXPECT_EQ(host.plan(vec3(0, 0, 2)).finest_level[0], 2u);
  EXPECT_EQ(lambda(0.1f), 2.0f);
  EXPECT_EQ(host.plan(vec3(0, 0, 1e6f)).finest_level[0], 3u);  // far: not the root
  EXPECT_EQ(lambda(0.1f), 3.0f);

  ASSERT_TRUE(host.runtime().set_level_limits(InstanceId{1}, {0, 0}));  // pinned
  EXPECT_EQ(host.plan(vec3(0, 0, 1e6f)).finest_level[0], 0u);
  EXPECT_EQ(lambda(5.1f), 0.0f);
  EXPECT_EQ(lambda(0.1f), 3.0f);

  ASSERT_TRUE(host.runtime().move_instance(InstanceId{1}, beside));
  const auto another = host.runtime().add_instance(asset, beside);
  ASSERT_TRUE(another);
  EXPECT_EQ(host.plan(vec3(0, 0, 1e6f)).finest_level[0], 0u);  // a move keeps limits

  EXPECT_FALSE(host.runtime().set_level_limits(asset, {3, 2}));
  EXPECT_FALSE(host.runtime().set_level_limits(AssetId{7}, {}));
  EXPECT_FALSE(host.runtime().set_level_limits(InstanceId{7}, {}));
}

// --- Differentials ---------------------------------------------------------------------------------------------------

TEST_F(RuntimeTest, ADifferentialOfAPinholeAsksForTheLevelsOfItsCone) {
  Host host;
  host.add(sphere());
  host.plan(vec3(0, 0, 10), 1e-6f);  // levels are the rays' own choice
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const vec3 direction = glm::normalize(vec3(0.08f * rng.next(), 0.08f * rng.next(), -1));
    const float spread = std::exp2(-12.0f * rng.next());
    RayContext cone, differential;
    cone.path_seed = differential.path_seed = rng.next_uint();
    cone.cone_spread = spread;
    const vec3 right = glm::normalize(glm::cross(direction, vec3(0, 1, 0)));
    differential.set_differential(
        perspective_differential(direction, spread * right, spread * glm::cross(right, direction)), direction);
    EmbreeRayHit a, b;
    ASSERT_EQ(host.trace({0, 0, 10}, direction, cone, a), host.trace({0, 0, 10}, direction, differential, b));
    if (a.hit.geomID != host.runtime().geometry_id()) continue;
    EXPECT_EQ(a.ray.tfar, b.ray.tfar);
    EXPECT_NEAR(cone.hit.lambda, differential.hit.lambda, 1e-4f);
    EXPECT_NEAR(cone.hit.footprint, differential.hit.footprint, 1e-4f * cone.hit.footprint);
  }
}

TEST_F(RuntimeTest, EitherAxisOfAFootprintCanAskForTheLevel) {
  Host host;
  host.add(sphere());
  host.plan(vec3(0, 0, 10), 1e-6f);
  const vec3 direction(0, 0, -1);
  const auto lambda = [&](FootprintAxis axis) {
    RayContext context;
    context.set_differential(perspective_differential(direction, {0.08f, 0, 0}, {0, 0.02f, 0}), direction, axis);
    EmbreeRayHit hit;
    EXPECT_TRUE(host.trace({0.01f, 0, 10}, direction, context, hit));
    return context.hit.lambda;
  };
  EXPECT_NEAR(lambda(FootprintAxis::Longer) - lambda(FootprintAxis::Shorter), 2.0f, 1e-4f);
}

TEST_F(RuntimeTest, SpawnGivesTheNextRayItsConeItsOriginAndItsDifferential) {
  Host host(with_lambda(0.0f));
  host.add(sphere());
  host.plan();
  const vec3 direction(0, 0, -1);
  RayContext context;
  context.cone_spread = 0.01f;
  context.set_differential(perspective_differential(direction, {0.01f, 0, 0}, {0, 0.01f, 0}), direction);
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0.3f, 0.1f, 10}, direction, context, hit));
  const Interaction interaction = host.interaction(hit, context);
  ScatterSample mirror;
  mirror.wi = glm::reflect(direction, interaction.geometric_normal);
  mirror.pdf = std::numeric_limits<float>::infinity();
  mirror.weight = vec3(1.0f);
  RayContext next = context;
  interaction.spawn(mirror, hit.ray.tfar, next);
  EXPECT_EQ(next.origin_instance, 0u);
  EXPECT_FLOAT_EQ(next.cone_width, 0.01f * hit.ray.tfar);
  EXPECT_FLOAT_EQ(next.cone_spread, 0.01f);
  // A flat mirror changes nothing about how a pencil of rays goes apart.
  const FootprintAxes axes = next.footprint_growth.at(5.0f);
  EXPECT_NEAR(axes.longer, 0.01f * (hit.ray.tfar + 5), 1e-4f);
  EXPECT_NEAR(axes.shorter, 0.01f * (hit.ray.tfar + 5), 1e-4f);

  ScatterSample diffuse = mirror;
  diffuse.pdf = 1 / 3.14159265f;
  RayContext wide = context;
  interaction.spawn(diffuse, hit.ray.tfar, wide);
  EXPECT_NEAR(wide.width_at(100) - next.width_at(100), 25.0f, 0.1f);  // a quarter radian
}

// --- Morphs ----------------------------------------------------------------------------------------------------------

/// A sphere of radius 1 that swells by a tenth, then becomes fog: levels 0, 1, 2.
std::vector<LevelData> swelling_sphere() {
  std::vector<LevelData> levels = {test::sphere_level(vec3(0), 1.0f, 48, 0, 0.1f),
                                   test::sphere_level(vec3(0), 1.1f, 48, 1, 0.2f), test::empty_level(2, 0.4f)};
  for (uint32_t v = 0; v < levels[0].positions.size(); ++v) levels[1].morph_vertex.push_back(v);
  for (uint32_t f = 0; f < face_count(view_of(levels[0])); ++f) levels[1].morph_face.push_back(f);
  levels[2].morph_vertex.assign(levels[1].positions.size(), kMorphVoxelized);
  levels[2].morph_face.assign(face_count(view_of(levels[1])), kMorphVoxelized);
  test::set_volume(levels[2], ivec3(1), vec3(-1.6f),
                   [](int x, int y, int z) { return glm::length(vec3(x, y, z) - 3.5f) < 3.0f ? 2.0f : 0.0f; });
  test::set_diffuse(levels[0], vec3(0.8f, 0.2f, 0.2f));
  test::set_diffuse(levels[1], vec3(0.2f, 0.2f, 0.8f));
  test::set_diffuse(levels[2], vec3(0.2f, 0.2f, 0.8f));
  return levels;
}

/// Its asset.
std::filesystem::path write_swelling_sphere(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder)) write_asset(folder, swelling_sphere());
  return folder;
}

TEST_F(RuntimeTest, AMorphLiesBetweenItsLevels) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  for (const float t : {0.25f, 0.5f, 0.9f}) {
    Host host(morphing(t));
    host.add(asset);
    EXPECT_EQ(host.plan().morphs, 1u);
    RayContext context;
    EmbreeRayHit hit;
    ASSERT_TRUE(host.trace({0.01f, 0.02f, 10}, {0, 0, -1}, context, hit));
    EXPECT_NEAR(hit.ray.tfar, 9 - 0.1f * t, 3e-3f);  // facets
    EXPECT_EQ(context.hit.blend, t);
    const Interaction interaction = host.interaction(hit, context);
    EXPECT_EQ(interaction.kind, Interaction::Kind::Surface);
    EXPECT_NEAR(interaction.albedo.x, 0.8f - 0.6f * t, 0.01f);  // colours are bytes
    EXPECT_NEAR(interaction.albedo.z, 0.2f + 0.6f * t, 0.01f);
    EXPECT_GT(interaction.shading_normal.z, 0.99f);
    EXPECT_TRUE(host.messages.empty());
  }
}

TEST_F(RuntimeTest, MorphsAreTheLevelsThemselvesAtTheirEnds) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  for (const float lambda : {0.0f, 1.0f, 2.0f}) {
    Host still(with_lambda(lambda)), moving(morphing(lambda));
    for (Host* host : {&still, &moving}) {
      host->add(asset);
      host->plan();
    }
    EXPECT_EQ(test::hash_of_hits(still), test::hash_of_hits(moving)) << lambda;
  }
}

TEST_F(RuntimeTest, AMorphIsTheSameForAnyNumberOfThreadsColdAndWarm) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  for (const float lambda : {0.5f, 1.5f}) {
    std::set<uint64_t> hashes;
    for (const int threads : {1, 2, 16}) {
      const ThreadLimit limit(threads);
      Host host(morphing(lambda));
      host.add(asset);
      host.plan();
      hashes.insert(test::hash_of_hits(host));
      host.runtime().prefetch();
      hashes.insert(test::hash_of_hits(host));
      EXPECT_EQ(host.runtime().stats().fallbacks, 0u);
    }
    EXPECT_EQ(hashes.size(), 1u) << lambda;
  }
}

TEST_F(RuntimeTest, RaysThatLeaveAMorphSeeTheSameOne) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  Host host(morphing(0.5f));
  host.add(asset);
  host.plan();
  Rng rng(7);
  int self_hits = 0;
  for (int k = 0; k < 2000; ++k) {
    const vec3 direction = test::random_unit(rng);
    RayContext context;
    EmbreeRayHit hit;
    ASSERT_TRUE(host.trace(-4.0f * direction, direction, context, hit));
    const Interaction interaction = host.interaction(hit, context);
    vec3 wi = test::random_unit(rng);
    if (glm::dot(wi, interaction.geometric_normal) < 0.0f) wi = -wi;
    RayContext next;
    next.set_origin(context.hit);
    EXPECT_EQ(next.origin_blend, 0.5f);
    self_hits += host.trace(interaction.ray_origin(wi), wi, next, hit);
  }
  EXPECT_EQ(self_hits, 0);
}

TEST_F(RuntimeTest, WhereAMorphDoesNotFitItsLevelsDissolve) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  Host wide(morphing(0.5f));
  wide.add(asset);
  const PlanSummary all = wide.plan();
  EXPECT_EQ(all.morphs, 1u);

  RuntimeOptions options = morphing(0.5f);
  options.budget_bytes = all.planned_bytes - 1;
  Host tight(options);
  tight.add(asset);
  const PlanSummary less = tight.plan();
  EXPECT_EQ(less.morphs, 0u);
  EXPECT_EQ(less.morphs_given_up, 1u);
  EXPECT_EQ(less.finest_level, all.finest_level);
  test::hash_of_hits(tight);
  EXPECT_LE(tight.runtime().stats().peak_accounted_bytes, options.budget_bytes);

  RuntimeOptions dissolving = options;
  dissolving.blend = Blend::Dissolve;
  Host plain(dissolving);
  plain.add(asset);
  plain.plan();
  EXPECT_EQ(test::hash_of_hits(plain), test::hash_of_hits(tight));

  RuntimeOptions enough = options;
  enough.budget_bytes = all.planned_bytes;
  Host exact(enough);
  exact.add(asset);
  EXPECT_EQ(exact.plan().morphs, 1u);
  EXPECT_EQ(test::hash_of_hits(exact), test::hash_of_hits(wide));
  EXPECT_LE(exact.runtime().stats().peak_accounted_bytes, enough.budget_bytes);
  EXPECT_TRUE(exact.messages.empty());
}

TEST_F(RuntimeTest, LevelsBlendOverTheWindow) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  for (const auto& [lambda, blend] : {std::pair(0.7f, 0.0f), {0.75f, 0.0f}, {0.875f, 0.5f}}) {
    RuntimeOptions options = morphing(lambda);
    options.blend_window = 0.25f;
    Host host(options);
    host.add(asset);
    host.plan();
    RayContext context;
    EmbreeRayHit hit;
    ASSERT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
    EXPECT_EQ(context.hit.blend, blend) << lambda;
  }
  const EmbreeDevice device = std::move(*make_embree_device());
  for (const float window : {0.0f, -1.0f, 1.5f, std::numeric_limits<float>::quiet_NaN()}) {
    RuntimeOptions options;
    options.blend_window = window;
    EXPECT_FALSE(Runtime::create(device.get(), options)) << window;
  }
}

TEST_F(RuntimeTest, AssetsWithoutMeasuredMorphsDissolveAndSaySo) {
  const std::filesystem::path asset = path_of("old");
  const auto measure = [](const LevelView& level) { return *measure_level_scene(level); };
  test::write_asset(asset, swelling_sphere(), measure);
  Host host(morphing(0.5f));
  host.add(asset);
  EXPECT_EQ(host.plan().morphs, 0u);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_NE(host.messages[0].find("dissolve"), std::string::npos) << host.messages[0];
}

TEST_F(RuntimeTest, AskingForAMorphAheadOfRaysIsNoFallback) {
  RuntimeOptions options = morphing(0.5f);
  options.residency = Residency::Progressive;
  Host host(options);
  host.add(write_swelling_sphere(path_of("swelling")));
  host.plan();
  host.runtime().prefetch();
  EXPECT_EQ(host.runtime().stats().fallbacks, 0u);
}

TEST_F(RuntimeTest, AFrameInProgressGoesOnWithOneOfTheLevelsUntilTheMorphIsThere) {
  const std::filesystem::path asset = write_swelling_sphere(path_of("swelling"));
  RuntimeOptions options = morphing(0.5f);
  options.residency = Residency::Progressive;
  Host host(options);
  host.add(asset);
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0, 0, 10}, {0, 0, -1}, context, hit));
  EXPECT_EQ(context.hit.blend, 0.0f);
  EXPECT_GT(host.runtime().stats().fallbacks, 0u);
  for (int i = 0; i < 5000 && context.hit.blend == 0.0f; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    host.trace({0, 0, 10}, {0, 0, -1}, context, hit);
  }
  EXPECT_EQ(context.hit.blend, 0.5f);
}

TEST_F(RuntimeTest, ConesWidenWithTheLobe) {
  Host host(with_lambda(0.0f));
  host.add(sphere());
  host.plan();
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host.trace({0, 0, 10}, {0.01f, 0, -1}, context, hit));
  const Interaction interaction = host.interaction(hit, context);
  ScatterSample sample;
  float last = 10.0f;
  for (const float pdf : {1e-6f, 0.08f, 0.3f, 1.0f, 100.0f, 1e8f, std::numeric_limits<float>::infinity()}) {
    sample.pdf = pdf;
    const float spread = interaction.next_cone_spread(sample, 0.01f);
    EXPECT_GE(spread, 0.01f);
    EXPECT_LE(spread, 1.01f);
    EXPECT_LE(spread, last);
    last = spread;
  }
  sample.pdf = kInvPi;
  EXPECT_NEAR(interaction.next_cone_spread(sample, 0.0f), 0.25f, 1e-4f);
  sample.pdf = 0.0f;
  EXPECT_EQ(interaction.next_cone_spread(sample, 0.5f), 0.5f);
}

}  // namespace
}  // namespace farfield
