// SPDX-License-Identifier: Apache-2.0
// The rounds of renders, with a script in place of the program that renders.
#include "evaluate/trade.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "path_tracer/shot_record.h"
#include "tests/support/files.h"
#include "tests/support/pictures.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// The program writes down how it is called, and copies a shot that was made before: that of full detail, or another.
class MeasureTrade : public testing::Test {
 protected:
  MeasureTrade() {
    write_shot("full", 0.5f, 4.0);
    write_shot("levels", 0.55f, 2.0);
    options_.render.scene = "forest.glb";
    options_.render.width = 8, options_.render.height = 4;
    options_.knobs.pixel_error = {1, 2};
    options_.frames = {0, 10, 10};
    options_.output = folder_.path() / "out";
    options_.program = folder_.path() / "program";
    options_.render.warning = [this](const std::string& line) { warnings_.push_back(line); };
    set_program("");
  }

  void write_shot(const std::string& name, float value, double cpu_seconds) const {
    const fs::path shot = folder_.path() / name;
    fs::create_directories(shot);
    RenderReport report;
    report.peak_accounted_bytes = 1000;
    report.warnings = {"the same each time"};
    for (const int frame : {0, 10}) {
      FrameReport of_frame;
      of_frame.frame = frame;
      of_frame.cpu_seconds = cpu_seconds;
      report.frames.push_back(of_frame);
      ASSERT_TRUE(write_exr(frame_path(shot, frame), test::constant_picture(8, 4, {value, value, value, 1})));
    }
    test::write_text(shot / "shot.json", to_json({"", report}));
  }
  /// `before`: what it does before it copies.
  void set_program(const std::string& before) const {
    test::write_text(options_.program, fmt::format("#!/bin/sh\necho \"$@\" >> {0}/log\n{1}\nout=${{2#--output=}}\n"
                                                   "mkdir -p \"$out\"\ncase \"$*\" in *--full-detail*) from=full;; "
                                                   "*) from=levels;; esac\ncp {0}/$from/* \"$out\"\n"
                                                   "echo progress 0.5 half\n",
                                                   folder_.path().string(), before));
    fs::permissions(options_.program, fs::perms::owner_all);
  }
  std::vector<std::string> calls() const {
    std::ifstream file(folder_.path() / "log");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }

  test::TemporaryFolder folder_;
  TradeOptions options_;
  std::vector<std::string> warnings_;
};

bool has(const std::string& call, const std::string& flag) { return call.find(flag) != std::string::npos; }

TEST_F(MeasureTrade, RendersInRoundsOverAllSettingsAndLights) {
  const auto trade = measure_trade(options_);
  ASSERT_TRUE(trade) << trade.error().message;
  const auto all = calls();
  ASSERT_EQ(all.size(), 4u * 3u * 2u);
  const std::string seed = all[0].substr(all[0].find("--seed="), 12);
  for (size_t i = 0; i < all.size(); ++i) {
    SCOPED_TRACE(all[i]);
    EXPECT_EQ(all[i].rfind("shot --output=", 0), 0u);
    EXPECT_EQ(has(all[i], "--full-detail"), i % 6 < 2);
    EXPECT_EQ(has(all[i], "--pixel-error=2 "), i % 6 >= 4);
    EXPECT_EQ(has(all[i], "--turn-sun"), i % 2 == 1);
    EXPECT_EQ(has(all[i], seed), i < 6) << "each round has a seed of its own, which all settings share";
    for (const char* flag : {"--frames=0-10:10", "--size=8x4", "--spp=16", "--parent=", " -- forest.glb"})
      EXPECT_TRUE(has(all[i], flag)) << flag;
  }
}

TEST_F(MeasureTrade, HoldsEverySettingAgainstFullDetail) {
  const auto trade = measure_trade(options_);
  ASSERT_TRUE(trade) << trade.error().message;
  ASSERT_EQ(trade->rows.size(), 3u);
  EXPECT_EQ(trade->frames, (std::vector<int>{0, 10}));
  for (const TradeRow& row : trade->rows) {
    ASSERT_EQ(row.lights.size(), 2u);
    const bool is_full = row.setting.is_full_detail();
    for (const TradeUnderLight& figures : row.lights) {
      EXPECT_NEAR(figures.errors.all.color_bias[1].value, is_full ? 0.0 : 0.1, 1e-6);
      EXPECT_NEAR(figures.errors.all.color_rms[0].value.value(), is_full ? 0.0 : 0.1, 1e-6);
      EXPECT_EQ(figures.cost.cpu_seconds, is_full ? 8 : 4);
      ASSERT_EQ(figures.changes.size(), 1u);
      EXPECT_EQ(figures.pop.most.value.value(), 0.0);
    }
  }
  EXPECT_EQ(warnings_, std::vector<std::string>{"the same each time"});
  EXPECT_EQ(trade->warnings, warnings_);
}

TEST_F(MeasureTrade, BakesOtherGridsIntoItsOwnFolder) {
  options_.render.assets = "baked";
  options_.knobs = {.pixel_error = {1}, .finest_grid = {64, 32}};
  ASSERT_TRUE(measure_trade(options_));
  for (const std::string& call : calls())
    EXPECT_TRUE(has(
        call, has(call, "--finest-grid=32") ? "--assets=" + (options_.output / "assets").string() : "--assets=baked "))
        << call;
}

TEST_F(MeasureTrade, UnderAPictureHasOneLightAndSaysSo) {
  options_.render.environment = "sky.exr";
  const auto trade = measure_trade(options_);
  ASSERT_TRUE(trade);
  EXPECT_EQ(trade->rows[0].lights.size(), 1u);
  ASSERT_EQ(warnings_.size(), 2u);
  EXPECT_NE(warnings_[0].find("not turned"), std::string::npos);
}

TEST_F(MeasureTrade, FailsWithTheSettingThatFails) {
  set_program("case \"$*\" in *--pixel-error=2*) exit 1;; esac");
  const auto trade = measure_trade(options_);
  ASSERT_FALSE(trade);
  EXPECT_EQ(trade.error().code, ErrorCode::BadFile);
  EXPECT_EQ(trade.error().message.rfind("--pixel-error 2: ", 0), 0u) << trade.error().message;
  EXPECT_NE(trade.error().message.find("exit code 1"), std::string::npos) << trade.error().message;
}

TEST_F(MeasureTrade, HoldsTheBaseAloneAgainstFullDetail) {
  options_.knobs.pixel_error = {1};
  const auto trade = measure_trade(options_);
  ASSERT_TRUE(trade);
  EXPECT_EQ(trade->rows.size(), 2u);
}

TEST_F(MeasureTrade, StopsWhenCancelled) {
  std::atomic<bool> cancel{false};
  options_.render.job = {[&](double done, const std::string&) { cancel = done > 0.3; }, &cancel};
  const auto trade = measure_trade(options_);
  ASSERT_FALSE(trade);
  EXPECT_EQ(trade.error().code, ErrorCode::Cancelled);
  EXPECT_LT(calls().size(), 12u);
}

}  // namespace
}  // namespace farfield
