// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/asset_library.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <thread>

#include "tests/support/files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

// A library with a shell script for a baker, which writes down how it was called, and says the words of `farfield
// bake`.
class AssetLibrary : public testing::Test {
 protected:
  AssetLibrary() {
    options_.scene = folder_.path() / "scenes" / "forest.glb.gz";
    options_.assets = folder_.path() / "baked";
    options_.baker = folder_.path() / "baker";
    for (const char* name : {"maple", "unused", "empty", "ground"}) {
      GltfMesh mesh;
      mesh.name = mesh.asset_name = name;
      mesh.triangle_count = mesh.name == "empty" ? 0 : 10;
      scene_.meshes.push_back(mesh);
    }
    for (const uint32_t mesh : {0u, 3u, 2u, 0u}) {
      scene_.instances.emplace_back();
      scene_.instances.back().mesh = mesh;
    }
    set_baker(kAllReady);
  }

  void set_baker(const std::string& last_line) {
    test::write_text(options_.baker, "#!/bin/sh\necho \"$@\" >> " + log().string() + "\n" + last_line + "\n");
    fs::permissions(options_.baker, fs::perms::owner_all);
  }
  fs::path log() const { return folder_.path() / "log"; }
  std::vector<std::string> calls() const {
    std::ifstream file(log());
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }

  static constexpr const char* kAllReady = "echo baking maple; echo ready maple; echo baking ground; echo ready ground";
  test::TemporaryFolder folder_;
  RenderOptions options_;
  GltfScene scene_;
};

TEST_F(AssetLibrary, OneProcessBakesEveryMeshThatIsShown) {
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_TRUE(folders) << folders.error().message;
  const fs::path library = folder_.path() / "baked" / "forest";
  EXPECT_EQ(*folders, (std::vector<fs::path>{library / "maple.farfield", "", "", library / "ground.farfield"}));
  ASSERT_EQ(calls().size(), 1u);
  const std::string call = calls()[0];
  EXPECT_EQ(call.find("bake " + options_.scene.string() + " --scene -o " + library.string()), 0u) << call;
  EXPECT_NE(call.find("--finest-grid 512"), std::string::npos);
  EXPECT_NE(call.find(fmt::format("--parent {} ", ::getpid())), std::string::npos);
  EXPECT_NE(call.find("--assemblies repeated"), std::string::npos);
  EXPECT_EQ(call.find("--source-only"), std::string::npos);
}

TEST_F(AssetLibrary, FullDetailHasFoldersOfItsOwn) {
  options_.full_detail = true;
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_TRUE(folders);
  EXPECT_EQ((*folders)[0].filename(), "maple.source.farfield");
  EXPECT_NE(calls()[0].find("--source-only"), std::string::npos);
}

TEST_F(AssetLibrary, LiesBesideTheSceneByDefault) {
  options_.assets.clear();
  EXPECT_EQ(asset_library_folder(options_), folder_.path() / "scenes" / "farfield-assets" / "forest");
}

TEST_F(AssetLibrary, FailedBakeNamesTheMeshAndHowItEnded) {
  set_baker("echo baking maple; exit 3");
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_FALSE(folders);
  EXPECT_NE(folders.error().message.find("mesh 0 \"maple\" failed (exit code 3)"), std::string::npos)
      << folders.error().message;
  set_baker("echo ready maple; echo baking ground; kill -9 $$");
  const std::string killed = find_or_bake_assets(scene_, options_).error().message;
  EXPECT_NE(killed.find("mesh 3 \"ground\" failed (signal 9)"), std::string::npos) << killed;
}

TEST_F(AssetLibrary, OneBrokenMeshIsAWarningAndTheOthersAreThere) {
  std::vector<std::string> warnings;
  options_.warning = [&](const std::string& line) { warnings.push_back(line); };
  set_baker("echo failed maple; echo ready ground; exit 1");
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_TRUE(folders) << folders.error().message;
  EXPECT_EQ((*folders)[0], "");
  EXPECT_EQ((*folders)[3].filename(), "ground.farfield");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("mesh 0 \"maple\""), std::string::npos) << warnings[0];
}

TEST_F(AssetLibrary, ASceneOfBrokenMeshesAloneIsAnError) {
  set_baker("echo failed maple; echo failed ground; exit 1");
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_FALSE(folders);
  EXPECT_EQ(folders.error().code, ErrorCode::Unsupported);
  EXPECT_NE(folders.error().message.find("maple"), std::string::npos);
}

TEST_F(AssetLibrary, ABakerThatSaysNothingHasBakedNothing) {
  set_baker("exit 0");
  EXPECT_EQ(find_or_bake_assets(scene_, options_).error().code, ErrorCode::Unsupported);
}

TEST_F(AssetLibrary, MissingBakerIsAnError) {
  options_.baker = folder_.path() / "nobody";
  EXPECT_EQ(find_or_bake_assets(scene_, options_).error().code, ErrorCode::Io);
}

TEST_F(AssetLibrary, UnwritableFolderIsAnError) {
  test::write_text(folder_.path() / "file", "x");
  options_.assets = folder_.path() / "file";
  const auto folders = find_or_bake_assets(scene_, options_);
  ASSERT_FALSE(folders);
  EXPECT_EQ(folders.error().code, ErrorCode::Io);
  EXPECT_NE(folders.error().message.find("--assets"), std::string::npos);
}

TEST_F(AssetLibrary, CancelStopsTheChild) {
  set_baker("exec sleep 1000");
  std::atomic<bool> cancel{false};
  options_.job.cancel = &cancel;
  std::thread interrupt([&] {
    while (calls().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    cancel = true;
  });
  const auto folders = find_or_bake_assets(scene_, options_);
  interrupt.join();
  ASSERT_FALSE(folders);
  EXPECT_EQ(folders.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace farfield
