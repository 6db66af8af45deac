// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/shot_job.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "path_tracer/film.h"
#include "path_tracer/image.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

TEST(ParseFrameRange, ReadsRangesStepsAndSingleFrames) {
  const auto range = parse_frame_range("0-120:10");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 0);
  EXPECT_EQ(range->last, 120);
  EXPECT_EQ(range->step, 10);
  EXPECT_EQ(range->count(), 13);
  EXPECT_EQ(parse_frame_range("3-5")->count(), 3);
  EXPECT_EQ(parse_frame_range("7")->count(), 1);
  EXPECT_EQ(parse_frame_range("0-9:4")->count(), 3);
}

TEST(ParseFrameRange, RefusesTheRest) {
  for (const char* text : {"", "-", "a", "5-", "-5", "5-3", "1-5:", "1-5:0", "1-5:-1", "1-5x", "1 - 5", "1-5:2:3",
                           "99999999999", "0-99999999", "0x1-5"}) {
    const auto range = parse_frame_range(text);
    ASSERT_FALSE(range) << text;
    EXPECT_EQ(range.error().code, ErrorCode::InvalidArgument);
  }
}

float value(const Image& image, int x, int y, const char* channel) {
  const int index = image.find_channel(channel);
  EXPECT_GE(index, 0) << channel;
  return index < 0 ? -1.0f : image.pixel(x, y)[index];
}

// A scene of two spheres that the camera flies away from, and a script for a baker that copies a prepared asset.
class Shot : public ::testing::Test {
 protected:
  Shot() {
    test::write_asset(folder_.path() / "prepared", test::white_sphere());
    test::write_text(
        folder_.path() / "baker",
        fmt::format("#!/bin/sh\nfor asset in ball.farfield ball.source.farfield; do\n"
                    "  rm -rf \"$5/$asset\" && cp -r {}/prepared \"$5/$asset\" || exit 1\ndone\necho ready ball\n",
                    folder_.path().string()));
    std::filesystem::permissions(folder_.path() / "baker", std::filesystem::perms::owner_all);

    // Buffer: three positions, two times, two translations.
    const std::vector<float> floats = {-1, -1, -1, 1, 1, 1, -1, 1, 0, 0, 1, 0, 0, 4, 0, 0, 200};
    test::write_bytes(folder_.path() / "scene.bin", std::as_bytes(std::span(floats)));
    write_scene("");
    options_.scene = folder_.path() / "scene.gltf";
    options_.assets = folder_.path() / "assets";
    options_.baker = folder_.path() / "baker";
    options_.width = 48;
    options_.height = 32;
    options_.trace.samples_per_pixel = 4;
    options_.budget_bytes = 4 << 20;
    options_.message = [this](const std::string& line) { messages_ += line + "\n"; };
  }

  /// parent: JSON members of a node that all others become children of; empty: none. The animation moves node 2, the
  /// camera, or node 0, a ball, along z from 4 to 200.
  void write_scene(const std::string& parent, int animated_node = 2) const {
    std::string text = R"({"asset": {"version": "2.0"},
"buffers": [{"uri": "scene.bin", "byteLength": 68}],
"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, -1], "max": [1, 1, 1]},
              {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
              {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
"meshes": [{"name": "ball", "primitives": [{"attributes": {"POSITION": 0}}]}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
"nodes": [{"mesh": 0}, {"mesh": 0, "translation": [-3, 0, -2]}, {"camera": 0, "name": "camera"},
          {PARENT}],
"animations": [{"samplers": [{"input": 1, "output": 2}],
                "channels": [{"sampler": 0, "target": {"node": ANIMATED, "path": "translation"}}]}],
"scenes": [{"nodes": [ROOTS]}], "scene": 0})";
    const auto fill = [&](const std::string& marker, const std::string& what) {
      text.replace(text.find(marker), marker.size(), what);
    };
    fill("PARENT", parent.empty() ? "" : R"("children": [0, 1, 2], )" + parent);
    fill("ANIMATED", fmt::format("{}", animated_node));
    fill("ROOTS", parent.empty() ? "0, 1, 2" : "3");
    test::write_text(folder_.path() / "scene.gltf", text);
  }

  Result<RenderReport> shoot(const FrameRange& frames) { return render_shot(options_, frames, out()); }
  std::filesystem::path out() const { return folder_.path() / "shot"; }
  nlohmann::json record() const {
    const std::vector<std::byte> bytes = test::read_bytes(out() / "shot.json");
    return nlohmann::json::parse(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  std::filesystem::file_time_type time_of(const char* name) const {
    return std::filesystem::last_write_time(out() / name);
  }

  test::TemporaryFolder folder_;
  RenderOptions options_;
  std::string messages_;
};

TEST_F(Shot, InMapCoordinatesIsTheSamePicture) {
  ASSERT_TRUE(shoot({6, 6, 1}));
  const auto near = read_exr(out() / "frame_0006.exr");
  write_scene(R"("translation": [500000.25, 0, 4500000.5])");
  ASSERT_TRUE(shoot({6, 6, 1}));
  const auto far = read_exr(out() / "frame_0006.exr");
  ASSERT_TRUE(near && far);
  double difference = 0, sum = 0;
  for (int y = 0; y < options_.height; ++y)
    for (int x = 0; x < options_.width; ++x) {
      difference += std::abs(value(far->image, x, y, "G") - value(near->image, x, y, "G"));
      sum += value(near->image, x, y, "G");
    }
  EXPECT_GT(sum, 0);
  // Rays end a few float steps apart; some of them on the other side of an edge.
  EXPECT_LT(difference, 0.01 * sum);
}

// What an open shutter sees is the mean of the instants meanwhile, whether the camera moves or what it looks at.
TEST_F(Shot, ShutterIsTheMeanOfInstants) {
  const auto green = [&](const char* name) {
    const auto picture = read_exr(out() / name);
    std::vector<double> values;
    for (int y = 0; picture && y < options_.height; ++y)
      for (int x = 0; x < options_.width; ++x) values.push_back(value(picture->image, x, y, "G"));
    return values;
  };
  options_.trace.samples_per_pixel = 64;
  options_.sky = false;
  options_.environment = folder_.path() / "white.exr";
  Image white(8, 4, {"R", "G", "B"});
  std::ranges::fill(white.values, 1.0f);
  ASSERT_TRUE(write_exr(options_.environment, white));
  options_.trace.transparent = true;  // the picture is the balls alone
  for (const int animated_node : {0, 2}) {
    const float z = animated_node == 0 ? -9.0f : 9.0f;  // the ball in front of the camera, or the camera behind it
    const std::vector<float> floats = {-1, -1, -1, 1, 1, 1, -1, 1, 0, 0, 1, -2, 0, z, 4, 0, z};
    test::write_bytes(folder_.path() / "scene.bin", std::as_bytes(std::span(floats)));
    write_scene("", animated_node);
    options_.frames_per_second = 24;
    options_.shutter = 8.0;
    ASSERT_TRUE(shoot({12, 12, 1}));
    const std::vector<double> blurred = green("frame_0012.exr");
    options_.frames_per_second = 48;
    options_.shutter = 0;
    std::vector<double> mean(blurred.size());
    ASSERT_TRUE(shoot({17, 31, 2}));  // the middles of eight parts of frames 8 to 16 of before
    for (int frame = 17; frame <= 31; frame += 2) {
      const std::vector<double> instant = green(fmt::format("frame_{:04}.exr", frame).c_str());
      for (size_t i = 0; i < mean.size(); ++i) mean[i] += instant[i] / 8;
    }
    double difference = 0, from_instant = 0, sum = 0;
    const std::vector<double> instant = green("frame_0023.exr");
    for (size_t i = 0; i < mean.size(); ++i) {
      difference += std::abs(blurred[i] - mean[i]);
      from_instant += std::abs(blurred[i] - instant[i]);
      sum += mean[i];
    }
    EXPECT_GT(sum, 10) << animated_node;
    EXPECT_LT(difference, 0.15 * sum) << animated_node;
    EXPECT_GT(from_instant, 0.3 * sum) << animated_node;
  }
}

TEST_F(Shot, WarningsAreSaidOnceAndInTheRecord) {
  int said = 0;
  options_.warning = [&](const std::string&) { ++said; };
  write_scene(R"("extensions": {"KHR_lights_punctual": {"light": 7}})");
  ASSERT_TRUE(shoot({0, 12, 12}));
  const nlohmann::json json = record();
  ASSERT_EQ(json["warnings"].size(), 1u) << json["warnings"];
  EXPECT_EQ(said, 1);
}

TEST_F(Shot, WritesFramesRecordAndSheet) {
  const auto report = shoot({0, 24, 12});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(messages_, "");
  for (const char* name : {"frame_0000.exr", "frame_0012.exr", "frame_0024.exr", "frame_0000.png", "frame_0012.png",
                           "frame_0024.png", "shot.json", "contact_sheet.png"})
    EXPECT_TRUE(std::filesystem::exists(out() / name)) << name;

  const nlohmann::json json = record();
  EXPECT_EQ(json["budget_bytes"], 4 << 20);
  EXPECT_EQ(json["assets"], nlohmann::json({"ball"}));
  ASSERT_EQ(json["frames"].size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(json["frames"][i]["frame"], 12 * i);
  EXPECT_LE(json["peak_accounted_bytes"], json["budget_bytes"]);
  EXPECT_GT(json["frames"][0]["levels_loaded"], 0);
  // From a distance of 4 to 200: fine levels at first, the root at the end.
  EXPECT_LE(json["frames"][0]["finest_level"]["ball"], 1);
  EXPECT_EQ(json["frames"][2]["finest_level"]["ball"], 5);

  const auto first = read_exr(out() / "frame_0000.exr"), last = read_exr(out() / "frame_0024.exr");
  ASSERT_TRUE(first && last);
  EXPECT_EQ(std::get<int>(last->metadata.at("farfield.frame")), 24);
  EXPECT_EQ(std::get<vec3>(last->metadata.at("camera.position")), vec3(0, 0, 200));
  EXPECT_EQ(first->image.channel_count(), 15u);
  const auto alpha = [](const Image& image) { return image.pixel(24, 16)[3]; };
  EXPECT_EQ(alpha(first->image), 1.0f);
  EXPECT_LT(alpha(last->image), 1.0f);
}

// AddressSanitizer's own memory would count.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(Shot, ResidentSetKeepsTheBudget) {
  test::write_asset(folder_.path() / "prepared", test::white_sphere(160));
  options_.budget_bytes = 8 << 20;  // level 0 alone takes 100000 triangles
  const auto report = shoot({0, 24, 3});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_GT(report->peak_accounted_bytes, options_.budget_bytes / 4);
  EXPECT_LE(report->peak_accounted_bytes, options_.budget_bytes);
  EXPECT_LE(report->peak_rss_bytes - report->baseline_rss_bytes, options_.budget_bytes * 105 / 100);
}
#endif

TEST_F(Shot, SecondRunKeepsFinishedFramesAndRendersTheRest) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const auto first_time = time_of("frame_0012.exr");
  const nlohmann::json first_record = record();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto report = shoot({0, 24, 12});
  ASSERT_TRUE(report);
  EXPECT_EQ(time_of("frame_0012.exr"), first_time);
  EXPECT_EQ(record()["frames"].size(), 3u);
  EXPECT_EQ(record()["frames"][1], first_record["frames"][1]);
  EXPECT_NE(messages_.find("2 of 3"), std::string::npos);
}

TEST_F(Shot, RemembersFramesOfOtherRanges) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const auto first_time = time_of("frame_0012.exr");
  const auto report = shoot({24, 36, 12});
  ASSERT_TRUE(report);
  EXPECT_EQ(messages_, "");
  EXPECT_EQ(report->frames.size(), 2u);
  const nlohmann::json both = record();
  EXPECT_EQ(both["frames"].size(), 4u);

  options_.message = [](const std::string& line) { EXPECT_EQ(line, "4 of 4 frames are finished already"); };
  ASSERT_TRUE(shoot({0, 36, 12}));
  EXPECT_EQ(time_of("frame_0012.exr"), first_time);
  EXPECT_EQ(record(), both);
}

TEST_F(Shot, OtherOptionsRenderEverythingAnew) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const auto first_time = time_of("frame_0012.exr");
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  options_.trace.seed = 5;
  ASSERT_TRUE(shoot({0, 12, 12}));
  EXPECT_NE(time_of("frame_0012.exr"), first_time);
}

