// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_json.h"

#include <cmath>

#include "evaluate/figures_json.h"
#include "evaluate/trade_advice.h"

namespace farfield {
namespace {

using Json = nlohmann::ordered_json;

/// "time_to_equal_error": null with "reaches_equal_error" false where no number of samples does, and with null there,
/// too, where that is unknown.
void put_time_to_equal_error(Json& json, const TimeRatio& time) {
  const bool is_known = time.value.has_value(), is_finite = is_known && std::isfinite(*time.value);
  json["time_to_equal_error"] = is_finite ? Json(*time.value) : Json();
  json["reaches_equal_error"] = is_known ? Json(is_finite) : Json();
  json["bounds"]["time_to_equal_error"] = {time.low, time.high};
}

void put_noise(Json& json, const NoisyErrors& errors) {
  json["variance"] = errors.variance;
  json["variance_ratio"] = errors.variance_ratio();
}

Json frames_json(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  Json frames = Json::array();
  for (size_t i = 0; i < figures.errors.frames.size(); ++i) {
    FiguresJson errors(Json{{"frame", trade.frames[i]}, {"cpu_seconds", figures.cost.frame_cpu_seconds[i]}});
    errors.put_color(figures.errors.frames[i]);
    Json frame = std::move(errors).finish();
    put_noise(frame, figures.errors.frames[i]);
    put_time_to_equal_error(frame, time_to_equal_error(trade, row, light, i));
    frames.push_back(std::move(frame));
  }
  return frames;
}

Json changes_json(const Trade& trade, const TradeUnderLight& figures) {
  Json changes = Json::array();
  for (size_t i = 0; i < figures.changes.size(); ++i) {
    FiguresJson change(Json{{"frames", {trade.frames[i], trade.frames[i + 1]}}});
    change.put("change", figures.changes[i]);
    change.put("pop", figures.pop.all[i]);
    changes.push_back(std::move(change).finish());
  }
  return changes;
}

Json light_json(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  const TradeCost& cost = figures.cost;
  FiguresJson errors(Json{{"light", name_of(figures.light)}});
  errors.put_color(figures.errors.all);
  if (!figures.pop.all.empty()) errors.put("pop", figures.pop.most);
  Json json = std::move(errors).finish();
  if (!figures.pop.all.empty()) json["pop_between"] = figures.pop.at;
  put_noise(json, figures.errors.all);
  json["cpu_seconds"] = cost.cpu_seconds;
  json["cpu_ratio"] = cpu_ratio(trade, row, light);
  json["noise_at_equal_time"] = noise_at_equal_time(trade, row, light);
  put_time_to_equal_error(json, time_to_equal_error(trade, row, light));
  json["seconds"] = cost.seconds;
  json["load_seconds"] = cost.load_seconds;
  json["rays"] = cost.rays;
  json["peak_accounted_bytes"] = cost.peak_accounted_bytes;
  json["peak_rss_bytes"] = cost.peak_rss_bytes;
  json["frames"] = frames_json(trade, row, light);
  json["changes"] = changes_json(trade, figures);
  return json;
}

Json row_json(const Trade& trade, size_t row) {
  const TradeSetting& setting = trade.rows[row].setting;
  Json lights = Json::array();
  for (size_t light = 0; light < trade.rows[row].lights.size(); ++light)
    lights.push_back(light_json(trade, row, light));
  return {{"knob", name_of(setting.knob)},
          {"label", setting.label},
          {"pixel_error", setting.pixel_error},
          {"budget_bytes", setting.budget_bytes},
          {"rays_per_voxel", setting.rays_per_voxel},
          {"finest_grid", setting.finest_grid},
          {"renders", "renders/" + setting.folder()},
          {"lights", std::move(lights)}};
}

Json advice_json(const Trade& trade) {
  Json all = Json::array();
  for (const TradeAdvice& advice : advise(trade))
    all.push_back({{"wish", advice.wish},
                   {"setting", advice.row ? Json(trade.rows[*advice.row].setting.label) : Json()},
                   {"text", advice.text}});
  return all;
}

}  // namespace

std::string to_json(const Trade& trade) {
  Json settings = Json::array();
  for (size_t row = 0; row < trade.rows.size(); ++row) settings.push_back(row_json(trade, row));
  const Json json = {{"scene", trade.scene},
                     {"frames", trade.frames},
                     {"width", trade.width},
                     {"height", trade.height},
                     {"samples_per_pixel", trade.samples_per_pixel},
                     {"parts", kParts},
                     {"threads", trade.threads},
                     {"advice", advice_json(trade)},
                     {"settings", std::move(settings)},
                     {"warnings", trade.warnings}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield
