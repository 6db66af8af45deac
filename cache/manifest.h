// SPDX-License-Identifier: Apache-2.0
// manifest.json of a baked asset: what was baked from what, and what each level costs and misses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/hash.h"
#include "base/result.h"
#include "base/vec.h"
#include "cache/asset_material.h"
#include "cache/level.h"

namespace farfield {

inline constexpr int kFormatVersion = 2;  ///< 1 had neither materials nor textures
inline constexpr const char* kManifestName = "manifest.json";

/// The size of an error, >= 0; where noise hides it, what it lies between.
struct ErrorSize {
  std::optional<double> value;
  double low = 0, high = 0;  ///< bounds; the value itself if it is known

  ErrorSize() = default;
  ErrorSize(double known) : value(known), low(known), high(known) {}  // NOLINT: a number is one that is known
  static ErrorSize unknown(double low, double high) {
    ErrorSize size;
    size.low = low, size.high = high;
    return size;
  }
};

/// Errors of a level as docs/error_metric.md defines them, fractions; absent until `farfield evaluate` has run.
struct LevelErrors {
  double occlusion_error = 0;  ///< signed
  ErrorSize occlusion_rms;
  ErrorSize color_error;
};

/// One level's row of the manifest.
struct LevelEntry {
  uint32_t level = 0;
  double resolution = 0;  ///< r_k, local units
  uint32_t grid = 0;      ///< longest side of the bounds / r_k, rounded
  std::string file;       ///< name inside the asset's folder
  uint64_t file_bytes = 0;
  uint64_t file_hash = 0;   ///< XXH3 of the whole file
  uint64_t triangles = 0;   ///< those of parts once, in however many places they stand
  uint64_t placements = 0;  ///< of parts (PartPlacement)
  uint64_t voxels = 0;
  uint64_t bricks = 0;
  uint64_t resident_bytes = 0;     ///< bytes of the file that stay, plus BVH, once loaded
  uint64_t build_peak_bytes = 0;   ///< further bytes needed while the BVH is built
  double ray_cost = 0;             ///< work of a ray (bvh/ray_cost.h), >= 0; 0: not recorded
  std::optional<LevelCost> morph;  ///< what the morph from the next finer stored level takes; absent: not recorded
  std::optional<LevelErrors> errors;
};

/// The manifest. Levels are sorted by `level`; level 0 is the source. A level that would save nothing over a finer one
/// is not written, so numbers may have gaps; the last one is the root.
struct Manifest {
  int version = kFormatVersion;
  std::string generator;     ///< "farfield 0.1.0"
  std::string source;        ///< file name (no folders) of the source
  uint64_t source_hash = 0;  ///< XXH3 of the source's bytes and of the files it refers to
  /// Those files, relative to the source's folder; absent in manifests of earlier versions.
  std::optional<std::vector<HashedFile>> source_files;
  std::vector<std::string> warnings;  ///< what the import dropped, missed or ignored, one line each
  std::string options;         ///< canonical text of the bake options, so that equal text and hash mean equal bytes
  dvec3 origin{0.0};           ///< positions are relative to this point of the source's space
  glm::dmat3 rotation{1.0};    ///< of them there: a point of the source is origin + rotation * position. Orthogonal
  Box3 bounds;                 ///< of all levels, relative to origin
  double base_resolution = 0;  ///< r_0
  std::vector<vec3> hull;      ///< points whose convex hull contains all levels (tight instance bounds)
  std::vector<AssetTexture> textures;
  std::vector<AssetMaterial> materials;  ///< LevelArrays::face_material indexes it
  std::vector<LevelEntry> levels;
  bool has_checksum = false;  ///< it was read from a file that has one, and that is right; older ones have none
};

/// The box in the source's space around a box of positions.
Box3 in_source_space(const Box3& bounds, const Manifest& manifest);

/// Reads DIR/manifest.json. Untrusted: sizes, ranges and names are checked (a level's file may not leave the folder).
/// Every byte size is at most 2^50, so that sums over assets cannot overflow.
/// Errors: NotFound, Io, BadFile (also a file that was changed since it was written), Unsupported (newer format
/// version).
Result<Manifest> read_manifest(const std::filesystem::path& asset_dir);

/// Whose DIR/manifest.json is, however damaged or new: browsers, package managers and others write files of this name.
enum class ManifestWriter {
  Farfield,  ///< JSON that names Farfield as its generator
  Other,     ///< other JSON
  Unknown,   ///< no readable file, or no JSON: half a file, zeros
};
ManifestWriter manifest_writer(const std::filesystem::path& asset_dir);

/// Writes DIR/manifest.json atomically (temporary name, sync, rename), with a checksum of its text at the end. Errors:
/// Io, InvalidArgument (a manifest that read_manifest() would refuse).
Result<void> write_manifest(const std::filesystem::path& asset_dir, const Manifest& manifest);

/// The same without files: the text of a manifest, without a checksum, and the manifest of a text, whose checksum must
/// be right if it has one. name: for messages.
std::string manifest_to_json(const Manifest& manifest);
Result<Manifest> manifest_from_json(std::string_view text, std::string_view name);

}  // namespace farfield
