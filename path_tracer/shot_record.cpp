// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/shot_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/file_io.h"
#include "base/hash.h"
#include "path_tracer/warning_log.h"

namespace farfield {

using Json = nlohmann::ordered_json;

namespace {

constexpr uint64_t kMostRecordBytes = 256 << 20;

template <typename T>
Json by_asset(const std::vector<std::string>& assets, const std::vector<T>& values) {
  Json json = Json::object();
  for (size_t i = 0; i < std::min(assets.size(), values.size()); ++i) json[assets[i]] = values[i];
  return json;
}

Json use_to_json(const LevelUse& use) {
  return {{"level", use.level},
          {"hits", use.hits},
          {"loads", use.loads},
          {"load_seconds", use.load_seconds},
          {"resident_bytes", use.resident_bytes},
          {"served_coarser", use.served_coarser}};
}

LevelUse use_from_json(const Json& json) {
  return {json.at("level"),        json.at("hits"),           json.at("loads"),
          json.at("load_seconds"), json.at("resident_bytes"), json.at("served_coarser")};
}

Json levels_to_json(const std::vector<std::string>& assets, const std::vector<std::vector<LevelUse>>& levels) {
  std::vector<Json> per_asset;
  for (const std::vector<LevelUse>& uses : levels) {
    per_asset.push_back(Json::array());
    for (const LevelUse& use : uses) per_asset.back().push_back(use_to_json(use));
  }
  return by_asset(assets, per_asset);
}

std::vector<std::vector<LevelUse>> levels_from_json(const std::vector<std::string>& assets, const Json& json) {
  std::vector<std::vector<LevelUse>> levels(assets.size());
  for (size_t i = 0; i < assets.size(); ++i)
    for (const Json& use : json.at(assets[i])) levels[i].push_back(use_from_json(use));
  return levels;
}

Json frame_to_json(const FrameReport& frame, const std::vector<std::string>& assets) {
  return {{"frame", frame.frame},
          {"seconds", frame.seconds},
          {"cpu_seconds", frame.cpu_seconds},
          {"load_seconds", frame.load_seconds},
          {"stall_seconds", frame.stall_seconds},
          {"stall", frame.stall()},
          {"accounted_bytes", frame.accounted_bytes},
          {"rss_bytes", frame.rss_bytes},
          {"bias", frame.bias},
          {"asked_bytes", frame.asked_bytes},
          {"morphs", frame.morphs},
          {"morphs_given_up", frame.morphs_given_up},
          {"rays", frame.rays},
          {"levels_loaded", frame.levels_loaded},
          {"fallbacks", frame.fallbacks},
          {"degraded", frame.is_degraded()},
          {"invalid_samples", frame.invalid_samples},
          {"finest_level", by_asset(assets, frame.finest_level)},
          {"levels", levels_to_json(assets, frame.levels)},
          {"levels_given_up", by_asset(assets, frame.levels_given_up)}};
}

FrameReport frame_from_json(const Json& json, const std::vector<std::string>& assets) {
  FrameReport frame;
  json.at("frame").get_to(frame.frame);
  json.at("seconds").get_to(frame.seconds);
  frame.cpu_seconds = json.value("cpu_seconds", 0.0);  // absent before version 0.1
  json.at("load_seconds").get_to(frame.load_seconds);
  frame.stall_seconds = json.value("stall_seconds", 0.0);  // absent before levels were loaded ahead
  json.at("accounted_bytes").get_to(frame.accounted_bytes);
  json.at("rss_bytes").get_to(frame.rss_bytes);
  json.at("bias").get_to(frame.bias);
  json.at("asked_bytes").get_to(frame.asked_bytes);
  frame.morphs = json.value("morphs", 0u);  // absent before there were any
  frame.morphs_given_up = json.value("morphs_given_up", 0u);
  json.at("rays").get_to(frame.rays);
  json.at("levels_loaded").get_to(frame.levels_loaded);
  json.at("fallbacks").get_to(frame.fallbacks);
  json.at("invalid_samples").get_to(frame.invalid_samples);
  if (json.contains("levels")) frame.levels = levels_from_json(assets, json.at("levels"));  // absent before 0.1
  for (const std::string& asset : assets) {
    frame.finest_level.push_back(json.at("finest_level").at(asset).get<uint32_t>());
    frame.levels_given_up.push_back(json.at("levels_given_up").at(asset).get<float>());
  }
  return frame;
}

uint64_t beyond_baseline(const RenderReport& report) {
  return report.peak_rss_bytes - std::min(report.peak_rss_bytes, report.baseline_rss_bytes);
}

}  // namespace

std::string to_json(const ShotRecord& record) {
  const RenderReport& report = record.report;
  Json frames = Json::array();
  for (const FrameReport& frame : report.frames) {
    frames.push_back(frame_to_json(frame, report.assets));
    if (const auto hash = record.exr_hashes.find(frame.frame); hash != record.exr_hashes.end())
      frames.back()["exr_hash"] = to_hex(hash->second);
  }
  const Json json = {{"budget_bytes", report.budget_bytes},
                     {"baseline_rss_bytes", report.baseline_rss_bytes},
                     {"peak_rss_bytes", report.peak_rss_bytes},
                     {"peak_accounted_bytes", report.peak_accounted_bytes},
                     {"fingerprint", record.fingerprint},
                     {"assets", report.assets},
                     {"warnings", report.warnings},
                     {"frames", frames}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::optional<ShotRecord> shot_record_from_json(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    ShotRecord record;
    RenderReport& report = record.report;
    json.at("budget_bytes").get_to(report.budget_bytes);
    json.at("baseline_rss_bytes").get_to(report.baseline_rss_bytes);
    json.at("peak_rss_bytes").get_to(report.peak_rss_bytes);
    json.at("peak_accounted_bytes").get_to(report.peak_accounted_bytes);
    json.at("fingerprint").get_to(record.fingerprint);
    json.at("assets").get_to(report.assets);
    report.warnings = json.value("warnings", std::vector<std::string>());  // absent before version 0.1
    for (const Json& frame : json.at("frames")) {
      report.frames.push_back(frame_from_json(frame, report.assets));
      if (const auto hash = from_hex(frame.value("exr_hash", "")))
        record.exr_hashes[report.frames.back().frame] = *hash;
    }
    return record;
  } catch (const Json::exception&) {
    return std::nullopt;  // half a file, or somebody else's: the shot starts anew
  }
}

std::optional<ShotRecord> read_shot_record(const std::filesystem::path& folder) {
  const auto text = read_small_file(folder / "shot.json", kMostRecordBytes);
  return text ? shot_record_from_json(*text) : std::nullopt;
}

RenderReport join_reports(const RenderReport& earlier, const RenderReport& later) {
  RenderReport joined = later.frames.empty() || beyond_baseline(earlier) > beyond_baseline(later) ? earlier : later;
  joined.peak_accounted_bytes = std::max(earlier.peak_accounted_bytes, later.peak_accounted_bytes);
  joined.warnings = earlier.warnings;
  add_new_lines(joined.warnings, later.warnings);
  joined.frames = earlier.frames;
  joined.frames.insert(joined.frames.end(), later.frames.begin(), later.frames.end());
  std::stable_sort(joined.frames.begin(), joined.frames.end(),
                   [](const FrameReport& a, const FrameReport& b) { return a.frame < b.frame; });
  return joined;
}

}  // namespace farfield
