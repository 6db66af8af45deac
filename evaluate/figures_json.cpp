// SPDX-License-Identifier: Apache-2.0
#include "evaluate/figures_json.h"

#include <fmt/format.h>

namespace farfield {

void FiguresJson::put(const std::string& name, const Estimate& estimate) {
  json_[name] = estimate.value;
  standard_errors_[name] = estimate.standard_error;
}

void FiguresJson::put(const std::string& name, const std::array<Estimate, 3>& rgb) {
  json_[name] = {rgb[0].value, rgb[1].value, rgb[2].value};
  standard_errors_[name] = {rgb[0].standard_error, rgb[1].standard_error, rgb[2].standard_error};
}

void FiguresJson::put(const std::string& name, const Bounded& size) {
  json_[name] = size.value ? Json(*size.value) : Json();
  bounds_[name] = {size.low, size.high};
  standard_errors_[name] = size.value ? Json(size.standard_error) : Json();
}

void FiguresJson::put(const std::string& name, const std::array<Bounded, kBlockSides.size()>& sizes) {
  for (size_t i = 0; i < kBlockSides.size(); ++i)
    put(kBlockSides[i] == 1 ? name : fmt::format("{}_{}x{}", name, kBlockSides[i], kBlockSides[i]), sizes[i]);
}

void FiguresJson::put(const std::string& name, const DepthFigures& depth) {
  put(name + "_mean", depth.mean);
  put(name + "_distance", depth.distance);
}

void FiguresJson::put_occlusion(const ErrorMetrics& errors) {
  put("occlusion_error", errors.occlusion_error);
  put("occlusion_rms", errors.occlusion_rms);
  put("occlusion_rms_touched", errors.occlusion_rms_touched);
}

void FiguresJson::put_color(const ErrorMetrics& errors) {
  put("color_error", errors.color_error);
  put("color_bias", errors.color_bias);
  put("color_bias_mean", errors.color_bias_mean);
  put("color_rest", errors.color_rest);
  put("color_rms", errors.color_rms);
}

FiguresJson::Json FiguresJson::finish() && {
  if (!bounds_.empty()) json_["bounds"] = std::move(bounds_);
  json_["standard_errors"] = std::move(standard_errors_);
  return std::move(json_);
}

}  // namespace farfield
