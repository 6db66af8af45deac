// SPDX-License-Identifier: Apache-2.0
// `farfield trade`: what each knob costs and brings in a shot, against full detail (docs/trade.md).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "evaluate/trade_figures.h"
#include "evaluate/trade_settings.h"
#include "path_tracer/render_job.h"
#include "path_tracer/shot_job.h"

namespace farfield {

/// The scene's light, and the same with the sun, its sky and the directional lights turned half about +y: what is lit
/// from the front under one is lit from behind under the other.
enum class TradeLight : uint8_t { Own, Turned };
/// "own", "turned".
std::string_view name_of(TradeLight light);

struct TradeOptions {
  /// What all renders have in common; knobs, turn_sun and the seed of each part are set here. Its samples are those of
  /// one of kParts pictures of a frame. Warnings and progress go by it.
  RenderOptions render;
  TradeKnobs knobs;
  FrameRange frames;
  bool turn_sun = true;           ///< also under the turned light, unless render.environment is an image
  std::filesystem::path output;   ///< folder, created: renders/, and assets/ of what is baked otherwise
  std::filesystem::path program;  ///< that renders, called as PROGRAM shot ...; empty: this very program
};

/// One setting under one light.
struct TradeUnderLight {
  TradeLight light = TradeLight::Own;
  TradeErrors errors;  ///< against full detail; of full detail itself all 0
  TradeCost cost;
  std::vector<Bounded> changes;  ///< per pair of consecutive frames, see change_between()
  ShotPop pop;
  size_t worst_frame = 0;  ///< index of the frame whose error per pixel is (or may be) the largest
};

struct TradeRow {
  TradeSetting setting;
  std::vector<TradeUnderLight> lights;  ///< in the order of TradeLight
};

struct Trade {
  std::string scene;  ///< file name
  std::vector<int> frames;
  int width = 0, height = 0, samples_per_pixel = 0, threads = 0;
  float exposure_stops = 0;
  std::vector<TradeRow> rows;  ///< full detail, the base, the others
  std::vector<std::string> warnings;

  const TradeRow& full_detail() const { return rows[0]; }
  const TradeRow& base() const { return rows[1]; }
};

/// Renders the shot at every setting, under every light, kParts times from different seeds, each time in a process of
/// its own, in rounds over all settings; and measures. What an earlier run has rendered is kept as `farfield shot`
/// keeps it. Errors: Io, BadFile (a render failed: it has said why on
/// standard error), Cancelled: what is finished stays.
Result<Trade> measure_trade(const TradeOptions& options);

/// Where the render `part` of a setting lies.
std::filesystem::path trade_folder(const std::filesystem::path& output, const TradeSetting& setting, TradeLight light,
                                   size_t part);

/// The parts of a frame of a measured trade. Errors: those of read_exr.
Result<FrameParts> read_frame_parts(const std::filesystem::path& output, const TradeSetting& setting, TradeLight light,
                                    int frame);

}  // namespace farfield
