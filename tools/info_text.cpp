// SPDX-License-Identifier: Apache-2.0
#include "tools/info_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/bytes.h"
#include "base/hash.h"
#include "evaluate/figure_text.h"
#include "tools/console.h"

namespace farfield::tool {
namespace {

using Json = nlohmann::ordered_json;

std::string percent(double fraction, const char* format) { return fmt::format(fmt::runtime(format), 100.0 * fraction); }

std::vector<std::string> level_row(const Manifest& manifest, const LevelEntry& level) {
  std::vector<std::string> row = {
      fmt::format("{}", level.level),  fmt::format("{:.4g}", level.resolution),
      fmt::format("{}^3", level.grid), fmt::format("{}", level.triangles),
      fmt::format("{}", level.voxels), level.voxels > 0 ? percent(sparsity(manifest, level), "{:.2f} %") : "-",
      format_bytes(level.file_bytes),  format_bytes(level.resident_bytes)};
  if (level.errors) {
    row.push_back(percent(level.errors->occlusion_error, "{:+.2f} %"));
    row.push_back(size_text(level.errors->occlusion_rms));
    row.push_back(size_text(level.errors->color_error));
  } else {
    row.insert(row.end(), 3, "-");
  }
  return row;
}

Json vector_json(const auto& v) { return {v.x, v.y, v.z}; }

/// null where noise hides it; the bounds as `farfield evaluate --json` has them.
void put_size(Json& json, const std::string& name, const ErrorSize& size) {
  json[name] = size.value ? Json(*size.value) : Json();
  if (!size.value) json["bounds"][name] = {size.low, size.high};
}

Json level_json(const Manifest& manifest, const LevelEntry& level) {
  Json json = {{"level", level.level},
               {"resolution", level.resolution},
               {"grid", level.grid},
               {"triangles", level.triangles},
               {"voxels", level.voxels},
               {"bricks", level.bricks},
               {"sparsity", sparsity(manifest, level)},
               {"bytes_disk", level.file_bytes},
               {"bytes_resident", level.resident_bytes},
               {"bytes_build_peak", level.build_peak_bytes},
               {"file", level.file},
               {"file_hash", to_hex(level.file_hash)}};
  if (level.placements > 0) json["placements"] = level.placements;
  if (level.ray_cost > 0) json["ray_cost"] = level.ray_cost;
  if (level.errors) {
    json["occlusion_error"] = level.errors->occlusion_error;
    put_size(json, "occlusion_rms", level.errors->occlusion_rms);
    put_size(json, "color_error", level.errors->color_error);
  }
  return json;
}

}  // namespace

double sparsity(const Manifest& manifest, const LevelEntry& level) {
  double cells = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    cells *= std::max(1.0, std::ceil(manifest.bounds.size()[axis] / level.resolution - 1e-4));
  return std::clamp(1.0 - static_cast<double>(level.voxels) / cells, 0.0, 1.0);
}

std::string info_table(const std::string& name, const Manifest& manifest) {
  uint64_t bytes = 0;
  for (const LevelEntry& level : manifest.levels) bytes += level.file_bytes;
  const vec3 size = manifest.bounds.size();
  std::string text = fmt::format("{}: {} level{}, {}, baked by {} from {}\n", name, manifest.levels.size(),
                                 manifest.levels.size() == 1 ? "" : "s", format_bytes(bytes),
                                 one_line(manifest.generator), one_line(manifest.source));
  text += fmt::format("size {:.4g} x {:.4g} x {:.4g}\n\n", size.x, size.y, size.z);

  std::vector<std::vector<std::string>> rows = {{"level", "resolution", "grid", "triangles", "voxels", "sparsity",
                                                 "on disk", "resident", "occlusion", "rms", "color"}};
  for (const LevelEntry& level : manifest.levels) rows.push_back(level_row(manifest, level));
  text += format_table(rows);
  for (const LevelEntry& level : manifest.levels) {
    if (level.placements == 0) continue;
    text +=
        fmt::format("level {}: what it repeats counts once, and stands in {} places\n", level.level, level.placements);
  }
  if (std::none_of(manifest.levels.begin(), manifest.levels.end(), [](const auto& level) { return level.errors; }))
    text += "errors: not evaluated yet, see farfield evaluate --help\n";
  return text;
}

std::string info_json(const std::string& name, const Manifest& manifest) {
  Json levels = Json::array();
  for (const LevelEntry& level : manifest.levels) levels.push_back(level_json(manifest, level));
  const Json json = {
      {"asset", name},
      {"version", manifest.version},
      {"generator", manifest.generator},
      {"source", manifest.source},
      {"source_hash", to_hex(manifest.source_hash)},
      {"options", manifest.options},
      {"origin", vector_json(manifest.origin)},
      {"bounds", {{"lower", vector_json(manifest.bounds.lower)}, {"upper", vector_json(manifest.bounds.upper)}}},
      {"base_resolution", manifest.base_resolution},
      {"levels", levels}};
  // Names may come from hostile files: invalid UTF-8 is replaced, not thrown about.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield::tool