TEST_F(Shot, LostFrameIsRenderedAgain) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const std::vector<std::byte> bytes = test::read_bytes(out() / "frame_0012.exr");
  std::filesystem::remove(out() / "frame_0012.exr");
  ASSERT_TRUE(shoot({0, 12, 12}));
  EXPECT_EQ(test::read_bytes(out() / "frame_0012.exr"), bytes);  // and it is the same
}

TEST_F(Shot, DamagedFrameIsRenderedAgain) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const std::vector<std::byte> bytes = test::read_bytes(out() / "frame_0012.exr");
  for (const size_t size : {size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
    test::write_bytes(out() / "frame_0012.exr", std::span(bytes).first(size));
    const auto report = shoot({0, 12, 12});
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->frames.size(), 2u);
    EXPECT_EQ(test::read_bytes(out() / "frame_0012.exr"), bytes);
  }
}

TEST_F(Shot, ALostPreviewIsMadeAgainAndTheFrameIsKept) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const std::vector<std::byte> preview = test::read_bytes(out() / "frame_0012.png");
  const auto time = time_of("frame_0012.exr");
  std::filesystem::remove(out() / "frame_0012.png");
  ASSERT_TRUE(shoot({0, 12, 12}));
  EXPECT_EQ(test::read_bytes(out() / "frame_0012.png"), preview);
  EXPECT_EQ(time_of("frame_0012.exr"), time);
}

