// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_settings.h"

#include <gtest/gtest.h>

#include <set>

namespace farfield {
namespace {

constexpr uint64_t kMemory = uint64_t{24} << 30;

TEST(TradeSettings, TurnOneKnobAtATimeFromTheFirstValuesOfAll) {
  TradeKnobs knobs;
  knobs.pixel_error = {1, 0.5f};
  knobs.budget_bytes = {uint64_t{2} << 30, 300 << 20, 1000};
  knobs.finest_grid = {256, 64};
  const std::vector<TradeSetting> settings = settings_of(knobs, kMemory);
  ASSERT_EQ(settings.size(), 6u);
  std::vector<std::string> labels;
  std::set<std::string> folders;
  for (const TradeSetting& setting : settings) labels.push_back(setting.label), folders.insert(setting.folder());
  EXPECT_EQ(labels,
            (std::vector<std::string>{"--full-detail", "--pixel-error 1 --budget 2G --finest-grid 256",
                                      "--pixel-error 0.5", "--budget 300M", "--budget 1000", "--finest-grid 64"}));
  EXPECT_EQ(folders.size(), settings.size());
  for (size_t i = 2; i < settings.size(); ++i) {
    const int turned = (settings[i].pixel_error != settings[1].pixel_error) +
                       (settings[i].budget_bytes != settings[1].budget_bytes) +
                       (settings[i].finest_grid != settings[1].finest_grid) +
                       (settings[i].rays_per_voxel != settings[1].rays_per_voxel);
    EXPECT_EQ(turned, 1) << settings[i].label;
    EXPECT_EQ(settings[i].is_baked_as(settings[1]), settings[i].knob != Knob::FinestGrid);
  }
}

TEST(TradeSettings, FullDetailHasTheMachinesMemoryAndTheBasesAssets) {
  const std::vector<TradeSetting> settings = settings_of(TradeKnobs(), kMemory);
  RenderOptions options;
  settings[0].apply(options);
  EXPECT_TRUE(options.full_detail);
  EXPECT_EQ(options.budget_bytes, kMemory);
  EXPECT_TRUE(settings[0].is_baked_as(settings[1]));
  settings[2].apply(options);
  EXPECT_FALSE(options.full_detail);
  EXPECT_EQ(options.pixel_error, 0.5f);
  EXPECT_EQ(options.budget_bytes, uint64_t{4} << 30);
}

TEST(TradeSettings, KeepTheirFoldersWhateverElseIsTried) {
  const auto folder = [](const TradeKnobs& knobs, size_t i) { return settings_of(knobs, kMemory)[i].folder(); };
  EXPECT_EQ(folder({.pixel_error = {1, 2}}, 2), folder({.pixel_error = {2, 1}}, 1));
}

}  // namespace
}  // namespace farfield
