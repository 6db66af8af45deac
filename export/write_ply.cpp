// SPDX-License-Identifier: Apache-2.0
// PLY, binary: the format that has room for everything that a face has, since readers skip properties that they do not
// know.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <functional>

#include "base/srgb.h"
#include "base/temporary_file.h"
#include "base/text.h"
#include "cache/level_values.h"
#include "export/face_looks.h"
#include "export/surface_writers.h"

namespace farfield {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they lie in memory");

/// Some properties of faces, all floats, and their values.
struct FaceProperties {
  std::vector<std::string> names;
  std::function<void(uint32_t face, float* values)> fill;
};

void put_color(float* values, const vec3& color) { values[0] = color.x, values[1] = color.y, values[2] = color.z; }

std::vector<std::string> of_channels(const std::string& name) { return {name + "_red", name + "_green", name + "_blue"}; }

FaceProperties color_property(const std::string& name, ArrayView<PackedColor> colors) {
  return {of_channels(name), [colors](uint32_t f, float* values) { put_color(values, color_at(colors, f)); }};
}

/// What the level has beside a colour; absent arrays have no properties.
std::vector<FaceProperties> properties_of(const LevelOfAsset& from) {
  const LevelView& level = from.level;
  std::vector<FaceProperties> all;
  if (!level.face_specular.empty()) {
    all.push_back(color_property("specular", level.face_specular));
    all.push_back({{"roughness"}, [level](uint32_t f, float* values) {
                     *values = std::sqrt(std::sqrt(unorm_at(level.face_roughness2, f)));
                   }});
  }
  if (!level.face_transmission.empty()) all.push_back(color_property("transmission", level.face_transmission));
  if (!level.face_emission.empty()) {
    all.push_back({of_channels("emission"), [level](uint32_t f, float* values) {
                     put_color(values, emission_at(level.face_emission, f));
                   }});
  }
  if (!level.face_opacity.empty())
    all.push_back({{"opacity"}, [level](uint32_t f, float* values) { *values = unorm_at(level.face_opacity, f); }});
  if (!level.face_gap.empty())
    all.push_back({{"gap"}, [level](uint32_t f, float* values) { *values = unorm_at(level.face_gap, f); }});
  if (!level.face_sggx.empty()) {
    const mat3 rotation(from.manifest.rotation);
    all.push_back({{"sggx_xx", "sggx_yy", "sggx_zz", "sggx_xy", "sggx_xz", "sggx_yz"},
                   [level, rotation](uint32_t f, float* values) {
                     const SymMat3 s = congruence(rotation, unpack(level.face_sggx[f]));
                     put_color(values, vec3(s.xx, s.yy, s.zz));
                     put_color(values + 3, vec3(s.xy, s.xz, s.yz));
                   }});
  }
  return all;
}

std::string header_of(const LevelOfAsset& from, size_t faces, const std::vector<FaceProperties>& properties) {
  const char* number = from.is_in_place() ? "float" : "double";
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment {}: level {} of {}, resolution {}\n"
      "comment colours are diffuse albedos, sRGB; other properties are linear\n"
      "element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\nelement face {}\n"
      "property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
      kExportGenerator, from.entry.level, without_controls(from.manifest.source), from.entry.resolution,
      from.level.positions.size(), number, number, number, faces);
  for (const FaceProperties& some : properties)
    for (const std::string& name : some.names) text += fmt::format("property float {}\n", name);
  return text + "end_header\n";
}

/// Values as bytes, one behind the other.
class Record {
 public:
  template <typename T>
  void add(const T& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void write_to(TemporaryFile& file) {
    file.write(bytes_);
    bytes_.clear();
  }

 private:
  std::vector<std::byte> bytes_;
};

void write_vertices(const LevelOfAsset& from, TemporaryFile& file) {
  Record record;
  for (const vec3& position : from.level.positions) {
    if (from.is_in_place())
      record.add(position);
    else
      record.add(from.to_source(position));
    record.write_to(file);
  }
}

void write_faces(const LevelView& level, const std::vector<uvec3>& corners,
                 const std::vector<FaceProperties>& properties, TemporaryFile& file) {
  Record record;
  float values[6];
  for (uint32_t f = 0; f < corners.size(); ++f) {
    record.add(uint8_t{3});
    record.add(corners[f]);
    const vec3 color = color_at(level.face_diffuse, f);
    for (int c = 0; c < 3; ++c) record.add(srgb_byte(color[c]));
    for (const FaceProperties& some : properties) {
      some.fill(f, values);
      for (size_t i = 0; i < some.names.size(); ++i) record.add(values[i]);
    }
    record.write_to(file);
  }
}

}  // namespace

Result<WrittenSurface> write_ply(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job) {
  const LevelView& level = from.level;
  if (level.positions.size() > INT32_MAX)
    return make_error(ErrorCode::Unsupported, fmt::format("{}: more than 2^31 vertices; export a coarser level",
                                                          path.string()));
  const std::vector<uvec3> corners = face_corners(level);
  const std::vector<FaceProperties> properties = properties_of(from);
  TemporaryFile file(path);
  const std::string header = header_of(from, corners.size(), properties);
  file.write(std::as_bytes(std::span(header)));
  write_vertices(from, file);
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "export: cancelled");
  write_faces(level, corners, properties, file);
  FARFIELD_TRY(file.commit());
  WrittenSurface written{corners.size(), level.positions.size(), 0, {}};
  if (!level.shading_normal.empty()) written.notes.push_back("smooth normals are left out");
  return written;
}

}  // namespace farfield
