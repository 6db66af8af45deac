// SPDX-License-Identifier: Apache-2.0
#include "tools/why_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/bytes.h"
#include "tools/console.h"

namespace farfield::tool {

namespace {

using Json = nlohmann::ordered_json;

std::string place(const vec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

std::string hit_table(const PixelReport& report) {
  std::vector<std::vector<std::string>> rows = {{"rays", "asset", "object", "level", "hit", "distance"}};
  for (const PixelHit& hit : report.hits) {
    const std::string share = fmt::format("{:.1f} %", 100.0 * hit.rays / report.rays);
    if (hit.asset.empty()) {
      rows.push_back({share, "nothing", "", "", "", ""});
    } else {
      rows.push_back({share, one_line(hit.asset), one_line(hit.object), fmt::format("{}", hit.level),
                      hit.is_volume ? "volume" : "surface", fmt::format("{:.6g}", hit.distance)});
    }
  }
  return format_table(rows);
}

std::string level_list(const PixelVisit& visit) {
  std::string text;
  for (const PixelLevel& level : visit.levels) {
    text += fmt::format("{}{} (from {:.3g}, {}{})", text.empty() ? "" : ", ", level.level, level.footprint,
                        format_bytes(level.bytes),
                        level.is_broken    ? ", broken"
                        : level.is_loaded  ? ", loaded"
                        : level.is_planned ? ""
                                           : ", not in the plan");
  }
  return text;
}

std::string seen_level(const RayVisit& visit) {
  if (visit.keeps_level) return fmt::format("level {}, which it leaves", visit.level);
  if (visit.is_morph)
    return fmt::format("{:.0f} % of the way from level {} to {}", 100 * visit.blend, visit.level, visit.next_level);
  if (visit.next_level == visit.level && visit.blend > 0)
    return fmt::format("level {}; {:.0f} % of paths do", visit.level, 100 * visit.blend);
  if (visit.blend > 0)
    return fmt::format("level {}; {:.0f} % of paths see level {}", visit.level, 100 * visit.blend, visit.next_level);
  return fmt::format("level {}", visit.level);
}

std::string visit_text(const PixelVisit& of_visit, const PixelReport& report) {
  const RayVisit& visit = of_visit.visit;
  std::string text =
      fmt::format("{}, {}, from distance {:.6g}\n", one_line(of_visit.asset), one_line(of_visit.object), visit.t_entry);
  text += fmt::format(
      "  a pixel is {:.3g} wide where the camera is nearest, {:.3g} where the ray comes in: lambda {:.2f}\n",
      visit.camera_footprint, visit.ray_footprint, visit.asked_lambda);
  text += fmt::format("  levels, and how wide the pixels are that they serve: {}\n", level_list(of_visit));
  text += fmt::format("  seen: {}\n", seen_level(visit));
  for (const std::string& reason : reasons(of_visit, report)) text += fmt::format("  {}\n", reason);
  return text;
}

Json to_json(const PixelVisit& of_visit, const PixelReport& report) {
  const RayVisit& visit = of_visit.visit;
  Json levels = Json::array();
  for (const PixelLevel& level : of_visit.levels) {
    levels.push_back({{"level", level.level},
                      {"footprint", level.footprint},
                      {"bytes", level.bytes},
                      {"loaded", level.is_loaded},
                      {"planned", level.is_planned},
                      {"broken", level.is_broken}});
  }
  return {{"asset", of_visit.asset},
          {"object", of_visit.object},
          {"instance", visit.instance.value},
          {"distance", visit.t_entry},
          {"camera_footprint", visit.camera_footprint},
          {"ray_footprint", visit.ray_footprint},
          {"asked_lambda", visit.asked_lambda},
          {"lambda", visit.lambda},
          {"level", visit.level},
          {"next_level", visit.next_level},
          {"blend", visit.blend},
          {"morph", visit.is_morph},
          {"planned_finest", visit.planned_finest},
          {"levels_given_up", of_visit.levels_given_up},
          {"levels", levels},
          {"reasons", reasons(of_visit, report)}};
}

}  // namespace

std::string pixel_text(const PixelReport& report) {
  std::string text = fmt::format("frame {}, pixel {},{} of {}x{}: a ray from {} along {}\n", report.frame, report.x,
                                 report.y, report.width, report.height, place(report.origin), place(report.direction));
  text += fmt::format("budget {}, planned {}; {} would give nothing up\n\n", format_bytes(report.budget_bytes),
                      format_bytes(report.planned_bytes), format_bytes(report.asked_bytes));
  text += fmt::format("What {} rays through the pixel hit:\n{}\n", report.rays, hit_table(report));
  if (report.visits.empty()) return text + "Its middle meets no instance's bounds.\n";
  text += "Whose bounds its middle meets, the nearest first:\n";
  for (const PixelVisit& visit : report.visits) text += visit_text(visit, report);
  return text;
}

std::string pixel_json(const PixelReport& report) {
  Json hits = Json::array(), visits = Json::array();
  for (const PixelHit& hit : report.hits) {
    if (hit.asset.empty()) {
      hits.push_back({{"asset", nullptr}, {"rays", hit.rays}});
    } else {
      hits.push_back({{"asset", hit.asset},
                      {"object", hit.object},
                      {"level", hit.level},
                      {"volume", hit.is_volume},
                      {"distance", hit.distance},
                      {"rays", hit.rays}});
    }
  }
  for (const PixelVisit& visit : report.visits) visits.push_back(to_json(visit, report));
  const auto array = [](const vec3& v) { return Json::array({v.x, v.y, v.z}); };
  const Json json = {{"frame", report.frame},
                     {"pixel", {report.x, report.y}},
                     {"size", {report.width, report.height}},
                     {"origin", array(report.origin)},
                     {"direction", array(report.direction)},
                     {"cone_width", report.cone_width},
                     {"cone_spread", report.cone_spread},
                     {"budget_bytes", report.budget_bytes},
                     {"planned_bytes", report.planned_bytes},
                     {"asked_bytes", report.asked_bytes},
                     {"rays", report.rays},
                     {"hits", hits},
                     {"visits", visits}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield::tool
