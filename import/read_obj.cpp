// SPDX-License-Identifier: Apache-2.0
// OBJ. An own reader, because tinyobjloader cuts faces of more than 255 corners short, does not join continued lines,
// and needs three times as long; its MTL reader is used.
#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "base/hash.h"
#include "base/index.h"
#include "import/read_file.h"
#include "import/read_formats.h"
#include "import/text_cursor.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// Materials and textures of the libraries that an OBJ names, by name.
class MaterialLibraries {
 public:
  MaterialLibraries(fs::path folder, SourceMesh& mesh) : folder_(std::move(folder)), mesh_(mesh) {}

  /// The rest of an mtllib line: one name with blanks, or several names.
  void load(std::string_view names) {
    if (load_file(folder_ / clean(names))) return;
    TextCursor words(names);
    for (auto word = words.word(); !word.empty(); word = words.word()) {
      if (!load_file(folder_ / clean(word))) warn(fmt::format("material library {} cannot be read", word));
    }
  }

  /// Index of a material by name; unknown names are the default material, with one warning each.
  uint32_t find(std::string_view name) {
    const auto found = by_name_.find(name);
    if (found != by_name_.end()) return found->second;
    warn(fmt::format("material {} is not in any library that was read; default grey", name));
    return by_name_.emplace(std::string(name), default_material()).first->second;
  }

  uint32_t default_material() {
    if (default_ == kNoIndex) {
      default_ = static_cast<uint32_t>(mesh_.materials.size());
      mesh_.materials.emplace_back();
    }
    return default_;
  }

  /// An error once an image was wanted and none can be read: no fault of the file, so no case for plain colours.
  const Result<void>& ready() const { return ready_; }

 private:
  void warn(std::string text) { mesh_.warnings.push_back(std::move(text)); }

  static std::string clean(std::string_view name) {
    std::string text(name);
    std::replace(text.begin(), text.end(), '\\', '/');  // as exporters on Windows write it
    return text;
  }

  /// The file is part of the source, whether it is there or not.
  Result<std::vector<unsigned char>> read_noted_file(const fs::path& path) {
    auto bytes = read_file(path);
    const fs::path relative = path.lexically_relative(folder_);
    mesh_.source_files.push_back(
        {(relative.empty() ? path : relative).generic_string(), bytes ? hash_values<unsigned char>(*bytes) : 0});
    return bytes;
  }

  bool load_file(const fs::path& path) {
    auto bytes = read_noted_file(path);
    if (!bytes) bytes = read_noted_file(path.string() + ".gz");
    if (!bytes) return false;
    const std::string text(bytes->begin(), bytes->end());
    std::istringstream stream(text);
    std::map<std::string, int> names;
    std::vector<tinyobj::material_t> materials;
    std::string warnings, errors;
    tinyobj::LoadMtl(&names, &materials, &stream, &warnings, &errors);
    if (!errors.empty()) warn(fmt::format("{}: {}", path.string(), errors.substr(0, errors.find('\n'))));

    const bool is_blender = text.substr(0, 200).find("Blender") != std::string::npos;
    for (const auto& material : materials) {
      by_name_[material.name] = static_cast<uint32_t>(mesh_.materials.size());
      mesh_.materials.push_back(convert(material, path.parent_path(), is_blender));
    }
    return true;
  }

  static vec3 to_vec3(const tinyobj::real_t (&v)[3]) {
    vec3 out;
    for (int c = 0; c < 3; ++c) out[c] = std::isfinite(v[c]) ? std::clamp(static_cast<float>(v[c]), 0.0f, 1.0f) : 0.0f;
    return out;
  }

  SourceMaterial convert(const tinyobj::material_t& mtl, const fs::path& folder, bool is_blender) {
    SourceMaterial out;
    out.base_color = to_vec3(mtl.diffuse);
    out.alpha = std::isfinite(mtl.dissolve) ? std::clamp(static_cast<float>(mtl.dissolve), 0.0f, 1.0f) : 1.0f;
    set_specular(mtl, is_blender, out);
    if (!mtl.alpha_texname.empty()) {
      out.alpha_map = texture(mtl.alpha_texname, mtl.alpha_texopt, folder, TextureUse::Mask);
      out.is_masked = bool(out.alpha_map);
    } else if (out.alpha < 1.0f) {
      out.is_masked = true;
      warn(
          fmt::format("material {}: dissolve {} is cut at 0.5, there is no partial transparency", mtl.name, out.alpha));
    }
    if (!mtl.diffuse_texname.empty()) {
      out.base_color_map = texture(mtl.diffuse_texname, mtl.diffuse_texopt, folder, TextureUse::Color);
    }
    const auto& tf = mtl.transmittance;
    if (mtl.illum >= 4 && mtl.illum != 5 && mtl.illum != 8 && tf[0] + tf[1] + tf[2] > 0) {
      warn(fmt::format("material {}: transmission filter (Tf) is ignored", mtl.name));
    }
    return out;
  }

