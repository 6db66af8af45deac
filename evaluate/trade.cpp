// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <map>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/trade_shots.h"
#include "path_tracer/child_process.h"
#include "path_tracer/image.h"
#include "path_tracer/warning_log.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// Full detail may take what there is; beyond that its plan says what it needs, where a swapping machine would say
/// nothing for hours.
uint64_t physical_memory_bytes() {
  return static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

/// The largest error per pixel that the frame may have.
size_t find_worst_frame(const std::vector<NoisyErrors>& frames) {
  const auto size = [](const ErrorMetrics& errors) {
    return errors.color_rms[0].value.value_or(errors.color_rms[0].high);
  };
  return static_cast<size_t>(std::ranges::max_element(frames, {}, size) - frames.begin());
}

class Trader {
 public:
  explicit Trader(const TradeOptions& options)
      : options_(options),
        program_(options.program.empty() ? this_program() : options.program.string()),
        settings_(settings_of(options.knobs, physical_memory_bytes())),
        warnings_(options.render.warning) {
    if (!options.turn_sun) return;
    if (options.render.environment.empty())
      lights_.push_back(TradeLight::Turned);
    else
      warnings_.add("the light of a picture is not turned: errors are those of one light");
  }

  Result<Trade> run() {
    FARFIELD_TRY(render_all());
    return measure_all();
  }

 private:
  // ---- renders ----

  /// In rounds, so that what else the machine does meets all settings alike.
  Result<void> render_all() {
    const size_t count = kParts * settings_.size() * lights_.size();
    size_t done = 0;
    for (size_t part = 0; part < kParts; ++part)
      for (const TradeSetting& setting : settings_)
        for (const TradeLight light : lights_) {
          const auto share = [&](size_t shots) { return static_cast<double>(shots) / static_cast<double>(count); };
          const auto progress = [&, done](double of_shot, const std::string& stage) {
            options_.render.job.report(share(done) + of_shot * share(1),
                                       fmt::format("{}, round {}/{}: {}", setting.label, part + 1, kParts, stage));
          };
          progress(0, "starting");
          FARFIELD_TRY(render(setting, light, part, {progress, options_.render.job.cancel}));
          ++done;
        }
    return {};
  }

  Result<void> render(const TradeSetting& setting, TradeLight light, size_t part, const Job& job) {
    RenderOptions options = options_.render;
    setting.apply(options);
    options.turn_sun = light == TradeLight::Turned;
    options.trace.seed = mix64(options_.render.trace.seed, part);
    if (!setting.is_baked_as(settings_[1]))
      options.assets =
          options_.output / "assets" / fmt::format("rays_{}_grid_{}", setting.rays_per_voxel, setting.finest_grid);
    auto report =
        run_shot(program_, options, options_.frames, trade_folder(options_.output, setting, light, part), job);
    if (!report && report.error().code != ErrorCode::Cancelled)
      return make_error(report.error().code, fmt::format("{}: {}", setting.label, report.error().message));
    if (!report) return tl::unexpected(report.error());
    for (const std::string& warning : report->warnings) warnings_.add(warning);
    reports_[{setting.folder(), light}].push_back(std::move(*report));
    return {};
  }

  // ---- figures ----

  Result<Trade> measure_all() {
    Trade trade;
    trade.scene = options_.render.scene.filename().string();
    trade.frames = options_.frames.numbers();
    trade.width = options_.render.width, trade.height = options_.render.height;
    trade.samples_per_pixel = options_.render.trace.samples_per_pixel;
    trade.threads = thread_count();
    trade.exposure_stops = options_.render.exposure_stops;
    for (const TradeSetting& setting : settings_) {
      options_.render.job.report(1, "measuring " + setting.label);
      TradeRow row{setting, {}};
      for (size_t light = 0; light < lights_.size(); ++light) {
        if (options_.render.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
        FARFIELD_TRY_LET(auto figures, measure(setting, lights_[light], trade.frames));
        const auto& full = trade.rows.empty() ? figures.changes : trade.full_detail().lights[light].changes;
        figures.pop = pop_of(figures.changes, full, trade.frames);
        row.lights.push_back(std::move(figures));
      }
      trade.rows.push_back(std::move(row));
    }
    trade.warnings = warnings_.lines();
    return trade;
  }

  Result<TradeUnderLight> measure(const TradeSetting& setting, TradeLight light, const std::vector<int>& frames) {
    TradeUnderLight figures;
    figures.light = light;
    figures.cost = cost_of(reports_.at({setting.folder(), light}), frames);
    TradeErrorSums sums;
    FrameParts before;
    for (const int frame : frames) {
      FARFIELD_TRY_LET(auto full, read_frame_parts(options_.output, settings_[0], light, frame));
      FARFIELD_TRY_LET(auto parts, read_frame_parts(options_.output, setting, light, frame));
      FARFIELD_TRY(sums.add_frame(std::move(full), parts));
      if (!before.empty()) {
        FARFIELD_TRY_LET(const auto change, change_between(std::move(before), parts));
        figures.changes.push_back(change);
      }
      before = std::move(parts);
    }
    figures.errors = sums.errors();
    figures.worst_frame = find_worst_frame(figures.errors.frames);
    return figures;
  }

  const TradeOptions& options_;
  const std::string program_;
  const std::vector<TradeSetting> settings_;
  std::vector<TradeLight> lights_{TradeLight::Own};
  std::map<std::pair<std::string, TradeLight>, std::vector<RenderReport>> reports_;  // per part
  WarningLog warnings_;
};

}  // namespace

std::string_view name_of(TradeLight light) { return light == TradeLight::Own ? "own" : "turned"; }

Result<Trade> measure_trade(const TradeOptions& options) { return Trader(options).run(); }

fs::path trade_folder(const fs::path& output, const TradeSetting& setting, TradeLight light, size_t part) {
  return output / "renders" / setting.folder() / fmt::format("{}_{}", name_of(light), part);
}

Result<FrameParts> read_frame_parts(const fs::path& output, const TradeSetting& setting, TradeLight light, int frame) {
  FrameParts parts;
  for (size_t part = 0; part < kParts; ++part) {
    FARFIELD_TRY_LET(const auto file, read_exr(frame_path(trade_folder(output, setting, light, part), frame)));
    parts.push_back(select_channels(file.image, {"R", "G", "B", "A"}));
  }
  return parts;
}

}  // namespace farfield
