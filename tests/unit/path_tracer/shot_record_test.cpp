// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/shot_record.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace farfield {
namespace {

FrameReport frame_report(int frame) {
  FrameReport report;
  report.frame = frame;
  report.seconds = 1.5 + frame;
  report.cpu_seconds = 2.75;
  report.load_seconds = 0.25;
  report.accounted_bytes = uint64_t{5} << 32;
  report.rss_bytes = 1000;
  report.levels_loaded = 3;
  report.rays = uint64_t{1} << 40;
  report.bias = 0.125;
  report.asked_bytes = 4321;
  report.finest_level = {1, 4};
  report.levels = {{{1, 77, 2, 0.5, 4096, 3}, {5, 1, 0, 0.0, 128, 0}}, {}};
  report.levels_given_up = {0, 1.5f};
  return report;
}

ShotRecord sample_record() {
  ShotRecord record;
  record.fingerprint = "size 4x4 \"quoted\"";
  record.report.assets = {"maple", "ground"};
  record.report.budget_bytes = uint64_t{6} << 32;
  record.report.baseline_rss_bytes = 100;
  record.report.peak_rss_bytes = 180;
  record.report.peak_accounted_bytes = 70;
  record.report.warnings = {"maple: a texture is missing"};
  record.report.frames = {frame_report(0), frame_report(10)};
  record.exr_hashes = {{10, 0xfedcba9876543210u}};
  return record;
}

TEST(ShotRecord, HasTheKeysThatChecksRead) {
  const auto json = nlohmann::json::parse(to_json(sample_record()));
  EXPECT_EQ(json["budget_bytes"], uint64_t{6} << 32);
  EXPECT_EQ(json["baseline_rss_bytes"], 100);
  EXPECT_EQ(json["peak_rss_bytes"], 180);
  EXPECT_EQ(json["peak_accounted_bytes"], 70);
  EXPECT_EQ(json["warnings"][0], "maple: a texture is missing");
  ASSERT_EQ(json["frames"].size(), 2u);
  const auto& frame = json["frames"][1];
  EXPECT_EQ(frame["frame"], 10);
  EXPECT_EQ(frame["seconds"], 11.5);
  EXPECT_EQ(frame["cpu_seconds"], 2.75);
  EXPECT_EQ(frame["load_seconds"], 0.25);
  EXPECT_EQ(frame["accounted_bytes"], uint64_t{5} << 32);
  EXPECT_EQ(frame["bias"], 0.125);
  EXPECT_EQ(frame["asked_bytes"], 4321);
  EXPECT_EQ(frame["levels_given_up"]["ground"], 1.5);
  EXPECT_EQ(frame["finest_level"]["ground"], 4);
  ASSERT_EQ(frame["levels"]["maple"].size(), 2u);
  EXPECT_EQ(frame["levels"]["maple"][0]["hits"], 77);
  EXPECT_EQ(frame["levels"]["maple"][0]["served_coarser"], 3);
  EXPECT_TRUE(frame["levels"]["ground"].empty());
  EXPECT_EQ(frame["degraded"], frame["fallbacks"] > 0);
  EXPECT_EQ(frame["exr_hash"], "fedcba9876543210");
  EXPECT_FALSE(json["frames"][0].contains("exr_hash"));
}

TEST(ShotRecord, ComesBackAsItWasWritten) {
  const std::string text = to_json(sample_record());
  const auto record = shot_record_from_json(text);
  ASSERT_TRUE(record);
  EXPECT_EQ(to_json(*record), text);
  EXPECT_EQ(record->exr_hashes, sample_record().exr_hashes);
  EXPECT_EQ(record->fingerprint, sample_record().fingerprint);
}

TEST(ShotRecord, OtherTextIsNoRecord) {
  const std::string text = to_json(sample_record());
  for (size_t size = 0; size + 2 < text.size(); size += 7) EXPECT_FALSE(shot_record_from_json(text.substr(0, size)));
  EXPECT_FALSE(shot_record_from_json("[]"));
  EXPECT_FALSE(shot_record_from_json("{\"frames\": 3}"));
  EXPECT_FALSE(shot_record_from_json(std::string(10000, '[')));
}

TEST(JoinReports, SortsFramesAndKeepsTheLargerUseOfMemory) {
  RenderReport earlier = sample_record().report, later = sample_record().report;
  later.frames = {frame_report(5)};
  later.warnings = {"frame 5: coarse", earlier.warnings[0]};
  later.baseline_rss_bytes = 300;
  later.peak_rss_bytes = 330;
  later.peak_accounted_bytes = 90;
  const RenderReport joined = join_reports(earlier, later);
  EXPECT_EQ(joined.baseline_rss_bytes, 100u);
  EXPECT_EQ(joined.peak_rss_bytes, 180u);
  EXPECT_EQ(joined.peak_accounted_bytes, 90u);
  ASSERT_EQ(joined.frames.size(), 3u);
  EXPECT_EQ(joined.frames[1].frame, 5);
  EXPECT_EQ(joined.warnings, (std::vector<std::string>{earlier.warnings[0], "frame 5: coarse"}));
}

TEST(JoinReports, NothingJoinsWithSomethingToThatThing) {
  const RenderReport report = sample_record().report;
  EXPECT_EQ(to_json({"", join_reports({}, report)}), to_json({"", report}));
  EXPECT_EQ(to_json({"", join_reports(report, {})}), to_json({"", report}));
}

}  // namespace
}  // namespace farfield
