// SPDX-License-Identifier: Apache-2.0
#include "cache/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "base/file_io.h"
#include "base/hash.h"
#include "cache/hull_check.h"
#include "cache/level_file.h"
#include "cache/manifest.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

class Verifier {
 public:
  Verifier(const fs::path& folder, const CostMeasures& measure) : folder_(folder), measure_(measure) {}

  VerifyResult run() {
    const Result<Manifest> manifest = read_manifest(folder_);
    if (!manifest) {
      file_ = kManifestName;
      error(manifest.error().message);
      return result_;
    }
    manifest_ = &*manifest;
    file_ = kManifestName;
    if (!manifest->has_checksum) {
      add(Finding::Severity::Warning,
          fmt::format("{}: it has no checksum, it was written by an older Farfield; bake the "
                      "asset again to have one",
                      file_));
    }
    std::unique_ptr<LevelFile> finer;
    for (const LevelEntry& entry : manifest->levels) {
      finer = check_level(entry, finer.get(), entry.level == manifest->levels.front().level);
    }
    for (const AssetTexture& texture : manifest->textures) check_texture(texture);
    check_folder();
    return result_;
  }

 private:
  void add(Finding::Severity severity, std::string message) {
    result_.findings.push_back({severity, file_, std::move(message)});
  }
  void error(std::string message) { add(Finding::Severity::Error, std::move(message)); }
  /// A figure of the manifest that the file contradicts.
  void mismatch(const char* what, const std::string& manifest_says, const std::string& file_says) {
    error(fmt::format("{}: {} is {} in the manifest and {} in the file; bake the asset again", file_, what,
                      manifest_says, file_says));
  }
  void expect_count(const char* what, uint64_t manifest_says, uint64_t file_says) {
    if (manifest_says != file_says) mismatch(what, fmt::to_string(manifest_says), fmt::to_string(file_says));
  }

  /// Returns the level; null if it could not be read. finer: the next finer stored one, null if that could not be.
  std::unique_ptr<LevelFile> check_level(const LevelEntry& entry, const LevelFile* finer, bool is_first) {
    file_ = entry.file;
    auto opened = LevelFile::open(folder_ / entry.file, LevelCheck::Full);
    if (!opened) {
      error(opened.error().message);
      return {};
    }
    const LevelFile& file = **opened;
    const LevelView& level = file.view();
    ++result_.levels_checked;
    result_.bytes_checked += file.file_bytes();

    expect_count("the file's size", entry.file_bytes, file.file_bytes());
    const uint64_t hash = hash_bytes(file.bytes());
    if (entry.file_hash != hash) mismatch("the file's hash", to_hex(entry.file_hash), to_hex(hash));
    expect_count("the number of triangles", entry.triangles, face_count(level));
    expect_count("the number of places of parts", entry.placements, level.placements.size());
    expect_count("the number of voxels", entry.voxels, voxel_count(level));
    expect_count("the number of bricks", entry.bricks, level.bricks.size());
    expect_count("the level's number", entry.level, level.header.level);
    check_resolution(entry, level);
    check_resident_bytes(entry, level);
    if (measure_.level) check_cost("it", {entry.resident_bytes, entry.build_peak_bytes}, measure_.level(level));
    check_bounds(level);
    check_hull(level);
    check_morph(level, finer, is_first);
    if (measure_.morph && entry.morph && finer) {
      check_cost("its morph from the next finer level", *entry.morph, measure_.morph(finer->view(), level));
    }
    return std::move(*opened);
  }

  void check_texture(const AssetTexture& texture) {
    file_ = texture.file;
    const auto hash = hash_file(folder_ / texture.file);
    if (!hash) return error(hash.error().message);
    result_.bytes_checked += texture.file_bytes;
    if (texture.file_hash != *hash) mismatch("the file's hash", to_hex(texture.file_hash), to_hex(*hash));
  }

  /// r_k = 2^k r_0, the same in manifest and file. Files store floats.
  void check_resolution(const LevelEntry& entry, const LevelView& level) {
    constexpr double kFloatRounding = 1e-5;
    const auto differ = [&](double a, double b) { return std::abs(a - b) > kFloatRounding * std::abs(b); };
    const double in_file = static_cast<double>(level.header.resolution);
    if (differ(in_file, entry.resolution)) {
      mismatch("the resolution", fmt::to_string(entry.resolution), fmt::to_string(in_file));
    }
    const double expected = std::ldexp(manifest_->base_resolution, static_cast<int>(entry.level));
    if (differ(entry.resolution, expected)) {
      error(fmt::format("{}: level {} has resolution {}, expected {} (2^{} of the finest); bake the asset again", file_,
                        entry.level, entry.resolution, expected, entry.level));
    }
  }

