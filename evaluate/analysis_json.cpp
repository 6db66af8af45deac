// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "evaluate/analysis.h"

namespace farfield {
namespace {

using Json = nlohmann::ordered_json;

Json simplifier_json(const SimplifierFigures& figures) {
  Json json = {{"simplifier", figures.name},         {"faces", figures.faces},
               {"farthest", figures.farthest},       {"rms", figures.rms},
               {"area_change", figures.area_change}, {"volume_change", nullptr}};
  if (figures.volume_change) json["volume_change"] = *figures.volume_change;
  return json;
}

Json level_json(const LevelAnalysis& level) {
  Json json = {{"level", level.level},
               {"grid", level.grid},
               {"resolution", level.resolution},
               {"macrosurface_faces", level.faces_before},
               {"sub_resolution_faces", level.sub_resolution},
               {"simplified_faces", level.faces},
               {"macrosurface_area_share", level.macrosurface_share},
               {"face_size_median", level.face_size.median},
               {"face_size_95", level.face_size.most},
               {"normal_roughness", level.normal_roughness}};
  for (const SimplifierFigures& figures : level.simplifiers) json["simplifiers"].push_back(simplifier_json(figures));
  return json;
}

}  // namespace

std::string to_json(const Analysis& analysis) {
  Json json = {{"levels", Json::array()}, {"grids_not_made", analysis.grids_not_made}, {"warnings", analysis.warnings}};
  for (const LevelAnalysis& level : analysis.levels) json["levels"].push_back(level_json(level));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield
