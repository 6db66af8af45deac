// SPDX-License-Identifier: Apache-2.0
#include "evaluate/evaluation_json.h"

#include <nlohmann/json.hpp>

#include "evaluate/figures_json.h"

namespace farfield {
namespace {

using Json = nlohmann::ordered_json;

Json vector_json(const vec3& v) { return {v.x, v.y, v.z}; }

Json color_noise_json(const ErrorMetrics& e) {
  return {{"color_error_raw", e.color_error_raw},
          {"color_error_low", e.color_error_low},
          {"color_noise", e.color_noise},
          {"occlusion_rms_raw", e.occlusion_rms_raw}};
}

Json view_json(const std::vector<vec3>& directions, size_t view) {
  Json json = {{"view", view}};
  if (view < directions.size()) json["direction"] = vector_json(directions[view]);
  return json;
}

/// The views of one light: the main figures of each.
Json views_json(const std::vector<ErrorMetrics>& views, const std::vector<vec3>& directions) {
  Json json = Json::array();
  for (size_t i = 0; i < views.size(); ++i) {
    FiguresJson figures(view_json(directions, i));
    figures.put("occlusion_error", views[i].occlusion_error);
    figures.put("color_bias", views[i].color_bias);
    figures.put("color_error", views[i].color_error);
    figures.put("color_rms", views[i].color_rms[0]);
    json.push_back(std::move(figures).finish());
  }
  return json;
}

Json worst_color_json(const LightEvaluation& light, const std::vector<vec3>& directions) {
  if (light.worst_view >= light.views.size()) return {};
  FiguresJson figures(view_json(directions, light.worst_view));
  figures.put("color_bias", light.views[light.worst_view].color_bias);
  return std::move(figures).finish();
}

Json worst_coverage_json(const LevelEvaluation& level, const std::vector<vec3>& directions) {
  if (level.worst_view >= level.views.size()) return {};
  FiguresJson figures(view_json(directions, level.worst_view));
  figures.put("occlusion_error", level.views[level.worst_view].occlusion_error);
  return std::move(figures).finish();
}

Json light_json(const LightEvaluation& light, const std::vector<vec3>& directions) {
  FiguresJson figures(Json{{"light", name_of(light.light)}});
  figures.put_occlusion(light.errors);
  figures.put_color(light.errors);
  Json json = std::move(figures).finish();
  json.update(color_noise_json(light.errors));
  json["worst_view"] = worst_color_json(light, directions);
  json["views"] = views_json(light.views, directions);
  return json;
}

Json depth_json(const DepthAgreement& depth) {
  FiguresJson figures(Json::object());
  figures.put("camera", depth.camera);
  figures.put("inside", depth.inside);
  figures.put("inside_hits", depth.inside_hits);
  return std::move(figures).finish();
}

Json level_json(const LevelEvaluation& level, const std::vector<vec3>& directions) {
  FiguresJson figures(Json{{"level", level.entry.level},
                           {"grid", level.entry.grid},
                           {"resolution", level.entry.resolution},
                           {"triangles", level.entry.triangles},
                           {"voxels", level.entry.voxels},
                           {"bytes_disk", level.entry.file_bytes},
                           {"bytes_resident", level.entry.resident_bytes}});
  figures.put_occlusion(level.errors);
  if (level.has_daylight()) figures.put_color(level.errors);
  Json json = std::move(figures).finish();
  if (level.has_daylight()) json.update(color_noise_json(level.errors));
  json["worst_view"] = worst_coverage_json(level, directions);
  Json lights = Json::array();
  for (const LightEvaluation& light : level.lights) lights.push_back(light_json(light, directions));
  json["lights"] = std::move(lights);
  json["depth"] = depth_json(level.depth);
  json["samples_per_pixel"] = level.samples_per_pixel;
  json["pixels"] = level.pixels;
  json["seconds"] = level.seconds;
  return json;
}

}  // namespace

std::string to_json(const Evaluation& evaluation) {
  Json levels = Json::array();
  for (const LevelEvaluation& level : evaluation.levels) levels.push_back(level_json(level, evaluation.directions));
  const Json json = {{"views", evaluation.views}, {"warnings", evaluation.warnings}, {"levels", levels}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield
