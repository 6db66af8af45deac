// SPDX-License-Identifier: Apache-2.0
#include "tools/source_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/console.h"

namespace farfield::tool {
namespace {

using Json = nlohmann::ordered_json;

const char* to_text(AlphaMode mode) {
  switch (mode) {
    case AlphaMode::Opaque:
      return "opaque";
    case AlphaMode::Mask:
      return "mask";
    case AlphaMode::Blend:
      return "blend";
  }
  return "unknown";
}

std::string color_text(const vec3& c) { return fmt::format("{:.3f} {:.3f} {:.3f}", c.x, c.y, c.z); }

std::string point_text(const dvec3& p) { return fmt::format("({:.8g}, {:.8g}, {:.8g})", p.x, p.y, p.z); }

std::string name_text(const MaterialSummary& material) {
  return material.name.empty() ? "(no name)" : one_line(material.name);
}

std::string map_text(const MapSummary& map) {
  return map.is_missing() ? map.use + " missing" : fmt::format("{}x{} {}", map.width, map.height, map.use);
}

std::string maps_text(const MaterialSummary& material) {
  std::string text;
  for (const MapSummary& map : material.maps) text += fmt::format("{}{}", text.empty() ? "" : ", ", map_text(map));
  return text.empty() ? "-" : text;
}

std::string material_table(const SourceSummary& summary) {
  std::vector<std::vector<std::string>> rows = {
      {"material", "area", "triangles", "albedo r g b", "opacity", "alpha", "emission r g b", "maps"}};
  for (const MaterialSummary& m : summary.materials)
    rows.push_back({name_text(m), fmt::format("{:.2f} %", 100 * m.area_share), fmt::format("{}", m.triangles),
                    color_text(m.albedo), fmt::format("{:.3f}", m.opacity), to_text(m.alpha_mode),
                    m.emission == vec3(0.0f) ? "-" : color_text(m.emission), maps_text(m)});
  return format_table(rows);
}

std::string suspicions_text(const SourceSummary& summary) {
  std::string text;
  for (const MaterialSummary& material : summary.materials)
    for (const std::string& suspicion : material.suspicions())
      text += fmt::format("looks wrong: {}: {}\n", name_text(material), suspicion);
  return text;
}

Json vector_json(const auto& v) { return {v.x, v.y, v.z}; }

Json map_json(const MapSummary& map) {
  if (map.is_missing()) return {{"use", map.use}, {"missing", true}};
  return {{"use", map.use}, {"missing", false}, {"width", map.width}, {"height", map.height}};
}

Json material_json(const MaterialSummary& material) {
  Json maps = Json::array();
  for (const MapSummary& map : material.maps) maps.push_back(map_json(map));
  return {{"name", material.name},
          {"area_share", material.area_share},
          {"triangles", material.triangles},
          {"albedo", vector_json(material.albedo)},
          {"transmission", vector_json(material.transmission)},
          {"emission", vector_json(material.emission)},
          {"opacity", material.opacity},
          {"alpha_mode", to_text(material.alpha_mode)},
          {"maps", maps},
          {"looks_wrong", material.suspicions()}};
}

}  // namespace

std::string source_table(const std::string& name, const SourceSummary& summary) {
  const dvec3 size = summary.upper - summary.lower;
  std::string text = fmt::format("{}: a source, not baked: {} polygons ({} triangles), {} vertices\n", name,
                                 summary.polygons, summary.triangles, summary.vertices);
  text += fmt::format("size {:.4g} x {:.4g} x {:.4g} scene units, from {} to {}\n", size.x, size.y, size.z,
                      point_text(summary.lower), point_text(summary.upper));
  if (summary.origin != dvec3(0.0))
    text += fmt::format("far from its origin: baked around {}\n", point_text(summary.origin));
  text += fmt::format("\n{}", material_table(summary));
  if (summary.unused_materials > 0) text += fmt::format("materials that no face has: {}\n", summary.unused_materials);
  text += suspicions_text(summary);
  for (const std::string& warning : summary.warnings) text += fmt::format("warning: {}\n", one_line(warning));
  return text;
}

std::string source_json(const std::string& name, const SourceSummary& summary) {
  Json materials = Json::array();
  for (const MaterialSummary& material : summary.materials) materials.push_back(material_json(material));
  const Json json = {{"source", name},
                     {"polygons", summary.polygons},
                     {"triangles", summary.triangles},
                     {"vertices", summary.vertices},
                     {"bounds", {{"lower", vector_json(summary.lower)}, {"upper", vector_json(summary.upper)}}},
                     {"origin", vector_json(summary.origin)},
                     {"area", summary.area},
                     {"materials", materials},
                     {"unused_materials", summary.unused_materials},
                     {"warnings", summary.warnings}};
  // Names come from files that may be hostile: invalid UTF-8 is replaced, not thrown about.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield::tool
