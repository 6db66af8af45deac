// SPDX-License-Identifier: Apache-2.0
#include "cache/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/json_words.h"
#include "base/text.h"
#include "cache/json_reader.h"
#include "cache/material_json.h"

namespace farfield {

namespace fs = std::filesystem;
namespace {

constexpr uint64_t kMaxManifestBytes = uint64_t{4} << 20;
constexpr size_t kMaxLevels = 64;  // each level halves the resolution: no double has more
constexpr size_t kMaxHullPoints = 1 << 13;
constexpr uint64_t kMaxBytes = uint64_t{1} << 50;
constexpr uint64_t kMaxElementsOfLevel = uint64_t{1} << 32;
constexpr size_t kMaxSourceFiles = 1 << 13;
constexpr size_t kMaxWarnings = 64;
constexpr int kMaxDepth = 16;  // of nesting; ours is 5

// ---- what must hold, for reading and for writing ----

/// A level's file lies in the asset's folder under a plain, visible name.
bool is_plain_file_name(const std::string& name) {
  const auto forbidden = [](char c) { return c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20; };
  return !name.empty() && name.size() <= 200 && name[0] != '.' && name != kManifestName &&
         std::ranges::none_of(name, forbidden);
}

/// Text from a file as one short line of a message.
std::string printable(std::string_view text) {
  constexpr size_t kLongest = 200;
  const std::string line = without_controls(text.substr(0, kLongest));
  return text.size() > kLongest ? line + "..." : line;
}

bool are_finite(const LevelErrors& errors) {
  bool finite = std::isfinite(errors.occlusion_error);
  for (const ErrorSize& size : {errors.occlusion_rms, errors.color_error})
    finite = finite && std::isfinite(size.value.value_or(0.0)) && std::isfinite(size.low) && std::isfinite(size.high);
  return finite;
}

Problem find_level_problem(const LevelEntry& level) {
  if (level.level >= kMaxLevels) return fmt::format("level numbers end at {}", kMaxLevels - 1);
  if (!std::isfinite(level.resolution) || !(level.resolution > 0)) return "its resolution is not positive";
  if (!is_plain_file_name(level.file)) {
    return fmt::format("\"{}\" is not a file name inside the folder", printable(level.file));
  }
  const LevelCost morph = level.morph.value_or(LevelCost());
  for (const uint64_t bytes :
       {level.file_bytes, level.resident_bytes, level.build_peak_bytes, morph.resident_bytes, morph.build_peak_bytes}) {
    if (bytes > kMaxBytes) return fmt::format("{} bytes are more than any level has", bytes);
  }
  for (const uint64_t count : {level.triangles, level.placements, level.voxels, level.bricks}) {
    if (count > kMaxElementsOfLevel) return fmt::format("{} elements are more than any level has", count);
  }
  if (!std::isfinite(level.ray_cost) || level.ray_cost < 0) return "its ray_cost is negative or not finite";
  if (level.errors) {
    if (!are_finite(*level.errors)) return "its errors are not finite";
  }
  return {};
}

bool is_orthogonal(const glm::dmat3& m) {
  constexpr double kTolerance = 1e-6;
  const glm::dmat3 difference = glm::transpose(m) * m - glm::dmat3(1.0);
  for (int column = 0; column < 3; ++column) {
    const dvec3 size = glm::abs(difference[column]);
    if (!(std::max({size.x, size.y, size.z}) <= kTolerance)) return false;  // NaN, too
  }
  return true;
}

Problem find_problem(const Manifest& manifest) {
  if (!is_finite(manifest.bounds.lower) || !is_finite(manifest.bounds.upper) || manifest.bounds.is_empty()) {
    return "the bounds are empty or not finite";
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(manifest.origin[axis])) return "the origin is not finite";
  }
  if (!is_orthogonal(manifest.rotation)) return "the rotation is none";
  if (!std::isfinite(manifest.base_resolution) || !(manifest.base_resolution > 0)) {
    return "base_resolution is not positive";
  }
  if (manifest.hull.size() > kMaxHullPoints) return fmt::format("the hull has more than {} points", kMaxHullPoints);
  if (!std::ranges::all_of(manifest.hull, is_finite)) return "a hull point is not finite";
  if (manifest.source_files && manifest.source_files->size() > kMaxSourceFiles) {
    return fmt::format("there are more than {} source files", kMaxSourceFiles);
  }
  if (Problem problem = find_material_problem(manifest)) return problem;
  if (manifest.warnings.size() > kMaxWarnings) return fmt::format("there are more than {} warnings", kMaxWarnings);
  if (manifest.levels.empty()) return "there are no levels";
  if (manifest.levels.size() > kMaxLevels) {
    return fmt::format("there are {} levels, and at most {} are possible", manifest.levels.size(), kMaxLevels);
  }
  std::set<std::string> files;
  for (const AssetTexture& texture : manifest.textures) {
    if (!is_plain_file_name(texture.file)) {
      return fmt::format("\"{}\" is not a file name inside the folder", printable(texture.file));
    }
    if (!files.insert(texture.file).second) return fmt::format("\"{}\" serves two textures", texture.file);
  }
  for (size_t i = 0; i < manifest.levels.size(); ++i) {
    const LevelEntry& level = manifest.levels[i];
    if (Problem problem = find_level_problem(level)) return fmt::format("levels[{}]: {}", i, *problem);
    if (i > 0 && level.level <= manifest.levels[i - 1].level) {
      return fmt::format("levels[{}]: level {} follows level {}", i, level.level, manifest.levels[i - 1].level);
    }
    if (i > 0 && !(level.resolution > manifest.levels[i - 1].resolution)) {
      return fmt::format("levels[{}]: its resolution is not coarser than the one before", i);
    }
    if (!files.insert(level.file).second) return fmt::format("levels[{}]: \"{}\" serves two levels", i, level.file);
  }
  return {};
}

// ---- JSON to values ----

/// How deep the brackets of a JSON text nest. The parser itself does not recurse, but it takes a hundred bytes of
/// memory for each bracket.
int nesting_depth(std::string_view text) {
  int depth = 0, deepest = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') ++i;  // the next character is escaped
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  return deepest;
}

/// A number, or null where noise hides it: then the bounds stand beside it.
ErrorSize error_size_from_json(const Json& json, const std::string& name, const std::string& where, FieldReader& read) {
  const Json* value = read.field(json, name.c_str(), where);
  if (value == nullptr) return {};
  if (!value->is_null()) return read.number(json, name.c_str(), where);
  const std::string bounds_name = name + "_bounds";
  const Json* bounds = read.field(json, bounds_name.c_str(), where);
  if (bounds == nullptr) return {};
  const double low = read.number(*bounds, "low", where + "." + bounds_name);
  return ErrorSize::unknown(low, read.number(*bounds, "high", where + "." + bounds_name));
}

LevelErrors errors_from_json(const Json& json, const std::string& where, FieldReader& read) {
  LevelErrors errors;
  errors.occlusion_error = read.number(json, "occlusion_error", where);
  errors.occlusion_rms = error_size_from_json(json, "occlusion_rms", where, read);
  errors.color_error = error_size_from_json(json, "color_error", where, read);
  return errors;
}

LevelEntry level_from_json(const Json& json, const std::string& where, FieldReader& read) {
  LevelEntry level;
  level.level = read.count32(json, "level", where);
  level.resolution = read.number(json, "resolution", where);
  level.grid = read.count32(json, "grid", where);
  level.file = read.text(json, "file", where);
  level.file_bytes = read.count(json, "file_bytes", where);
  level.file_hash = read.hash(json, "file_hash", where);
  level.triangles = read.count(json, "triangles", where);
  if (json.is_object() && json.contains("placements")) level.placements = read.count(json, "placements", where);
  level.voxels = read.count(json, "voxels", where);
  level.bricks = read.count(json, "bricks", where);
  level.resident_bytes = read.count(json, "resident_bytes", where);
  level.build_peak_bytes = read.count(json, "build_peak_bytes", where);
  if (json.is_object() && json.contains("ray_cost")) level.ray_cost = read.number(json, "ray_cost", where);
  if (json.is_object() && json.contains("morph_resident_bytes")) {
    level.morph = {read.count(json, "morph_resident_bytes", where), read.count(json, "morph_build_peak_bytes", where)};
  }
  if (json.is_object() && json.contains("errors")) {
    level.errors = errors_from_json(json["errors"], where + ".errors", read);
  }
  return level;
}

std::vector<HashedFile> files_from_json(const Json& json, FieldReader& read) {
  std::vector<HashedFile> files;
  for (const Json& file : read.array(json, "source_files")) {
    if (read.problem || files.size() > kMaxSourceFiles) break;
    const std::string where = fmt::format("source_files[{}]", files.size());
    files.push_back({read.text(file, "file", where), read.hash(file, "hash", where)});
  }
  return files;
}

std::vector<std::string> warnings_from_json(const Json& json, FieldReader& read) {
  std::vector<std::string> warnings;
  for (const Json& warning : read.array(json, "warnings")) {
    if (read.problem || warnings.size() > kMaxWarnings) break;
    warnings.push_back(read.text(warning, fmt::format("warnings[{}]", warnings.size())));
  }
  return warnings;
}

/// Three columns.
glm::dmat3 rotation_from_json(const Json& json, FieldReader& read) {
  glm::dmat3 rotation(0.0);
  int column = 0;
  for (const Json& axis : read.array(json, "rotation")) {
    if (read.problem || column == 3) break;
    rotation[column] = read.point(axis, fmt::format("rotation[{}]", column));
    ++column;
  }
  return rotation;
}

Manifest manifest_from_json(const Json& json, FieldReader& read) {
  Manifest manifest;
  manifest.generator = read.text(json, "generator");
  manifest.source = read.text(json, "source");
  manifest.source_hash = read.hash(json, "source_hash");
  if (json.is_object() && json.contains("source_files")) manifest.source_files = files_from_json(json, read);
  manifest.options = read.text(json, "options");
  manifest.origin = read.point(json, "origin");
  if (json.is_object() && json.contains("rotation")) manifest.rotation = rotation_from_json(json, read);
  manifest.bounds.lower = vec3(read.point(json, "bounds_lower"));
  manifest.bounds.upper = vec3(read.point(json, "bounds_upper"));
  manifest.base_resolution = read.number(json, "base_resolution", "");
  for (const Json& point : read.array(json, "hull")) {
    if (read.problem || manifest.hull.size() > kMaxHullPoints) break;
    manifest.hull.push_back(vec3(read.point(point, fmt::format("hull[{}]", manifest.hull.size()))));
  }
  if (json.is_object() && json.contains("textures")) manifest.textures = textures_from_json(json, read);
  if (json.is_object() && json.contains("materials")) manifest.materials = materials_from_json(json, read);
  if (json.is_object() && json.contains("warnings")) manifest.warnings = warnings_from_json(json, read);
  const Json& levels = read.array(json, "levels");
  if (levels.size() > kMaxLevels) {
    read.problem = fmt::format("there are {} levels, and at most {} are possible", levels.size(), kMaxLevels);
  }
  for (size_t i = 0; i < levels.size() && !read.problem; ++i) {
    manifest.levels.push_back(level_from_json(levels[i], fmt::format("levels[{}]", i), read));
  }
  return manifest;
}

// ---- values to JSON ----

OrderedJson to_json(const dvec3& point) { return OrderedJson::array({point.x, point.y, point.z}); }

OrderedJson to_json(const std::vector<HashedFile>& files) {
  OrderedJson json = OrderedJson::array();
  for (const HashedFile& file : files) json.push_back({{"file", file.path}, {"hash", to_hex(file.hash)}});
  return json;
}

void add_error_size(OrderedJson& json, const std::string& name, const ErrorSize& size) {
  json[name] = size.value ? OrderedJson(*size.value) : OrderedJson();
  if (!size.value) json[name + "_bounds"] = {{"low", size.low}, {"high", size.high}};
}

OrderedJson to_json(const LevelEntry& level) {
  OrderedJson json = {{"level", level.level},
                      {"resolution", level.resolution},
                      {"grid", level.grid},
                      {"file", level.file},
                      {"file_bytes", level.file_bytes},
                      {"file_hash", to_hex(level.file_hash)},
                      {"triangles", level.triangles},
                      {"voxels", level.voxels},
                      {"bricks", level.bricks},
                      {"resident_bytes", level.resident_bytes},
                      {"build_peak_bytes", level.build_peak_bytes}};
  if (level.placements != 0) json["placements"] = level.placements;
  if (level.ray_cost != 0) json["ray_cost"] = level.ray_cost;
  if (level.morph) {
    json["morph_resident_bytes"] = level.morph->resident_bytes;
    json["morph_build_peak_bytes"] = level.morph->build_peak_bytes;
  }
  if (level.errors) {
    OrderedJson errors = {{"occlusion_error", level.errors->occlusion_error}};
    add_error_size(errors, "occlusion_rms", level.errors->occlusion_rms);
    add_error_size(errors, "color_error", level.errors->color_error);
    json["errors"] = errors;
  }
  return json;
}

}  // namespace

