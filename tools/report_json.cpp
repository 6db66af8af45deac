// SPDX-License-Identifier: Apache-2.0
#include "tools/report_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/hash.h"

namespace farfield::tool {
namespace {

using Json = nlohmann::ordered_json;

/// What the manifest knows of a level, with what the bake's stages did for it, if they ran.
Json level_json(const LevelEntry& entry, const BakeReport& report) {
  Json json = {{"level", entry.level},
               {"grid", entry.grid},
               {"resolution", entry.resolution},
               {"triangles", entry.triangles},
               {"voxels", entry.voxels},
               {"bytes_disk", entry.file_bytes},
               {"bytes_resident", entry.resident_bytes},
               {"bytes_build_peak", entry.build_peak_bytes},
               {"file", entry.file}};
  if (entry.placements > 0) json["placements"] = entry.placements;
  const auto stages = std::find_if(report.levels.begin(), report.levels.end(),
                                   [&](const LevelReport& level) { return level.level == entry.level; });
  if (stages == report.levels.end()) return json;
  json["resumed"] = stages->resumed;
  json["macrosurface_triangles"] = stages->macrosurface_triangles;
  json["voxelized_triangles"] = stages->voxelized_triangles;
  json["close_walls"] = {
      {"vertices", stages->apart.walls}, {"moved", stages->apart.moved}, {"crossing", stages->apart.crossing}};
  json["seconds"] = {{"analysis", stages->analysis_seconds},
                     {"simplify", stages->simplify_seconds},
                     {"voxelize", stages->voxelize_seconds},
                     {"write", stages->write_seconds}};
  return json;
}

Json report_json(const BakeReport& report) {
  Json levels = Json::array();
  for (const LevelEntry& entry : report.manifest.levels) levels.push_back(level_json(entry, report));
  return {{"source", report.manifest.source},
          {"source_hash", to_hex(report.manifest.source_hash)},
          {"options", report.manifest.options},
          {"up_to_date", report.up_to_date},
          {"import_seconds", report.import_seconds},
          {"total_seconds", report.total_seconds},
          {"warnings", report.warnings},
          {"levels", levels}};
}

std::string to_text(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

}  // namespace

std::string bake_report_json(const BakeReport& report) { return to_text(report_json(report)); }

std::string scene_report_json(const std::vector<AssetReport>& assets) {
  Json json = Json::array();
  for (const AssetReport& asset : assets) {
    json.push_back({{"asset", asset.asset}, {"cpu_seconds", asset.cpu_seconds}, {"peak_bytes", asset.peak_bytes}});
    json.back().update(report_json(asset.report));
  }
  return to_text({{"assets", json}});
}

std::string export_report_json(const std::string& asset, const std::string& target, const ExportReport& report) {
  Json levels = Json::array();
  for (const ExportedLevel& level : report.levels) {
    Json json = {{"level", level.level}, {"resolution", level.resolution}};
    if (level.grids.empty()) {
      json["faces"] = level.faces;
      json["vertices"] = level.vertices;
      json["materials"] = level.materials;
    } else {
      json["voxels"] = level.voxels;
      json["grids"] = level.grids;
    }
    levels.push_back(std::move(json));
  }
  Json files = Json::array();
  for (const std::filesystem::path& file : files_of_export(target)) files.push_back(file.string());
  return to_text({{"asset", asset}, {"files", files}, {"warnings", report.notes}, {"levels", levels}});
}

}  // namespace farfield::tool
