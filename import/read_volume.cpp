// SPDX-License-Identifier: Apache-2.0
#include "import/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string_view>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/text.h"
#include "import/resample_volume.h"
#include "import/volume_module.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> kVdbMagic = {' ', 'B', 'D', 'V', 0, 0, 0, 0};
constexpr std::string_view kNanoVdbMagic = "NanoVDB";  ///< and a digit

Result<void> check_exists(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return make_error(ErrorCode::NotFound, fmt::format("{}: no such file", path.string()));
  if (fs::is_regular_file(status)) return {};
  return make_error(ErrorCode::Io, fmt::format("{}: is not a regular file", path.string()));
}

Result<SourceVolume> on_cubes(const fs::path& path, VolumeOnLattice&& read, const Job& job) {
  if (read.shape.is_cube()) return std::move(read.volume);
  auto cubes = resample_to_cubes(read.volume, read.shape, job);
  if (!cubes && cubes.error().code == ErrorCode::Unsupported)
    return make_error(cubes.error().code, fmt::format("{}: {}", path.string(), cubes.error().message));
  FARFIELD_TRY_LET(auto volume, std::move(cubes));
  volume.warnings.push_back(fmt::format("{}: {}", path.string(), resampling_text(read.shape)));
  return volume;
}

}  // namespace

Result<void> check_options(const FogOptions& options) {
  const auto invalid = [](const std::string& what) { return make_error(ErrorCode::InvalidArgument, what); };
  if (!(options.density_scale > 0) || !std::isfinite(options.density_scale))
    return invalid(fmt::format("--density-scale must be above 0 and finite, not {}", options.density_scale));
  if (!(std::abs(options.anisotropy) <= kMostAnisotropy))
    return invalid(fmt::format("--anisotropy must be from -{0} to {0}, not {1}", kMostAnisotropy, options.anisotropy));
  if (!(options.fibre_roughness >= 0 && options.fibre_roughness <= 1))
    return invalid(fmt::format("--fibre-roughness must be from 0 to 1, not {}", options.fibre_roughness));
  if (!options.albedo) return {};
  const vec3& albedo = *options.albedo;
  if (!is_finite(albedo) || min_component(albedo) < 0 || max_component(albedo) > 1)
    return invalid(fmt::format("--albedo must be from 0 to 1, not {},{},{}", albedo.x, albedo.y, albedo.z));
  return {};
}

std::string canonical_text(const FogOptions& options) {
  std::string text;
  if (!options.density_grid.empty()) text += fmt::format(" density_grid={}", options.density_grid);
  if (options.density_scale != 1) text += fmt::format(" density_scale={}", options.density_scale);
  if (options.albedo) text += fmt::format(" albedo={},{},{}", options.albedo->x, options.albedo->y, options.albedo->z);
  if (options.anisotropy != 0) text += fmt::format(" anisotropy={}", options.anisotropy);
  if (options.level_set) text += " level_set=1";
  if (options.fibre_roughness != kFibreRoughness) text += fmt::format(" fibre_roughness={}", options.fibre_roughness);
  return text;
}

uint64_t hash_of(const FogOptions& options) {
  const std::string text = canonical_text(options);
  return text.empty() ? 0 : hash_values(std::span<const char>(text));
}

bool is_volume_file(const fs::path& path) {
  std::array<char, 8> start{};
  std::ifstream stream(path, std::ios::binary);
  if (stream.read(start.data(), start.size()))
    return start == kVdbMagic || std::string_view(start.data(), kNanoVdbMagic.size()) == kNanoVdbMagic;
  const std::string extension = lower_case(path.extension().string());
  return extension == ".vdb" || extension == ".nvdb";
}

Result<VolumeExtent> read_volume_extent(const fs::path& path, const FogOptions& options) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY(check_exists(path));
  FARFIELD_TRY_LET(const VolumeModule* module, volume_module());
  return module->read_extent(path.string(), options);
}

Result<SourceVolume> read_volume(const fs::path& path, const FogOptions& options, const Job& job) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY(check_exists(path));
  FARFIELD_TRY_LET(const VolumeModule* module, volume_module());
  FARFIELD_TRY_LET(auto read, module->read(path.string(), options, job));
  FARFIELD_TRY_LET(auto volume, with_scratch([&] { return on_cubes(path, std::move(read), job); }));
  FARFIELD_TRY_LET(volume.source_hash, hash_volume(path, options));
  return volume;
}

Result<uint64_t> hash_volume(const fs::path& path, const FogOptions& options) {
  FARFIELD_TRY(check_exists(path));
  std::error_code ignored;
  FARFIELD_TRY_LET(const uint64_t bytes, hash_file(fs::canonical(path, ignored)));  // sources may be links
  return mix64(bytes, hash_of(options));
}

}  // namespace farfield