Box3 in_source_space(const Box3& bounds, const Manifest& manifest) {
  if (bounds.is_empty()) return bounds;
  Box3 box;
  for (int i = 0; i < 8; ++i) box.extend(vec3(manifest.origin + manifest.rotation * dvec3(bounds.corner(i))));
  return box;
}

std::string manifest_to_json(const Manifest& manifest) {
  OrderedJson hull = OrderedJson::array();
  for (const vec3& point : manifest.hull) hull.push_back(to_json(dvec3(point)));
  OrderedJson levels = OrderedJson::array();
  for (const LevelEntry& level : manifest.levels) levels.push_back(to_json(level));
  const bool is_of_version_1 = manifest.materials.empty() && manifest.textures.empty();
  OrderedJson json = {{"version", is_of_version_1 ? 1 : kFormatVersion},
                      {"generator", manifest.generator},
                      {"source", manifest.source},
                      {"source_hash", to_hex(manifest.source_hash)},
                      {"options", manifest.options},
                      {"origin", to_json(manifest.origin)},
                      {"bounds_lower", to_json(dvec3(manifest.bounds.lower))},
                      {"bounds_upper", to_json(dvec3(manifest.bounds.upper))},
                      {"base_resolution", manifest.base_resolution},
                      {"levels", std::move(levels)},
                      {"hull", std::move(hull)}};
  if (manifest.rotation != glm::dmat3(1.0)) {
    json["rotation"] = {to_json(manifest.rotation[0]), to_json(manifest.rotation[1]), to_json(manifest.rotation[2])};
  }
  if (manifest.source_files) json["source_files"] = to_json(*manifest.source_files);
  if (!manifest.textures.empty()) json["textures"] = to_json(manifest.textures);
  if (!manifest.materials.empty()) json["materials"] = to_json(manifest.materials);
  if (!manifest.warnings.empty()) json["warnings"] = manifest.warnings;
  // `replace`: a source's file name need not be UTF-8, JSON must be.
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

namespace {

constexpr std::string_view kTextEnd = "\n}\n";
constexpr std::string_view kChecksumBegin = ",\n  \"checksum\": \"";

/// How a text ends that has the hash of all that comes before.
std::string end_with_checksum(std::string_view body) {
  return fmt::format("{}{}\"{}", kChecksumBegin, to_hex(hash_values(std::span(body))), kTextEnd);
}

bool is_checksum_right(std::string_view text) {
  const size_t end = text.rfind(kChecksumBegin);
  return end != std::string_view::npos && text.substr(end) == end_with_checksum(text.substr(0, end));
}

}  // namespace

Result<Manifest> manifest_from_json(std::string_view text, std::string_view name) {
  const auto broken = [&](std::string_view problem) {
    return make_error(ErrorCode::BadFile, fmt::format("broken manifest {}: {}; bake the asset again", name, problem));
  };
  if (nesting_depth(text) > kMaxDepth) return broken(fmt::format("it is nested deeper than {}", kMaxDepth));
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::exception& error) {  // the only way to learn where the syntax is wrong
    return broken(printable(json_words(error.what())));
  }

  FieldReader read;
  const uint64_t version = read.count(json, "version");
  if (!read.problem && version > static_cast<uint64_t>(kFormatVersion)) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{} has format version {}, and this Farfield reads up to {}: use a newer Farfield",
                                  name, version, kFormatVersion));
  }
  if (!read.problem && version == 0) read.problem = "the format version is 0";
  const bool has_checksum = json.contains("checksum");
  if (!read.problem && has_checksum && !is_checksum_right(text)) {
    read.problem = "its checksum is wrong, it was changed since it was written";
  }
  Manifest manifest = manifest_from_json(json, read);
  if (!read.problem) read.problem = find_problem(manifest);
  if (read.problem) return broken(*read.problem);
  manifest.version = static_cast<int>(version);
  manifest.has_checksum = has_checksum;
  return manifest;
}

