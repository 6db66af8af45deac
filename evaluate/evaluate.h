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
  int views = 12;             ///< >= 1
  int samples_per_pixel = 0;  ///< rounded up to a multiple of 4; 0: chosen per level, see default_samples_per_pixel()
  uint64_t seed = 0;
  std::filesystem::path images;  ///< folder for every view's pictures as EXR, and the light; empty: none
  std::filesystem::path sheet;   ///< contact sheet, PNG; empty: none

  /// Called from one thread at a time with what is being done and how much of the whole is done, in [0, 1].
  Job job;
};

struct LevelEvaluation {
  LevelEntry entry;  ///< of the manifest
  ErrorMetrics errors;
  int samples_per_pixel = 0;
  uint64_t pixels = 0;  ///< over all views
  double seconds = 0;
};

struct Evaluation {
  std::vector<LevelEvaluation> levels;  ///< finest first
  int views = 0;
  std::vector<std::string> warnings;  ///< one line each; those of the source's import first
};

/// Renders every chosen level and the source from the same views, under the same light, at one pixel per voxel of the
/// level, measures, writes pictures, and records the errors in the asset's manifest (if that fails: a warning). The
/// result depends on the arguments alone, not on threads or time. Errors: those of read_manifest, bake, AssetView and
/// image files; InvalidArgument (no such level, no views, pictures beyond 2^26 pixels; before any picture: a source
/// that the asset was not baked from, unless other_source is set); Cancelled.
Result<Evaluation> evaluate(const EvaluateOptions& options);

/// Samples per pixel that keep a level's cost bounded: many for the few pixels of coarse levels. pixels: over all
/// views. A multiple of 4 in [8, 4096].
int default_samples_per_pixel(uint64_t pixels);

/// The evaluation as JSON text: issue 2's keys, with standard errors and noise beside them.
std::string to_json(const Evaluation& evaluation);

}  // namespace farfield