TEST_F(Shot, AnotherFrameUnderAFramesNameIsNoticed) {
  ASSERT_TRUE(shoot({0, 12, 12}));
  const std::vector<std::byte> bytes = test::read_bytes(out() / "frame_0012.exr");
  std::filesystem::copy_file(out() / "frame_0000.exr", out() / "frame_0012.exr",
                             std::filesystem::copy_options::overwrite_existing);
  std::vector<std::string> warnings;
  options_.warning = [&](const std::string& line) { warnings.push_back(line); };
  ASSERT_TRUE(shoot({0, 12, 12}));
  EXPECT_EQ(test::read_bytes(out() / "frame_0012.exr"), bytes);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("frame_0012.exr: it is not what this shot has written; it is rendered again"),
            std::string::npos)
      << warnings[0];
}

TEST_F(Shot, LevelsThatAreLostAreSaidMarkedAndRenderedAgain) {
  options_.width = 480, options_.height = 320, options_.trace.samples_per_pixel = 1;
  ASSERT_TRUE(shoot({0, 2, 2}));  // bakes
  const std::vector<std::byte> sound = test::read_bytes(out() / "frame_0002.exr");
  std::filesystem::remove_all(out());
  std::filesystem::remove_all(options_.assets);

  // The next bake is damaged as soon as it is done: levels that frame 0 does not need, however early frame 2's load.
  const auto prepared = folder_.path() / "prepared", whole = folder_.path() / "whole";
  std::filesystem::copy(prepared, whole);
  for (const int k : {2, 3}) {
    const auto file = prepared / fmt::format("level_{}.ffl", k);
    test::write_bytes(file, std::vector<std::byte>(std::filesystem::file_size(file)));
  }
  std::vector<std::string> warnings;
  options_.warning = [&](const std::string& line) { warnings.push_back(line); };
  const auto report = shoot({0, 2, 2});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::BadFile);
  EXPECT_NE(report.error().message.find("1 of 2 frames show coarser levels than planned (frame 2)"), std::string::npos)
      << report.error().message;
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings[0].find("is left out, a coarser one serves"), std::string::npos) << warnings[0];
  EXPECT_EQ(record()["frames"][0]["degraded"], false);
  EXPECT_EQ(record()["frames"][1]["degraded"], true);
  EXPECT_NE(test::read_bytes(out() / "frame_0002.exr"), sound);

  std::filesystem::remove_all(prepared);
  std::filesystem::rename(whole, prepared);
  const auto first_time = time_of("frame_0000.exr");
  const auto mended = shoot({0, 2, 2});  // the bake mends the asset first
  ASSERT_TRUE(mended) << mended.error().message;
  EXPECT_EQ(time_of("frame_0000.exr"), first_time);
  EXPECT_EQ(record()["frames"][1]["degraded"], false);
  EXPECT_EQ(test::read_bytes(out() / "frame_0002.exr"), sound);
}