  /// Pr and Pm (the PBR extension) say it directly. Otherwise Blender writes its specular slider as Ks, F0 = 0.08 Ks,
  /// and Ns = 1000 (1 - roughness)^2; other programs mean Phong's reflectance and exponent, alpha^2 = 2 / (Ns + 2)
  /// [Walter et al. 2007], where alpha = roughness^2. illum 1 has no highlight.
  static void set_specular(const tinyobj::material_t& mtl, bool is_blender, SourceMaterial& out) {
    const vec3 ks = to_vec3(mtl.specular);
    const float ns = std::isfinite(mtl.shininess) ? std::clamp(static_cast<float>(mtl.shininess), 0.0f, 1e6f) : 0.0f;
    const bool is_pbr = mtl.roughness > 0 || mtl.metallic > 0;
    if (is_pbr) {
      out.roughness = std::clamp(static_cast<float>(mtl.roughness), 0.0f, 1.0f);
      out.metallic = std::clamp(static_cast<float>(mtl.metallic), 0.0f, 1.0f);
      out.dielectric_f0 = vec3(0.04f);
    } else if (mtl.illum == 1) {
      out.dielectric_f0 = vec3(0.0f);
    } else if (is_blender) {
      out.roughness = 1.0f - std::sqrt(std::min(ns, 1000.0f) / 1000.0f);
      out.dielectric_f0 = vec3(0.08f * (ks.x + ks.y + ks.z) / 3.0f);
    } else {
      out.roughness = std::pow(2.0f / (ns + 2.0f), 0.25f);
      out.dielectric_f0 = ks;
    }
  }

  SourceTexture texture(const std::string& name, const tinyobj::texture_option_t& option, const fs::path& folder,
                        TextureUse use) {
    const fs::path path = folder / clean(name);
    SourceTexture out;
    const auto key = std::make_pair(path.string(), use);
    const auto found = images_.find(key);
    if (found != images_.end()) {
      out.image = found->second;
    } else {
      (void)read_noted_file(path);
      auto image = read_texture(path, use);
      if (image) {
        out.image = std::make_shared<const Texture>(std::move(*image));
      } else {
        if (image.error().code == ErrorCode::Io) ready_ = tl::unexpected(image.error());
        warn(fmt::format("texture: {}; the plain colour is used", image.error().message));
      }
      images_.emplace(key, out.image);
    }
    if (option.clamp) out.wrap_u = out.wrap_v = Wrap::Clamp;
    if (option.scale[0] != 1 || option.scale[1] != 1 || option.origin_offset[0] != 0 || option.origin_offset[1] != 0) {
      warn(fmt::format("texture {}: the options -s and -o are ignored", name));
    }
    return out;
  }

  fs::path folder_;
  SourceMesh& mesh_;
  std::map<std::string, uint32_t, std::less<>> by_name_;
  std::map<std::pair<std::string, TextureUse>, std::shared_ptr<const Texture>> images_;
  uint32_t default_ = kNoIndex;
  Result<void> ready_;
};

class ObjReader {
 public:
  ObjReader(std::string_view text, const fs::path& path)
      : text_(text), name_(path.string()), materials_(path.parent_path(), mesh_) {}

  Result<SourceMesh> read() {
    while (!text_.at_end()) read_line();
    if (!materials_.ready()) return tl::unexpected(materials_.ready().error());
    if (mesh_.corner_count() > UINT32_MAX) {
      return make_error(ErrorCode::Unsupported, fmt::format("{}: more than 2^32 face corners", name_));
    }
    drop_faces_out_of_range();
    attach_colors();
    return std::move(mesh_);
  }

 private:
  void read_line() {
    const std::string_view keyword = text_.word();
    if (keyword == "v")
      read_position();
    else if (keyword == "vt")
      read_uv();
    else if (keyword == "f")
      read_face();
    else if (keyword == "usemtl")
      material_ = materials_.find(text_.rest_of_line());
    else if (keyword == "mtllib")
      materials_.load(text_.rest_of_line());
    else if (keyword.starts_with('#'))
      text_.rest_of_line();  // comments are not continued: they may end with a Windows path
    else
      skip_line();
  }

  /// To the next line; a backslash at the end of a line continues it.
  void skip_line() {
    while (!text_.at_end()) {
      const std::string_view line = text_.rest_of_line();
      if (line.empty() || line.back() != '\\') return;
    }
  }

  /// Skips blanks and, with them, line continuations.
  void skip_blanks() {
    text_.skip_blanks();
    while (text_.peek() == '\\') {
      text_.rest_of_line();
      text_.skip_blanks();
    }
  }

  bool number(double& value) {
    skip_blanks();
    return text_.number(value);
  }

  void read_position() {
    double v[7];
    int count = 0;
    while (count < 7 && number(v[count])) ++count;
    skip_line();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    // A line that is no position still counts, or all later indices would be off by one.
    mesh_.positions.push_back(count >= 3 ? dvec3(v[0], v[1], v[2]) : dvec3(nan));
    if (count < 6) return;
    // x y z r g b, or x y z w r g b
    colors_.resize(mesh_.positions.size(), vec3(1.0f));
    for (int c = 0; c < 3; ++c) {
      colors_.back()[c] = srgb_to_linear(
          static_cast<float>(std::isfinite(v[count - 3 + c]) ? std::clamp(v[count - 3 + c], 0.0, 1.0) : 0.0));
    }
  }

  void read_uv() {
    double u = 0, v = 0;
    if (number(u)) number(v);
    skip_line();
    uvs_.emplace_back(static_cast<float>(u), static_cast<float>(1.0 - v));  // OBJ's v points up
  }

  /// OBJ counts from 1, or back from the latest with negative numbers. Bad ones become kNoIndex.
  static uint32_t resolve(int64_t index, size_t count) {
    if (index < 0) index += static_cast<int64_t>(count) + 1;
    return index >= 1 && index < kNoIndex ? static_cast<uint32_t>(index - 1) : kNoIndex;
  }

  void read_face() {
    while (true) {
      skip_blanks();
      int64_t index = 0;
      if (!text_.integer(index)) break;
      mesh_.corner_position.push_back(resolve(index, mesh_.positions.size()));
      uint32_t uv = kNoIndex;
      if (text_.peek() == '/') {
        text_.advance();
        if (text_.peek() != '/' && is_digit(text_.peek()) && text_.integer(index)) uv = resolve(index, uvs_.size());
        if (text_.peek() == '/') {
          text_.advance();
          if (is_digit(text_.peek())) text_.integer(index);  // the normal: faces have their own
        }
      }
      corner_uv_index_.push_back(uv);
    }
    skip_line();
    if (material_ == kNoIndex) material_ = materials_.default_material();
    mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
    mesh_.face_material.push_back(material_);
  }

  static bool is_digit(char c) { return (c >= '0' && c <= '9') || c == '-' || c == '+'; }

  void drop_faces_out_of_range() {
    SourceMesh kept;
    size_t dropped = 0, corner_count = 0, face_count = 0;
    for (size_t face = 0; face < mesh_.face_count(); ++face) {
      const uint32_t begin = mesh_.face_begin[face], end = mesh_.face_begin[face + 1];
      const bool is_good = std::all_of(mesh_.corner_position.begin() + begin, mesh_.corner_position.begin() + end,
                                       [&](uint32_t index) { return index < mesh_.positions.size(); });
      if (!is_good) {
        ++dropped;
        continue;
      }
      // In place: what is kept never lies behind what is read. face_begin[face + 1] may be written only now.
      for (uint32_t i = begin; i < end; ++i, ++corner_count) {
        mesh_.corner_position[corner_count] = mesh_.corner_position[i];
        corner_uv_index_[corner_count] = corner_uv_index_[i];
      }
      mesh_.face_material[face_count] = mesh_.face_material[face];
      kept.face_begin.push_back(static_cast<uint32_t>(corner_count));
      ++face_count;
    }
    mesh_.corner_position.resize(corner_count);
    mesh_.face_material.resize(face_count);
    mesh_.face_begin = std::move(kept.face_begin);
    if (dropped > 0)
      mesh_.warnings.push_back(fmt::format("{} faces name vertices that do not exist; dropped", dropped));
    if (uvs_.empty()) return;
    mesh_.corner_uv.resize(corner_count);
    for (size_t i = 0; i < corner_count; ++i) {
      const uint32_t uv = corner_uv_index_[i];
      // NaN marks a corner without texture coordinate; the averages know it.
      mesh_.corner_uv[i] = uv < uvs_.size() ? uvs_[uv] : vec2(std::numeric_limits<float>::quiet_NaN());
    }
  }

  void attach_colors() {
    if (colors_.empty()) return;
    colors_.resize(mesh_.positions.size(), vec3(1.0f));
    mesh_.corner_color.reserve(mesh_.corner_count());
    for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_color.emplace_back(colors_[vertex], 1.0f);
    // Without a material the colour is the albedo itself, not a tint of the default grey.
    if (mesh_.materials.size() == 1 && material_ == materials_.default_material())
      mesh_.materials[0].base_color = vec3(1.0f);
  }

  TextCursor text_;
  std::string name_;
  SourceMesh mesh_;
  MaterialLibraries materials_;
  uint32_t material_ = kNoIndex;
  std::vector<vec2> uvs_;
  std::vector<vec3> colors_;
  std::vector<uint32_t> corner_uv_index_;
};

}  // namespace

Result<SourceMesh> read_obj(std::span<const unsigned char> bytes, const fs::path& path) {
  return ObjReader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path).read();
}

}  // namespace farfield
