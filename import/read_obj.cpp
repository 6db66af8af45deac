// SPDX-License-Identifier: Apache-2.0
// OBJ. An own reader, because tinyobjloader cuts faces of more than 255 corners short, does not join continued lines,
// and needs three times as long.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "base/index.h"
#include "base/result.h"
#include "import/cage_tags.h"
#include "import/corner_normals.h"
#include "import/material_library.h"
#include "import/read_formats.h"
#include "import/text_cursor.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

class ObjReader {
 public:
  ObjReader(std::string_view text, const fs::path& path)
      : begin_(text.data()),
        text_(without_byte_order_mark(text)),
        name_(path.string()),
        materials_(path.parent_path(), mesh_) {}

  Result<SourceMesh> read() { return with_warnings(read_all(), mesh_.warnings); }

 private:
  Result<SourceMesh> read_all() {
    while (!text_.at_end()) read_line();
    FARFIELD_TRY(materials_.finish());
    if (mesh_.corner_count() > UINT32_MAX) {
      return make_error(ErrorCode::Unsupported, fmt::format("{}: more than 2^32 face corners", name_));
    }
    drop_faces_out_of_range();
    drop_bad_tags();
    attach_uvs();
    attach_normals();
    attach_colors();
    say_what_was_ignored();
    return std::move(mesh_);
  }

  /// What is to be said once, however often it is met.
  struct Ignored {
    size_t count = 0;
    const char* at = nullptr;  ///< in the text, where it stands first
  };

  static void note(Ignored& ignored, const char* at) {
    if (ignored.count++ == 0) ignored.at = at;
  }

  void read_line() {
    const std::string_view keyword = text_.word();
    if (keyword == "v")
      read_position();
    else if (keyword == "vt")
      read_uv();
    else if (keyword == "vn")
      read_normal();
    else if (keyword == "f" || keyword == "fo")  // as it was called once
      read_face();
    else if (keyword == "s")
      read_smoothing_group();
    else if (keyword == "usemtl")
      material_ = materials_.find(text_.rest_of_line());
    else if (keyword == "mtllib")
      materials_.load(text_.rest_of_line());
    else if (keyword == "t")
      read_tag(keyword.data());
    else if (keyword == "#MRGB")
      read_polypaint();
    else if (keyword.starts_with('#'))
      text_.rest_of_line();  // comments are not continued: they may end with a Windows path
    else
      read_without_effect(keyword);
  }

  /// Names of groups and objects mean nothing here; whatever else is left out is counted, to be said once.
  void read_without_effect(std::string_view keyword) {
    if (!keyword.empty() && keyword != "g" && keyword != "o") {
      note(ignored_[std::string(keyword)], keyword.data());
    }
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
    const char* line = text_.position();
    double v[7];
    int count = 0;
    while (count < 7 && number(v[count])) ++count;
    skip_line();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    // A line that is no position still counts, or all later indices would be off by one.
    mesh_.positions.push_back(count >= 3 ? dvec3(v[0], v[1], v[2]) : dvec3(nan));
    if (count < 3) note(no_position_, line);
    if (count < 6) return;
    // x y z r g b, or x y z w r g b
    colors_.resize(mesh_.positions.size(), vec3(1.0f));
    for (int c = 0; c < 3; ++c) {
      const double value = v[count - 3 + c];
      colors_.back()[c] = std::isfinite(value) && value > 0 ? static_cast<float>(std::min(value, 1e30)) : 0.0f;
    }
  }

  /// Of a subdivision cage.
  void read_tag(const char* at) {
    const std::string_view line = text_.rest_of_line();
    const std::string wrong = read_cage_tag(line, mesh_.cage);
    if (wrong.empty()) return;
    const std::string_view name = line.substr(0, line.find(' '));
    note(ignored_[fmt::format("t {}, which {},", name, wrong)], at);
  }

  /// ZBrush paints vertices in comments: after each block of vertices their masks and colours, as MMRRGGBB.
  void read_polypaint() {
    for (std::string_view digits = text_.rest_of_line(); digits.size() >= 8; digits.remove_prefix(8)) {
      uint32_t color = 0;
      const auto [stop, error] = std::from_chars(digits.data(), digits.data() + 8, color, 16);
      if (error != std::errc() || stop != digits.data() + 8) return;
      if (painted_.size() >= mesh_.positions.size()) return;  // colours of no vertex
      painted_.push_back(vec3((color >> 16) & 255, (color >> 8) & 255, color & 255) / 255.0f);
    }
  }

