// SPDX-License-Identifier: Apache-2.0
// Figures as JSON: what is unknown is null, and stands beside its bounds (docs/error_metric.md, "Files"). Includes
// nlohmann/json: only for the .cpp files that write JSON.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "evaluate/depth.h"
#include "evaluate/estimate.h"
#include "evaluate/metrics.h"

namespace farfield {

/// An object of figures. Beside them stand "standard_errors" and, for what may be unknown, "bounds" by the same names.
class FiguresJson {
 public:
  using Json = nlohmann::ordered_json;

  /// json: an object, what it begins with.
  explicit FiguresJson(Json json) : json_(std::move(json)) {}

  void put(const std::string& name, const Estimate& estimate);
  void put(const std::string& name, const std::array<Estimate, 3>& rgb);
  void put(const std::string& name, const Bounded& size);
  /// One name per side of kBlockSides: "color_rms", "color_rms_2x2", "color_rms_4x4".
  void put(const std::string& name, const std::array<Bounded, kBlockSides.size()>& sizes);
  void put(const std::string& name, const DepthFigures& depth);
  void put_occlusion(const ErrorMetrics& errors);
  void put_color(const ErrorMetrics& errors);

  Json finish() &&;

 private:
  Json json_;
  Json bounds_ = Json::object(), standard_errors_ = Json::object();
};

}  // namespace farfield
