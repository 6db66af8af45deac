// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_settings.h"

#include <fmt/format.h>

#include <array>

namespace farfield {
namespace {

/// "8M" for 8388608: what parse_bytes() reads as exactly that.
std::string budget_text(uint64_t bytes) {
  constexpr std::array<const char*, 4> kUnits = {"", "K", "M", "G"};
  size_t unit = 0;
  while (unit + 1 < kUnits.size() && bytes > 0 && bytes % 1024 == 0) bytes /= 1024, ++unit;
  return fmt::format("{}{}", bytes, kUnits[unit]);
}

std::string flag_of(const TradeSetting& setting, Knob knob) {
  switch (knob) {
    case Knob::PixelError:
      return fmt::format("--pixel-error {}", setting.pixel_error);
    case Knob::Budget:
      return fmt::format("--budget {}", budget_text(setting.budget_bytes));
    case Knob::RaysPerVoxel:
      return fmt::format("--rays-per-voxel {}", setting.rays_per_voxel);
    case Knob::FinestGrid:
      return fmt::format("--finest-grid {}", setting.finest_grid);
    default:
      return "--full-detail";
  }
}

/// The flags of what is turned anywhere, else of the pixel error: what tells the base from the others.
std::string base_label(const TradeSetting& base, const TradeKnobs& knobs) {
  std::string label;
  const auto add = [&](Knob knob, size_t values) {
    if (values < 2) return;
    if (!label.empty()) label += ' ';
    label += flag_of(base, knob);
  };
  add(Knob::PixelError, knobs.pixel_error.size());
  add(Knob::Budget, knobs.budget_bytes.size());
  add(Knob::RaysPerVoxel, knobs.rays_per_voxel.size());
  add(Knob::FinestGrid, knobs.finest_grid.size());
  return label.empty() ? flag_of(base, Knob::PixelError) : label;
}

/// The base with one field at each of the further values.
template <typename T>
void add_turned(std::vector<TradeSetting>& settings, const TradeSetting& base, Knob knob, T TradeSetting::*field,
                const std::vector<T>& values) {
  for (size_t i = 1; i < values.size(); ++i) {
    TradeSetting setting = base;
    setting.knob = knob;
    setting.*field = values[i];
    setting.label = flag_of(setting, knob);
    settings.push_back(setting);
  }
}

}  // namespace

std::string name_of(Knob knob) {
  constexpr std::array<const char*, 6> kNames = {"full_detail", "base",           "pixel_error",
                                                 "budget",      "rays_per_voxel", "finest_grid"};
  return kNames[static_cast<size_t>(knob)];
}

std::string TradeSetting::folder() const {
  if (is_full_detail()) return "full_detail";
  return fmt::format("error_{}_budget_{}_rays_{}_grid_{}", pixel_error, budget_bytes, rays_per_voxel, finest_grid);
}

bool TradeSetting::is_baked_as(const TradeSetting& base) const {
  return is_full_detail() || (rays_per_voxel == base.rays_per_voxel && finest_grid == base.finest_grid);
}

void TradeSetting::apply(RenderOptions& options) const {
  options.full_detail = is_full_detail();
  options.pixel_error = pixel_error;
  options.budget_bytes = budget_bytes;
  options.rays_per_voxel = rays_per_voxel;
  options.finest_grid = finest_grid;
}

std::vector<TradeSetting> settings_of(const TradeKnobs& knobs, uint64_t memory_bytes) {
  TradeSetting base;
  base.pixel_error = knobs.pixel_error.front();
  base.budget_bytes = knobs.budget_bytes.front();
  base.rays_per_voxel = knobs.rays_per_voxel.front();
  base.finest_grid = knobs.finest_grid.front();
  base.label = base_label(base, knobs);

  TradeSetting full = base;
  full.knob = Knob::FullDetail;
  full.budget_bytes = memory_bytes;
  full.label = flag_of(full, full.knob);

  std::vector<TradeSetting> settings = {full, base};
  add_turned(settings, base, Knob::PixelError, &TradeSetting::pixel_error, knobs.pixel_error);
  add_turned(settings, base, Knob::Budget, &TradeSetting::budget_bytes, knobs.budget_bytes);
  add_turned(settings, base, Knob::RaysPerVoxel, &TradeSetting::rays_per_voxel, knobs.rays_per_voxel);
  add_turned(settings, base, Knob::FinestGrid, &TradeSetting::finest_grid, knobs.finest_grid);
  return settings;
}

}  // namespace farfield