  void read_uv() {
    double u = 0, v = 0;
    if (number(u)) number(v);
    skip_line();
    uvs_.emplace_back(static_cast<float>(u), static_cast<float>(1.0 - v));  // OBJ's v points up
  }

  void read_normal() {
    double n[3]{};
    for (int c = 0; c < 3 && number(n[c]); ++c) {
    }
    skip_line();
    normals_.push_back(unit_normal(dvec3(n[0], n[1], n[2])));
  }

  /// A number, or "off". Some exporters write "on".
  void read_smoothing_group() {
    skip_blanks();
    int64_t group = 0;
    if (!text_.integer(group)) group = text_.word() == "on" ? 1 : 0;
    smoothing_group_ = static_cast<uint32_t>(std::clamp<int64_t>(group, 0, UINT32_MAX));
    skip_line();
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
      uint32_t uv = kNoIndex, normal = kNoIndex;
      if (text_.peek() == '/') {
        text_.advance();
        if (text_.peek() != '/' && is_digit(text_.peek()) && text_.integer(index)) uv = resolve(index, uvs_.size());
        if (text_.peek() == '/') {
          text_.advance();
          if (is_digit(text_.peek()) && text_.integer(index)) normal = resolve(index, normals_.size());
        }
      }
      corner_uv_index_.push_back(uv);
      corner_normal_index_.push_back(normal);
    }
    skip_line();
    if (material_ == kNoIndex) material_ = materials_.default_material();
    mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
    mesh_.face_material.push_back(material_);
    face_group_.push_back(smoothing_group_);
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
        corner_normal_index_[corner_count] = corner_normal_index_[i];
      }
      mesh_.face_material[face_count] = mesh_.face_material[face];
      face_group_[face_count] = face_group_[face];
      kept.face_begin.push_back(static_cast<uint32_t>(corner_count));
      kept_faces_.push_back(static_cast<uint32_t>(face));
      ++face_count;
    }
    mesh_.corner_position.resize(corner_count);
    mesh_.face_material.resize(face_count);
    face_group_.resize(face_count);
    mesh_.face_begin = std::move(kept.face_begin);
    if (dropped > 0)
      mesh_.warnings.push_back(fmt::format("{} faces name vertices that do not exist; dropped", dropped));
  }

  /// Tags number faces as the file does; those that were dropped are numbers no more.
  void drop_bad_tags() {
    CageTags& tags = mesh_.cage;
    size_t dropped = drop_tags_out_of_range(tags, mesh_.positions.size());
    std::vector<uint32_t> holes;
    for (const uint32_t face : tags.holes) {
      const auto found = std::lower_bound(kept_faces_.begin(), kept_faces_.end(), face);
      if (found != kept_faces_.end() && *found == face) {
        holes.push_back(static_cast<uint32_t>(found - kept_faces_.begin()));
      } else {
        ++dropped;
      }
    }
    tags.holes = std::move(holes);
    if (dropped == 0) return;
    mesh_.warnings.push_back(
        fmt::format("{} tags of creases, corners or holes name what does not exist; ignored", dropped));
  }

  void attach_uvs() {
    if (uvs_.empty()) return;
    mesh_.corner_uv.resize(mesh_.corner_count());
    for (size_t i = 0; i < mesh_.corner_count(); ++i) {
      const uint32_t uv = corner_uv_index_[i];
      // NaN marks a corner without texture coordinate; the averages know it.
      mesh_.corner_uv[i] = uv < uvs_.size() ? uvs_[uv] : vec2(std::numeric_limits<float>::quiet_NaN());
    }
    transform_uvs();
  }

  /// By -s and -o of each face's textures. OBJ's v points up.
  void transform_uvs() {
    for (size_t face = 0; face < mesh_.face_count(); ++face) {
      const auto& transform = materials_.uv_transform(mesh_.face_material[face]);
      if (transform.scale == vec2(1.0f) && transform.offset == vec2(0.0f)) continue;
      for (uint32_t i = mesh_.face_begin[face]; i < mesh_.face_begin[face + 1]; ++i) {
        vec2& uv = mesh_.corner_uv[i];
        uv = vec2(uv.x, 1 - uv.y) * transform.scale + transform.offset;
        uv.y = 1 - uv.y;
      }
    }
  }

  /// Those of vn hold; without them, smoothing groups ask for means.
  void attach_normals() {
    if (!normals_.empty()) {
      mesh_.corner_normal.resize(mesh_.corner_count(), vec3(0.0f));
      size_t lost = 0;
      for (size_t i = 0; i < mesh_.corner_count(); ++i) {
        const uint32_t normal = corner_normal_index_[i];
        if (normal < normals_.size()) mesh_.corner_normal[i] = normals_[normal];
        lost += normal != kNoIndex && normal >= normals_.size();
      }
      if (lost > 0) {
        mesh_.warnings.push_back(fmt::format("{} corners name normals that do not exist; they are flat there", lost));
      }
    }
    smooth_corner_normals(mesh_, face_group_);
  }

  /// sRGB. Scanners also write 0 .. 255.
  void attach_colors() {
    if (colors_.empty()) colors_ = std::move(painted_);
    if (colors_.empty()) return;
    float most = 0;
    for (const vec3& color : colors_) most = std::max({most, color.x, color.y, color.z});
    constexpr float kBrightestFloat =
        8;  // no colour up to 1 is above; what is 0 .. 255 with no more than this is black
    const float white = most > kBrightestFloat ? 255.0f : 1.0f;
    if (white > 1) mesh_.warnings.push_back("vertex colours are 0 .. 255; read as such");
    for (vec3& color : colors_) {
      for (int c = 0; c < 3; ++c) color[c] = srgb_to_linear(std::min(color[c] / white, 1.0f));
    }
    colors_.resize(mesh_.positions.size(), vec3(1.0f));
    mesh_.corner_color.reserve(mesh_.corner_count());
    for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_color.emplace_back(colors_[vertex], 1.0f);
    // Without a material the colour is the albedo itself, not a tint of the default grey.
    if (mesh_.materials.size() == 1 && !materials_.is_defined(0)) mesh_.materials[0].base_color = vec3(1.0f);
  }

  void say_what_was_ignored() {
    if (no_position_.count > 0) {
      mesh_.warnings.push_back(fmt::format("line {}: v without three numbers (a decimal comma?), {} such lines",
                                           line_of(no_position_.at), no_position_.count));
    }
    for (const auto& [keyword, ignored] : ignored_) {
      const char* what = keyword == "l" ? " (lines)" : keyword == "p" ? " (points)" : "";
      mesh_.warnings.push_back(
          fmt::format("line {}: {}{} is ignored{}", line_of(ignored.at), keyword, what,
                      ignored.count == 1 ? "" : fmt::format(", as are {} more", ignored.count - 1)));
    }
  }

  size_t line_of(const char* at) const { return 1 + static_cast<size_t>(std::count(begin_, at, '\n')); }

  const char* begin_;
  TextCursor text_;
  std::string name_;
  SourceMesh mesh_;
  MaterialLibraries materials_;
  uint32_t material_ = kNoIndex;
  std::vector<vec2> uvs_;
  std::vector<vec3> normals_, colors_;
  std::vector<uint32_t> corner_uv_index_, corner_normal_index_;
  uint32_t smoothing_group_ = 0;
  std::vector<uint32_t> face_group_;
  std::vector<uint32_t> kept_faces_;  ///< of the file's faces those whose vertices exist
  std::vector<vec3> painted_;         ///< by ZBrush
  Ignored no_position_;
  std::map<std::string, Ignored> ignored_;  ///< by keyword
};

}  // namespace

Result<SourceMesh> read_obj(std::span<const unsigned char> bytes, const fs::path& path) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    return make_error(ErrorCode::Unsupported, fmt::format("{}: text in UTF-16; save it as UTF-8", path.string()));
  }
  std::string storage;
  return ObjReader(with_line_ends(without_byte_order_mark(text), storage), path).read();
}

}  // namespace farfield
