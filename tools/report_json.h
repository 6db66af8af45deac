// SPDX-License-Identifier: Apache-2.0
// What `farfield bake --report` and `farfield export --report` write.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "export/export_asset.h"

namespace farfield::tool {

/// The report as JSON text: levels with sizes and seconds, warnings, totals.
std::string bake_report_json(const BakeReport& report);

/// An asset of a scene and what its bake took of this process.
struct AssetReport {
  std::string asset;
  double cpu_seconds = 0;   ///< of all threads, reading included
  uint64_t peak_bytes = 0;  ///< the highest resident set size
  BakeReport report;
};
/// The reports of a scene's assets: {"assets": [...]}, each as bake_report_json() has it and with what it took.
std::string scene_report_json(const std::vector<AssetReport>& assets);

/// What was exported of an asset, and where to.
std::string export_report_json(const std::string& asset, const std::string& target, const ExportReport& report);

}  // namespace farfield::tool
