// SPDX-License-Identifier: Apache-2.0
// shot.json: what a shot has done so far, for people, for checks, and for the run that goes on with it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "path_tracer/render_job.h"

namespace farfield {

/// What all runs with one fingerprint have done in a folder.
struct ShotRecord {
  std::string fingerprint;  ///< FrameRenderer::fingerprint() of the run that wrote it
  RenderReport report;
  std::map<int, uint64_t> exr_hashes = {};  ///< per frame: XXH3 of its EXR as it was written; absent before version 0.1
};

/// {"budget_bytes", "baseline_rss_bytes", "peak_rss_bytes", "peak_accounted_bytes", "fingerprint", "assets": [...],
/// "warnings": [...], "frames": [{"frame", "seconds", "cpu_seconds", "load_seconds", "accounted_bytes", "rss_bytes",
/// "bias", "asked_bytes", "rays", "levels_loaded", "fallbacks", "degraded", "invalid_samples", "finest_level": {asset:
/// k}, "levels_given_up": {asset: levels}, "exr_hash"}]}, indented, keys in this order, frames ascending.
std::string to_json(const ShotRecord& record);

/// Reads what to_json wrote; nothing for any other text.
std::optional<ShotRecord> shot_record_from_json(const std::string& text);

/// Reads shot.json in a shot's folder; nothing if there is none or it is no record.
std::optional<ShotRecord> read_shot_record(const std::filesystem::path& folder);

/// Joins the report of an earlier run, whose frames are kept, with that of the run that went on with it. The memory
/// figures are those of the run that took more beyond its baseline; warnings are those of both, each once.
RenderReport join_reports(const RenderReport& earlier, const RenderReport& later);

}  // namespace farfield
