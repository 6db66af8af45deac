// SPDX-License-Identifier: Apache-2.0
#include "runtime/open_asset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "base/bytes.h"
#include "base/result.h"
#include "cache/hull_check.h"
#include "cache/level_file.h"
#include "cache/manifest.h"

namespace farfield {

namespace {

constexpr size_t kLargestLevelCount = 256;  // HitRecord::level_slot is a byte

Result<void> check_level_file(const std::filesystem::path& path, uint64_t expected_bytes) {
  std::error_code error;
  const uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) {
    return make_error(ErrorCode::NotFound,
                      fmt::format("cannot open {}: {}; bake the asset again", path.string(), error.message()));
  }
  if (bytes != expected_bytes) {
    return make_error(ErrorCode::BadFile,
                      fmt::format("broken level file {}: {} bytes where its manifest says {}; bake the asset again",
                                  path.string(), bytes, expected_bytes));
  }
  return {};
}

/// Checking a file touches all of it, so a level that claims to need less would overrun the budget while it loads.
Result<void> check_planned_bytes(const LevelEntry& entry, const std::filesystem::path& folder) {
  if (entry.resident_bytes >= entry.file_bytes || entry.build_peak_bytes >= entry.file_bytes - entry.resident_bytes) {
    return {};
  }
  return make_error(ErrorCode::BadFile,
                    fmt::format("{}: resident_bytes and build_peak_bytes of level {} are together less than its file "
                                "of {} bytes; bake the asset again",
                                (folder / kManifestName).string(), entry.level, entry.file_bytes));
}

/// A level's file must be what the manifest says, since plans and rays go by the manifest.
Result<void> check_level(const LevelView& level, const OpenAsset& asset, uint32_t slot,
                         const std::filesystem::path& path) {
  const LevelHeader& header = level.header;
  const LevelInfo& info = asset.levels[slot];
  const auto refuse = [&](const std::string& what) {
    return make_error(ErrorCode::BadFile,
                      fmt::format("broken level file {}: {}; bake the asset again", path.string(), what));
  };
  if (header.level != info.level) {
    return refuse(fmt::format("it holds level {}, the manifest says {}", header.level, info.level));
  }
  if (!(std::abs(header.resolution - info.resolution) <= 1e-5f * info.resolution)) {
    return refuse(fmt::format("its resolution is {}, the manifest says {}", header.resolution, info.resolution));
  }
  if (header.bounds.is_empty()) return {};
  const Box3 allowed = padded_bounds(asset.traced.bounds);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(header.bounds.lower[axis] >= allowed.lower[axis] && header.bounds.upper[axis] <= allowed.upper[axis])) {
      return refuse("it sticks out of the bounds that the manifest gives");
    }
  }
  if (reach_out_of_hull(level, asset.traced.hull) > hull_slack(asset.traced.bounds)) {
    return refuse("it sticks out of the hull that the manifest gives");
  }
  return {};
}

Result<LoadedItem> load_level(const OpenAsset& asset, uint32_t slot, const std::filesystem::path& path,
                              BvhDevice& device, const LoadTerms& terms) {
  auto loaded = std::make_unique<LoadedLevel>();
  FARFIELD_TRY_LET(loaded->file, LevelFile::open_known(path, asset.levels[slot].file_bytes, asset.file_hashes[slot]));
  const LevelView& view = loaded->file->view();
  if (terms.is_cancelled()) return make_error(ErrorCode::Cancelled, fmt::format("{}: not wanted", path.string()));
  FARFIELD_TRY(check_level(view, asset, slot, path));
  const SurfaceLook* look = view.header.level == 0 ? asset.close_up.get() : nullptr;
  const uint64_t file_bytes = level_file_sizes(view).memory_bytes;  // at most most_bytes, by check_planned_bytes()
  auto traced = TracedLevel::build(device, view, slot, look, terms.after(file_bytes));
  if (!traced) {
    return make_error(
        traced.error().code,
        fmt::format("{}: {}; its manifest says {} with all else: raise the budget, or see `farfield verify`",
                    path.string(), traced.error().message,
                    format_bytes(asset.levels[slot].resident_bytes + asset.build_peak_bytes[slot])));
  }
  loaded->traced = std::move(*traced);
  loaded->file->release_build_pages();
  const LevelCost cost = level_cost(view, loaded->traced->scene);
  return LoadedItem{std::move(loaded), cost.resident_bytes, cost.build_peak_bytes};
}

