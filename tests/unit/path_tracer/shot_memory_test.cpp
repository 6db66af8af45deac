// SPDX-License-Identifier: Apache-2.0
// The budget of a shot is what `ps` says, down to budgets so small that the process's own doings would show: code that
// runs for the first time, files that are written and hashed, places of instances. A program of its own, because other
// tests would have done all that before.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "path_tracer/shot_job.h"
#include "tests/support/child_process.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kAssets = 9;
constexpr float kSeconds = 8 / 24.0f;  ///< of the shot

/// Collects what a glTF scene is made of.
class SceneWriter {
 public:
  size_t add_values(const std::vector<float>& values, size_t width) {
    const std::string bytes = test::raw(values);
    doc_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
    Json accessor = {{"bufferView", doc_["bufferViews"].size() - 1},
                     {"componentType", 5126},
                     {"count", values.size() / width},
                     {"type", width == 1 ? "SCALAR" : "VEC3"}};
    accessor["min"] = std::vector<float>(width, 0.0f);
    accessor["max"] = std::vector<float>(width, 1.0f);
    doc_["accessors"].push_back(accessor);
    binary_ += bytes;
    return doc_["accessors"].size() - 1;
  }
  size_t add_node(const Json& node) {
    doc_["nodes"].push_back(node);
    doc_["scenes"][0]["nodes"].push_back(doc_["nodes"].size() - 1);
    return doc_["nodes"].size() - 1;
  }
  /// The node goes from one place to another while the shot lasts.
  void move(size_t node, const vec3& from, const vec3& to) {
    if (!times_) times_ = add_values({0.0f, kSeconds}, 1);
    Json& animation = doc_["animations"][0];
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", "translation"}}}});
    animation["samplers"].push_back(
        {{"input", *times_}, {"output", add_values({from.x, from.y, from.z, to.x, to.y, to.z}, 3)}});
  }
  Json& document() { return doc_; }
  std::string glb() {
    doc_["buffers"][0]["byteLength"] = binary_.size();
    return test::glb(doc_.dump(), binary_);
  }

 private:
  Json doc_ = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  std::string binary_;
  std::optional<size_t> times_;
};

/// Instances of nine assets in rows, and a camera that draws back from them. They walk, if asked to.
std::string scene_of(int instances, bool is_moving) {
  SceneWriter scene;
  for (int i = 0; i < kAssets; ++i) {  // the baker has the rest
    const Json triangle = {{"attributes", {{"POSITION", scene.add_values({0, 0, 0, 1, 1, 1, 0, 1, 0}, 3)}}}};
    scene.document()["meshes"].push_back({{"name", fmt::format("bush{}", i)}, {"primitives", {triangle}}});
  }
  for (int i = 0; i < instances; ++i) {
    const vec3 place(1.5f * static_cast<float>(i % 10 - 5), 0.0f, -1.5f * static_cast<float>(i / 10));
    const size_t node = scene.add_node({{"mesh", i % kAssets}, {"translation", {place.x, place.y, place.z}}});
    if (is_moving) scene.move(node, place, place + vec3(1.0f, 0.5f, 0.0f));
  }
  scene.document()["cameras"] =
      Json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.01}}}}});
  scene.move(scene.add_node({{"camera", 0}}), vec3(0.5f, 1.0f, 2.0f), vec3(0.5f, 4.0f, 30.0f));
  return scene.glb();
}

/// Each shot in a process of its own, as the command renders it.
class ShotMemory : public testing::Test {
 protected:
  ShotMemory() {
    test::in_a_child_process([&] {
      for (int i = 0; i < kAssets; ++i)
        test::write_asset(folder_.path() / fmt::format("bush{}", i), test::foliage(10000, static_cast<uint64_t>(i)));
    });
    test::write_text(folder_.path() / "baker",
                     fmt::format("#!/bin/sh\nmkdir -p \"$5\"\nfor i in 0 1 2 3 4 5 6 7 8; do\n"
                                 "  cp -rT {}/bush$i \"$5/bush$i.farfield\" || exit 1\n  echo ready bush$i\ndone\n",
                                 folder_.path().string()));
    fs::permissions(folder_.path() / "baker", fs::perms::owner_all);
    options_.scene = folder_.path() / "scene.glb";
    options_.assets = folder_.path() / "assets";
    options_.baker = folder_.path() / "baker";
    options_.width = 320;  // a frame's file has half a megabyte or more
    options_.height = 180;
    options_.trace.samples_per_pixel = 1;
    options_.trace.max_depth = 2;
  }

  void expect_within(const std::string& glb, const std::vector<double>& budgets_mib) {
    test::write_text(options_.scene, glb);
    for (const double mib : budgets_mib) {
      options_.budget_bytes = static_cast<uint64_t>(mib * (1 << 20));
      const fs::path out = folder_.path() / fmt::format("{}", mib);
      test::in_a_child_process([&] {
        mallopt(M_ARENA_MAX, 1);  // as the command has it
        const auto report = render_shot(options_, {0, 8, 4}, out);
        EXPECT_TRUE(report) << report.error().message;
      });
      if (HasFailure()) return;
      const Json report = Json::parse(std::ifstream(out / "shot.json"));
      const auto bytes = [&](const char* key) { return report[key].get<uint64_t>(); };
      EXPECT_LE(bytes("peak_accounted_bytes"), options_.budget_bytes);
      EXPECT_GE(bytes("peak_accounted_bytes"), options_.budget_bytes / 2) << mib << ": a budget that is not used";
      const uint64_t grown = bytes("peak_rss_bytes") - bytes("baseline_rss_bytes");
      EXPECT_LE(grown, options_.budget_bytes + options_.budget_bytes / 20)
          << mib << " MiB, accounted " << bytes("peak_accounted_bytes");
      RecordProperty(fmt::format("grown_of_{}", options_.budget_bytes), fmt::format("{}", grown));
    }
  }

  test::TemporaryFolder folder_;
  RenderOptions options_;
};

TEST_F(ShotMemory, OfNineAssetsIsWithinTinyBudgets) { expect_within(scene_of(100, false), {0.75, 1, 1.5, 2, 3, 4}); }

TEST_F(ShotMemory, OfManyInstancesIsWithinTinyBudgets) { expect_within(scene_of(1500, false), {0.75, 1, 1.5, 2, 4}); }

TEST_F(ShotMemory, OfMovingInstancesIsWithinTinyBudgets) {
  options_.shutter = 0.5;
  expect_within(scene_of(1000, true), {1.25, 1.5, 2, 3, 4});
}

TEST_F(ShotMemory, OfMorphsIsWithinTinyBudgets) {
  options_.blend = Blend::Morph;
  expect_within(scene_of(100, false), {1, 1.5, 2, 4});
}

}  // namespace
}  // namespace farfield