TEST_F(Shot, FrameDoesNotDependOnTheFramesBefore) {
  ASSERT_TRUE(shoot({0, 24, 6}));
  ASSERT_TRUE(render_frame(options_, 24, folder_.path() / "alone.exr"));
  EXPECT_EQ(test::read_bytes(folder_.path() / "alone.exr"), test::read_bytes(out() / "frame_0024.exr"));
}

TEST_F(Shot, FramesPerSecondSayWhatTimeAFrameShows) {
  const auto camera_of = [&](int frame) {
    EXPECT_TRUE(render_frame(options_, frame, folder_.path() / "frame.exr"));
    return std::get<vec3>(read_exr(folder_.path() / "frame.exr")->metadata.at("camera.position"));
  };
  EXPECT_EQ(camera_of(12), vec3(0, 0, 102));  // half a second at the default of 24
  options_.frames_per_second = 48;
  EXPECT_EQ(camera_of(24), vec3(0, 0, 102));
  options_.frames_per_second = 6;
  EXPECT_EQ(camera_of(3), vec3(0, 0, 102));
}

// The camera looks from z = 4 at a ball of radius 1 around the origin; another one stands to its left.
TEST_F(Shot, FramesSayWhatTheCameraSees) {
  options_.full_detail = true;
  options_.cryptomatte = true;
  ASSERT_TRUE(render_frame(options_, 0, folder_.path() / "frame.exr"));
  const auto file = read_exr(folder_.path() / "frame.exr");
  ASSERT_TRUE(file) << file.error().message;
  const Image& image = file->image;
  EXPECT_EQ(image.channel_count(), 15u + 2 * 2 * kCryptomatteRanks);
  const auto at = [&](int x, int y, const char* channel) { return value(image, x, y, channel); };

  EXPECT_NEAR(at(24, 16, "Z"), 3.0f, 0.02f);  // along the axis, not the ray
  EXPECT_NEAR(at(24, 16, "N.Z"), 1.0f, 0.02f);
  EXPECT_NEAR(at(24, 16, "albedo.G"), 1.0f, 0.01f);  // a white sphere
  EXPECT_GT(at(30, 16, "N.X"), 0.3f);
  EXPECT_GT(at(24, 10, "N.Y"), 0.3f);  // y of the image runs down, that of the world up
  EXPECT_EQ(at(47, 0, "Z"), kNoDepth);
  EXPECT_EQ(at(47, 0, "albedo.R"), 0.0f);
  EXPECT_EQ(at(47, 0, "N.Z"), 0.0f);

  const auto id = [](const char* name) { return std::bit_cast<float>(cryptomatte_id(name)); };
  EXPECT_EQ(at(24, 16, "CryptoObject00.R"), id("node 0"));
  EXPECT_EQ(at(24, 16, "CryptoObject00.G"), 1.0f);
  EXPECT_EQ(at(24, 16, "CryptoObject00.B"), 0.0f);
  EXPECT_EQ(at(47, 0, "CryptoObject00.G"), 0.0f);
  EXPECT_EQ(at(24, 16, "CryptoMaterial00.R"), id("material 0"));
  EXPECT_EQ(at(24, 16, "CryptoMaterial00.G"), 1.0f);
  bool sees_second = false;
  for (int x = 0; x < 24; ++x) sees_second |= at(x, 16, "CryptoObject00.R") == id("node 1");
  EXPECT_TRUE(sees_second);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 48; ++x)  // nothing is transparent: all that covers a pixel has a name
      EXPECT_NEAR(at(x, y, "A"), at(x, y, "CryptoObject00.G") + at(x, y, "CryptoObject00.A"), 1e-6f);

  const Metadata expected = cryptomatte_metadata("CryptoObject", {"node 0", "node 1"});
  for (const auto& [key, text] : expected) EXPECT_EQ(file->metadata.at(key), text) << key;
  for (const auto& [key, text] : cryptomatte_metadata("CryptoMaterial", {"(prefiltered)", "material 0"}))
    EXPECT_EQ(file->metadata.at(key), text) << key;

  options_.full_detail = false;
  options_.pixel_error = 1e6f;
  ASSERT_TRUE(render_frame(options_, 0, folder_.path() / "coarse.exr"));
  const auto coarse = read_exr(folder_.path() / "coarse.exr");
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_EQ(value(coarse->image, 24, 16, "CryptoMaterial00.R"), id("(prefiltered)"));
  EXPECT_EQ(value(coarse->image, 24, 16, "CryptoObject00.R"), id("node 0"));
}

