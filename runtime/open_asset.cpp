// SPDX-License-Identifier: Apache-2.0
#include "runtime/open_asset.h"

#include <fmt/format.h>

#include <cmath>
#include <system_error>

#include "base/result.h"
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

/// A level's file must be the one that the manifest means, since plans and rays go by the manifest.
Result<void> check_header(const LevelHeader& header, const OpenAsset& asset, uint32_t slot,
                          const std::filesystem::path& path) {
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
  const Box3 allowed = padded_bounds(asset.traced.bounds);
  if (header.bounds.is_empty()) return {};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(header.bounds.lower[axis] >= allowed.lower[axis] && header.bounds.upper[axis] <= allowed.upper[axis])) {
      return refuse("it sticks out of the bounds that the manifest gives");
    }
  }
  return {};
}

Result<LoadedItem> load_level(const OpenAsset& asset, uint32_t slot, const std::filesystem::path& path,
                              BvhDevice& device) {
  auto loaded = std::make_unique<LoadedLevel>();
  FARFIELD_TRY_LET(loaded->file, LevelFile::open_known(path, asset.file_hashes[slot]));
  const LevelView& view = loaded->file->view();
  FARFIELD_TRY(check_header(view.header, asset, slot, path));
  const SurfaceLook* look = view.header.level == 0 ? asset.close_up.get() : nullptr;
  FARFIELD_TRY_LET(auto traced, TracedLevel::build(device, view, slot, look));
  loaded->traced = std::move(traced);
  loaded->file->release_build_pages();
  const LevelCost cost = level_cost(view, loaded->traced->scene);
  return LoadedItem{std::move(loaded), cost.resident_bytes, cost.build_peak_bytes};
}

}  // namespace

uint64_t OpenAsset::table_bytes() const {
  constexpr uint64_t kPerLevel = sizeof(LevelInfo) + 3 * sizeof(uint64_t) + 2 * sizeof(float) + sizeof(void*) +
                                 512;  // the ResidentSet's item and its function
  return sizeof(OpenAsset) + close_up->table_bytes() + traced.hull.capacity() * sizeof(vec3) +
         levels.size() * kPerLevel;
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
  for (const LevelEntry& entry : manifest.levels) {
    FARFIELD_TRY(check_level_file(folder / entry.file, entry.file_bytes));
    FARFIELD_TRY(check_planned_bytes(entry, folder));
    traced.level_numbers.push_back(static_cast<float>(entry.level));
    asset->levels.push_back({entry.level, static_cast<float>(entry.resolution), entry.triangles, entry.voxels,
                             entry.file_bytes, entry.resident_bytes});
    asset->build_peak_bytes.push_back(entry.build_peak_bytes);
    asset->ray_cost.push_back(static_cast<float>(entry.ray_cost));
    asset->file_names.push_back(entry.file);
    asset->file_hashes.push_back(entry.file_hash);
  }
  asset->close_up = std::make_unique<CloseUp>(folder, manifest, std::move(materials), textures);
  return asset;
}

ResidencyItem make_level_item(const OpenAsset& asset, uint32_t slot, BvhDevice& device) {
  return {asset.levels[slot].resident_bytes, asset.build_peak_bytes[slot],
          [&asset, slot, &device] { return load_level(asset, slot, asset.folder / asset.file_names[slot], device); }};
}

}  // namespace farfield