Result<Manifest> read_manifest(const fs::path& asset_dir) {
  const fs::path path = asset_dir / kManifestName;
  const Result<std::string> text = read_small_file(path, kMaxManifestBytes);
  if (!text && text.error().code == ErrorCode::NotFound) {
    return make_error(ErrorCode::NotFound, fmt::format("{} is not a baked asset: it has no {}; make one with "
                                                       "`farfield bake SOURCE -o NAME.farfield`",
                                                       asset_dir.string(), kManifestName));
  }
  if (!text) return tl::unexpected(text.error());
  return manifest_from_json(*text, path.string());
}

ManifestWriter manifest_writer(const fs::path& asset_dir) {
  const Result<std::string> text = read_small_file(asset_dir / kManifestName, kMaxManifestBytes);
  if (!text) return ManifestWriter::Unknown;
  if (nesting_depth(*text) > kMaxDepth) return ManifestWriter::Other;
  const Json json = Json::parse(*text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return ManifestWriter::Unknown;
  FieldReader read;
  return read.text(json, "generator").starts_with("farfield ") ? ManifestWriter::Farfield : ManifestWriter::Other;
}

Result<void> write_manifest(const fs::path& asset_dir, const Manifest& manifest) {
  const fs::path path = asset_dir / kManifestName;
  if (const Problem problem = find_problem(manifest)) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("cannot write {}: {}", path.string(), *problem));
  }
  std::string text = manifest_to_json(manifest);
  text.resize(text.size() - kTextEnd.size());
  text += end_with_checksum(text);
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  return write_file_atomically(path, std::span(&bytes, 1));
}

}  // namespace farfield