TEST_F(Shot, WithoutSkyItIsDark) {
  options_.sky = false;
  std::vector<std::string> warnings;
  options_.warning = [&](const std::string& line) { warnings.push_back(line); };
  ASSERT_TRUE(render_frame(options_, 0, folder_.path() / "dark.exr"));
  ASSERT_EQ(warnings.size(), 1u);
  const auto file = read_exr(folder_.path() / "dark.exr");
  for (int x = 0; x < 48; ++x)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(file->image.pixel(x, 16)[c], 0.0f);
}

TEST_F(Shot, CancelKeepsFinishedFramesAndTheRecord) {
  std::atomic<bool> cancel{false};
  options_.job.cancel = &cancel;
  options_.job.progress = [&](double, const std::string& what) { cancel = cancel || what.find("frame 12") == 0; };
  const auto report = shoot({0, 24, 12});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::Cancelled);
  EXPECT_TRUE(std::filesystem::exists(out() / "frame_0000.exr"));
  EXPECT_FALSE(std::filesystem::exists(out() / "frame_0012.exr"));
  EXPECT_EQ(record()["frames"].size(), 1u);
  for (const auto& entry : std::filesystem::directory_iterator(out()))
    EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();  // no temporary files
}

TEST_F(Shot, BudgetBelowTheRootsNamesWhatIsNeeded) {
  options_.budget_bytes = 1000;
  const auto report = shoot({0, 0, 1});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::OutOfBudget);
  const std::string& message = report.error().message;
  const size_t bracket = message.rfind('(');
  ASSERT_NE(bracket, std::string::npos) << message;
  options_.budget_bytes = std::stoull(message.substr(bracket + 1));
  EXPECT_TRUE(shoot({0, 0, 1}));
  --options_.budget_bytes;
  EXPECT_FALSE(shoot({0, 0, 1}));
}

TEST_F(Shot, MovingInstancesMakeTheSameFramesAsScenesOpenedForEach) {
  write_scene("", 0);
  const auto frame_alone = [&](int frame) {
    EXPECT_TRUE(render_frame(options_, frame, folder_.path() / "alone.exr"));
    return test::read_bytes(folder_.path() / "alone.exr");
  };
  ASSERT_TRUE(shoot({0, 2, 1}));
  EXPECT_NE(test::read_bytes(out() / "frame_0001.exr"), test::read_bytes(out() / "frame_0000.exr"));
  for (const int frame : {0, 1, 2})
    EXPECT_EQ(frame_alone(frame), test::read_bytes(out() / fmt::format("frame_{:04}.exr", frame)));
}

TEST_F(Shot, FullDetailShowsLevelZeroOnly) {
  options_.full_detail = true;
  options_.budget_bytes = 64 << 20;
  ASSERT_TRUE(render_frame(options_, 24, folder_.path() / "full.exr"));
  const auto file = read_exr(folder_.path() / "full.exr");
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 48; ++x) EXPECT_EQ(value(file->image, x, y, "lod.level"), 0.0f);
}

TEST_F(Shot, BadArgumentsAreErrors) {
  options_.width = 0;
  EXPECT_EQ(shoot({0, 0, 1}).error().code, ErrorCode::InvalidArgument);
  options_.width = 48;
  options_.scene = folder_.path() / "none.glb";
  EXPECT_EQ(shoot({0, 0, 1}).error().code, ErrorCode::NotFound);
  EXPECT_EQ(render_shot(options_, {0, 0, 1}, folder_.path() / "baker" / "x").error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace farfield
