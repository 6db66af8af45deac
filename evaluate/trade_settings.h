// SPDX-License-Identifier: Apache-2.0
// What `farfield trade` tries: one knob turned at a time. Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "path_tracer/render_job.h"

namespace farfield {

/// Values of each knob, none twice. The first is where it stands while others are turned. At least one each.
struct TradeKnobs {
  std::vector<float> pixel_error{1.0f, 0.5f, 2.0f, 4.0f};
  std::vector<uint64_t> budget_bytes{uint64_t{4} << 30};
  std::vector<uint32_t> rays_per_voxel{200};  ///< of the bake
  std::vector<uint32_t> finest_grid{512};     ///< of the bake
};

/// What stands otherwise than in the base.
enum class Knob : uint8_t { FullDetail, Base, PixelError, Budget, RaysPerVoxel, FinestGrid };
/// "full_detail", "base", "pixel_error", "budget", "rays_per_voxel", "finest_grid".
std::string name_of(Knob knob);

struct TradeSetting {
  Knob knob = Knob::Base;
  std::string label;  ///< for people: the flags that give it, "--pixel-error 2"
  float pixel_error = 1;
  uint64_t budget_bytes = 0;
  uint32_t rays_per_voxel = 0, finest_grid = 0;

  bool is_full_detail() const { return knob == Knob::FullDetail; }
  /// A name for files that equal settings, and no others, share.
  std::string folder() const;
  /// Whether its assets are baked as the base's are.
  bool is_baked_as(const TradeSetting& base) const;
  /// Puts it into the options.
  void apply(RenderOptions& options) const;
};

/// Full detail, the base, then the others in the order of TradeKnobs. Full detail has `memory_bytes` for its budget.
std::vector<TradeSetting> settings_of(const TradeKnobs& knobs, uint64_t memory_bytes);

}  // namespace farfield