  /// The planner trusts this figure: at least the pages that rays read must be in it.
  void check_resident_bytes(const LevelEntry& entry, const LevelView& level) {
    const LevelFileSizes sizes = level_file_sizes(level);
    const uint64_t least = sizes.memory_bytes - sizes.build_only_bytes;
    if (entry.resident_bytes >= least) return;
    error(fmt::format("{}: the manifest counts {} resident bytes, but rays alone touch {}; bake the asset again", file_,
                      entry.resident_bytes, least));
  }

  /// what: "it", "its morph". promised: by the manifest, whose plans are kept to within its figures.
  void check_cost(const char* what, const LevelCost& promised, const Result<LevelCost>& cost) {
    if (!cost) return error(fmt::format("{}: {} cannot be loaded: {}", file_, what, cost.error().message));
    const uint64_t measured_sum = cost->resident_bytes + cost->build_peak_bytes;
    const uint64_t promised_sum = promised.resident_bytes + promised.build_peak_bytes;
    if (measured_sum == promised_sum && cost->resident_bytes == promised.resident_bytes) return;
    const bool is_lie = promised_sum / 2 < measured_sum / 3;
    add(is_lie ? Finding::Severity::Error : Finding::Severity::Warning,
        fmt::format("{}: {} takes {} bytes, and {} more while it is loaded; the manifest says {} and {}; bake the "
                    "asset again on this kind of processor",
                    file_, what, cost->resident_bytes, cost->build_peak_bytes, promised.resident_bytes,
                    promised.build_peak_bytes));
  }

  void check_bounds(const LevelView& level) {
    const Box3& all = manifest_->bounds;
    const Box3& own = level.header.bounds;
    const vec3 slack(1e-5f * max_component(all.size()));
    const bool inside = glm::all(glm::greaterThanEqual(own.lower, all.lower - slack)) &&
                        glm::all(glm::lessThanEqual(own.upper, all.upper + slack));
    if (!inside) error(fmt::format("{}: it reaches out of the manifest's bounds; bake the asset again", file_));
  }

  void check_hull(const LevelView& level) {
    const float reach = reach_out_of_hull(level, manifest_->hull);
    if (reach <= hull_slack(manifest_->bounds)) return;
    error(fmt::format("{}: it reaches {} out of the manifest's hull; bake the asset again", file_, reach));
  }

  /// A morph map has an entry for each vertex and face of the next finer stored level, or is absent.
  void check_morph(const LevelView& level, const LevelFile* finer, bool is_first) {
    const bool has_morph = !level.morph_vertex.empty() || !level.morph_face.empty();
    if (!has_morph) return;
    if (finer && finer->view().has_parts()) {
      return error(fmt::format("{}: it has a morph map from a level with parts; bake the asset again", file_));
    }
    if (is_first) return error(fmt::format("{}: the finest level has a morph map; bake the asset again", file_));
    if (!finer) return;  // that level could not be read, which is a finding already
    expect_morph("vertices", level.morph_vertex.size(), finer->view().positions.size());
    expect_morph("faces", level.morph_face.size(), face_count(finer->view()));
  }
  void expect_morph(const char* what, uint64_t mapped, uint64_t expected) {
    if (mapped == expected) return;
    error(fmt::format("{}: its morph map has {} {}, and the next finer level has {}; bake the asset again", file_,
                      mapped, what, expected));
  }

  /// Files that do not belong: left by an interrupted bake, or put there by someone.
  void check_folder() {
    std::set<std::string> known = {kManifestName};
    for (const LevelEntry& entry : manifest_->levels) known.insert(entry.file);
    for (const AssetTexture& texture : manifest_->textures) known.insert(texture.file);
    std::set<std::string> strangers;  // sorted: the order of a folder is not
    std::error_code failure;
    for (fs::directory_iterator entry(folder_, failure), end; !failure && entry != end; entry.increment(failure)) {
      const std::string name = entry->path().filename().string();
      if (!known.contains(name)) strangers.insert(name);
    }
    for (const std::string& name : strangers) {
      file_ = name;
      add(Finding::Severity::Warning, fmt::format("{}: it is not part of the asset; you may remove it", name));
    }
  }

  const fs::path& folder_;
  const CostMeasures& measure_;
  const Manifest* manifest_ = nullptr;
  std::string file_;  ///< what is being checked
  VerifyResult result_;
};

}  // namespace

bool VerifyResult::is_sound() const {
  return std::ranges::none_of(findings, [](const Finding& f) { return f.severity == Finding::Severity::Error; });
}

VerifyResult verify_asset(const fs::path& asset_dir, const CostMeasures& measure) {
  return Verifier(asset_dir, measure).run();
}

}  // namespace farfield
