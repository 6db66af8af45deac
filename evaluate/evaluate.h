// SPDX-License-Identifier: Apache-2.0
// `farfield evaluate`: how far the levels of a baked asset look from their source (docs/error_metric.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "cache/manifest.h"
#include "evaluate/depth.h"
#include "evaluate/lights.h"
#include "evaluate/metrics.h"
#include "prefilter/condition.h"

namespace farfield {

struct EvaluateOptions {
  std::filesystem::path asset;   ///< baked folder
  std::filesystem::path source;  ///< the file it was baked from; imported anew. Empty: the asset's own level 0
  ImportOptions import;          ///< as given to the bake
  bool other_source = false;     ///< compare with a source that the asset was not baked from, too; records nothing
  uint32_t first_level = 1;      ///< stored levels in [first_level, last_level] are evaluated
  uint32_t last_level = 0xffffffffu;
  std::vector<Light> lights{all_lights().begin(), all_lights().end()};  ///< at least one
  int views = 12;                                                       ///< >= 1
  int samples_per_pixel = 0;  ///< per light, rounded up to a multiple of 4; 0: see default_samples_per_pixel()
  uint64_t seed = 0;
  std::filesystem::path images;  ///< folder for every view's pictures as EXR, and the light; empty: none
  std::filesystem::path sheet;   ///< contact sheet under the first light, PNG; empty: none

  /// Called from one thread at a time with what is being done and how much of the whole is done, in [0, 1].
  Job job;
};

/// The errors under one light.
struct LightEvaluation {
  Light light = Light::Daylight;
  ErrorMetrics errors;              ///< over all views
  std::vector<ErrorMetrics> views;  ///< each alone
  size_t worst_view = 0;            ///< where a channel's mean is surely farthest from the source's
};

struct LevelEvaluation {
  LevelEntry entry;     ///< of the manifest
  ErrorMetrics errors;  ///< coverage: over all views and lights. Colour: in daylight, if it was rendered
  std::vector<LightEvaluation> lights;  ///< in the order of the options
  std::vector<ErrorMetrics> views;      ///< each alone, coverage over all lights
  size_t worst_view = 0;                ///< where coverage is surely farthest from the source's
  DepthAgreement depth;
  int samples_per_pixel = 0;  ///< per light
  uint64_t pixels = 0;        ///< over all views
  double seconds = 0;

  /// Colour in daylight was measured: what the asset's manifest keeps.
  bool has_daylight() const;
};

struct Evaluation {
  std::vector<LevelEvaluation> levels;  ///< finest first
  int views = 0;
  std::vector<vec3> directions;       ///< of the views: unit, the way the camera looks
  std::vector<std::string> warnings;  ///< one line each; those of the source's import first
};

/// Renders every chosen level and the source from the same views, under the same lights, at one pixel per voxel of the
/// level, measures, writes pictures, and records the errors in the asset's manifest (if that fails, or daylight was not
/// rendered: a warning). The result depends on the arguments alone, not on threads or time. Errors: those of
/// read_manifest, bake, AssetView and image files; InvalidArgument (no such level, no views, no lights, pictures beyond
/// 2^26 pixels; before any picture: a source that the asset was not baked from, unless other_source is set); Cancelled.
Result<Evaluation> evaluate(const EvaluateOptions& options);

}  // namespace farfield