Result<LoadedItem> load_morph(const OpenAsset& asset, uint32_t slot, BvhDevice& device, uint64_t bytes_left) {
  const uint64_t file_bytes = asset.levels[slot].file_bytes + asset.levels[slot + 1].file_bytes;
  if (file_bytes > bytes_left) {
    return make_error(ErrorCode::OutOfBudget,
                      fmt::format("its morph to the next level takes more than {}, its manifest says {}; see `farfield "
                                  "verify`",
                                  format_bytes(bytes_left), format_bytes(asset.morph_costs[slot]->build_peak_bytes)));
  }
  const auto open = [&](uint32_t level) {
    return LevelFile::open_known(asset.folder / asset.file_names[level], asset.levels[level].file_bytes,
                                 asset.file_hashes[level]);
  };
  FARFIELD_TRY_LET(const auto fine, open(slot));
  FARFIELD_TRY_LET(const auto coarse, open(slot + 1));
  auto loaded = std::make_unique<LoadedMorph>();
  FARFIELD_TRY_LET(loaded->traced, TracedMorph::build(device, fine->view(), coarse->view(),
                                                      *asset.traced.loaded[slot].load(std::memory_order_acquire),
                                                      *asset.traced.loaded[slot + 1].load(std::memory_order_acquire),
                                                      bytes_left - file_bytes));
  const LevelCost cost = loaded->traced->cost(fine->view(), coarse->view());
  return LoadedItem{std::move(loaded), cost.resident_bytes, cost.build_peak_bytes};
}

}  // namespace

uint64_t OpenAsset::table_bytes() const {
  constexpr uint64_t kItem = 512;  // of the ResidentSet, with its function
  constexpr uint64_t kPerLevel = sizeof(LevelInfo) + 3 * sizeof(uint64_t) + 2 * sizeof(float) + sizeof(void*) + kItem;
  return sizeof(OpenAsset) + morph_items.size() * kItem + close_up->table_bytes() +
         traced.hull.capacity() * sizeof(vec3) + levels.size() * kPerLevel;
}

Result<std::unique_ptr<OpenAsset>> read_asset(const std::filesystem::path& folder, MaterialFunction materials,
                                              TextureCache& textures) {
  FARFIELD_TRY_LET(const auto manifest, read_manifest(folder));
  if (manifest.levels.empty() || manifest.levels.size() > kLargestLevelCount) {
    return make_error(ErrorCode::Unsupported, fmt::format("{} has {} levels; from 1 to {} are possible",
                                                          folder.string(), manifest.levels.size(), kLargestLevelCount));
  }
  auto asset = std::make_unique<OpenAsset>();
  asset->name = folder.filename().string();
  asset->folder = folder;
  asset->origin = manifest.origin;
  asset->rotation = manifest.rotation;
  asset->bounds_source = in_source_space(manifest.bounds, manifest);
  TracedAsset& traced = asset->traced;
  traced.bounds = padded_bounds(manifest.bounds);
  traced.hull.assign(manifest.hull.begin(), manifest.hull.end());
  traced.base_resolution = static_cast<float>(manifest.base_resolution);
  traced.loaded = std::make_unique<std::atomic<const TracedLevel*>[]>(manifest.levels.size());
  traced.morphs = std::make_unique<std::atomic<const TracedMorph*>[]>(manifest.levels.size());
  for (const LevelEntry& entry : manifest.levels) {
    FARFIELD_TRY(check_level_file(folder / entry.file, entry.file_bytes));
    FARFIELD_TRY(check_planned_bytes(entry, folder));
    traced.level_numbers.push_back(static_cast<float>(entry.level));
    asset->levels.push_back({entry.level, static_cast<float>(entry.resolution), entry.triangles, entry.voxels,
                             entry.file_bytes, entry.resident_bytes});
    asset->build_peak_bytes.push_back(entry.build_peak_bytes);
    asset->ray_cost.push_back(static_cast<float>(entry.ray_cost));
    if (entry.level != manifest.levels.front().level) asset->morph_costs.push_back(entry.morph);
    asset->file_names.push_back(entry.file);
    asset->file_hashes.push_back(entry.file_hash);
  }
  asset->morph_costs.emplace_back();  // the root's
  asset->close_up = std::make_unique<CloseUp>(folder, manifest, std::move(materials), textures);
  return asset;
}

ResidencyItem make_level_item(const OpenAsset& asset, uint32_t slot, BvhDevice& device) {
  return {asset.levels[slot].resident_bytes, asset.build_peak_bytes[slot],
          [&asset, slot, &device](const LoadTerms& terms) {
            return load_level(asset, slot, asset.folder / asset.file_names[slot], device, terms);
          }};
}

ResidencyItem make_morph_item(const OpenAsset& asset, uint32_t slot, BvhDevice& device) {
  const LevelCost& cost = *asset.morph_costs[slot];
  return {cost.resident_bytes, cost.build_peak_bytes, [&asset, slot, &device](const LoadTerms& terms) {
            return load_morph(asset, slot, device, terms.most_bytes);
          }};
}

}  // namespace farfield
