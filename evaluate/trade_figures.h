// SPDX-License-Identifier: Apache-2.0
// What pictures and records of a shot say of one setting against full detail (docs/trade.md). Pure; any thread.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "evaluate/metrics.h"
#include "path_tracer/image.h"
#include "path_tracer/render_job.h"

namespace farfield {

/// kParts pictures of one frame, R, G, B, A, each from a seed of its own. Part i of two settings shares its seed.
using FrameParts = std::vector<Image>;

/// Sets to 0 what none of the pictures touches: the sky is right at any setting, and its light is no yardstick.
void hide_background(std::span<Image> source, std::span<Image> level);

/// a / b; 0 where b is: what took no time, or had no noise, is no yardstick.
inline double ratio_or_zero(double a, double b) { return b > 0 ? a / b : 0.0; }

/// How far a setting is from full detail, and how noisy both are.
struct NoisyErrors : ErrorMetrics {
  /// Of one picture at the samples that were rendered: the mean over touched pixels and R, G, B, over the square of
  /// full detail's mean there.
  double variance = 0, full_variance = 0;

  double variance_ratio() const { return ratio_or_zero(variance, full_variance); }
};

/// A shot at one setting against the same at full detail.
struct TradeErrors {
  NoisyErrors all;                  ///< over all frames
  std::vector<NoisyErrors> frames;  ///< each alone
};

/// Adds frame by frame.
class TradeErrorSums {
 public:
  /// Errors: those of sum_view.
  Result<void> add_frame(FrameParts full, FrameParts setting);
  TradeErrors errors() const;

 private:
  ViewSums sums_;
  std::vector<NoisyErrors> frames_;
};

/// sum |b - a| / sum a of two frames of one setting, noise taken out. Errors: those of sum_view.
Result<Bounded> change_between(FrameParts a, FrameParts b);

/// How much more one frame of a shot differs from the next than at full detail.
struct ShotPop {
  Bounded most;              ///< `value` may be below 0: full detail changes more
  std::array<int, 2> at{};   ///< the frames between which the most is, as far as that is known
  std::vector<Bounded> all;  ///< per pair of consecutive frames
};
/// Changes between consecutive frames of `frames`, one less than those. Fewer than two frames: nothing in `all`.
ShotPop pop_of(std::span<const Bounded> setting, std::span<const Bounded> full, std::span<const int> frames);

/// What a shot takes: per frame the median over its parts, then the sum over frames.
struct TradeCost {
  double cpu_seconds = 0, seconds = 0;
  double load_seconds = 0;  ///< summed over loads, some of them while rays fly: no less than what rays wait
  double rays = 0;
  uint64_t peak_accounted_bytes = 0;  ///< most of all parts
  uint64_t peak_rss_bytes = 0;        ///< the same, beyond what the process held before it opened the assets
  std::vector<double> frame_cpu_seconds;
};
/// parts: reports that have the frames, and maybe others.
TradeCost cost_of(std::span<const RenderReport> parts, std::span<const int> frames);

/// How much of full detail's time a setting needs to come as close to the truth as full detail comes with the samples
/// that were rendered. Infinite: no number of samples does, since the setting's own error is larger than that noise.
struct TimeRatio {
  std::optional<double> value;  ///< absent where the setting's error is unknown
  double low = 0, high = 0;
};
/// cpu_ratio: CPU time over full detail's at equal samples.
TimeRatio time_to_equal_error(double cpu_ratio, const NoisyErrors& errors);

}  // namespace farfield
