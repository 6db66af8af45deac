// SPDX-License-Identifier: Apache-2.0
// Meshes of PLY files: positions, normals, colours, texture coordinates and faces from whatever other properties stand
// around them. A header promises counts; nothing is allocated before the bytes that would hold them are known to be
// there. An own reader: the usual ones know no textures, and not all of PLY's types.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>

#include "base/result.h"
#include "import/corner_normals.h"
#include "import/image_files.h"
#include "import/ply_file.h"
#include "import/read_formats.h"

namespace farfield {
namespace {

/// What a scalar property of a vertex or face means to us.
enum class Role { X, Y, Z, NormalX, NormalY, NormalZ, Red, Green, Blue, Alpha, U, V, Texture, None };

Role role_of(const PlyProperty& property) {
  struct Name {
    std::string_view text;
    Role role;
  };
  // MeshLab, Blender, RealityCapture, Metashape, PCL and COLMAP write these.
  constexpr Name kNames[] = {{"x", Role::X},
                             {"y", Role::Y},
                             {"z", Role::Z},
                             {"nx", Role::NormalX},
                             {"ny", Role::NormalY},
                             {"nz", Role::NormalZ},
                             {"normal_x", Role::NormalX},
                             {"normal_y", Role::NormalY},
                             {"normal_z", Role::NormalZ},
                             {"red", Role::Red},
                             {"green", Role::Green},
                             {"blue", Role::Blue},
                             {"r", Role::Red},
                             {"g", Role::Green},
                             {"b", Role::Blue},
                             {"diffuse_red", Role::Red},
                             {"diffuse_green", Role::Green},
                             {"diffuse_blue", Role::Blue},
                             {"alpha", Role::Alpha},
                             {"s", Role::U},
                             {"t", Role::V},
                             {"u", Role::U},
                             {"v", Role::V},
                             {"texture_u", Role::U},
                             {"texture_v", Role::V},
                             {"texture_s", Role::U},
                             {"texture_t", Role::V},
                             {"texnumber", Role::Texture},
                             {"texnum", Role::Texture}};
  if (property.count_type) return Role::None;
  for (const Name& n : kNames) {
    if (n.text == property.name) return n.role;
  }
  return Role::None;
}

bool is_indices(const PlyProperty& p) {
  return p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index");
}

bool is_corner_uvs(const PlyProperty& p) { return p.count_type && p.name == "texcoord"; }

/// The scalars of one vertex or face by role.
struct Scalars {
  std::array<double, static_cast<size_t>(Role::None) + 1> values{};

  double operator[](Role role) const { return values[static_cast<size_t>(role)]; }
  double& operator[](Role role) { return values[static_cast<size_t>(role)]; }
  vec3 rgb() const {
    return vec3(static_cast<float>((*this)[Role::Red]), static_cast<float>((*this)[Role::Green]),
                static_cast<float>((*this)[Role::Blue]));
  }
};

/// Colours as stored. What they mean, only all of them together say: programs store 0 .. 255 in types of any size.
struct Colors {
  std::vector<vec3> values;
  PlyType type = PlyType::Uint8;

  /// Integers are sRGB, as scanners and Blender write them; floats up to 1 are linear. What does not fill its type is
  /// said in `note`.
  std::vector<vec3> to_linear(std::string& note) const {
    float most = 0;
    for (const vec3& v : values) {
      for (int c = 0; c < 3; ++c) most = std::max(most, v[c]);  // NaN is never more
    }
    constexpr float kBrightestFloat = 8;  // no albedo as float is above; 0 .. 255 with no more than this is black
    const bool is_linear = (type == PlyType::Float || type == PlyType::Double) && most <= kBrightestFloat;
    const float white = is_linear ? 1.0f : most <= 255 ? 255.0f : most <= 65535 ? 65535.0f : 4294967295.0f;
    if (white == 255 && most > 1 && size_of(type) > 1) note = "colours are 0 .. 255 in a wider type; read as such";
    std::vector<vec3> out(values.size());
    for (size_t i = 0; i < values.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const float value = values[i][c] >= 0 ? std::min(values[i][c] / white, 1.0f) : 0.0f;  // NaN becomes 0
        out[i][c] = is_linear ? value : srgb_to_linear(value);
      }
    }
    return out;
  }
};

class PlyReader {
 public:
  PlyReader(std::span<const unsigned char> bytes, const std::filesystem::path& path)
      : data_(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
        folder_(path.parent_path()),
        name_(path.string()) {}

  Result<SourceMesh> read() { return with_warnings(read_all(), mesh_.warnings); }

 private:
  Result<SourceMesh> read_all() {
    FARFIELD_TRY_LET(header_, read_ply_header(data_, name_));
    PlyValues values(data_.substr(header_.body_offset), header_.encoding);
    for (const PlyElement& element : header_.elements) {
      FARFIELD_TRY(read_element(element, values));
    }
    FARFIELD_TRY(expect_end(values));
    FARFIELD_TRY(check_indices());
    attach_normals();
    attach_uvs();
    FARFIELD_TRY(attach_textures());
    attach_colors();
    say_what_was_ignored();
    mesh_.is_split = true;  // a vertex has one normal and one uv
    return std::move(mesh_);
  }

  tl::unexpected<Error> bad(const std::string& what) const {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name_, what));
  }
  void warn(std::string text) { mesh_.warnings.push_back(std::move(text)); }

  void say_what_was_ignored() {
    if (mesh_.face_count() == 0)
      warn(fmt::format("{} points without faces; only surfaces are read", mesh_.positions.size()));
    if (ignored_.empty()) return;
    constexpr size_t kNamed = 8;  // splats have sixty
    const auto end = std::next(ignored_.begin(), static_cast<ptrdiff_t>(std::min(kNamed, ignored_.size())));
    const std::string more = ignored_.size() > kNamed ? fmt::format(" and {} more", ignored_.size() - kNamed) : "";
    warn(fmt::format("{}{}: ignored", fmt::join(ignored_.begin(), end, ", "), more));
  }

  Result<void> read_element(const PlyElement& element, PlyValues& values) {
    uint64_t bytes = 0;
    for (const PlyProperty& p : element.properties) bytes += size_of(p.count_type.value_or(p.type));
    if (!values.can_hold(element.count, bytes, element.properties.size())) {
      return bad(fmt::format("the header promises {} of '{}', the file ends before them", element.count, element.name));
    }
    if (element.properties.empty()) return {};  // any count of nothing
    if (element.name == "vertex") return read_vertices(element, values);
    if (element.name == "face") return read_faces(element, values);
    if (element.name == "tristrips") return read_strips(element, values);
    if (element.count > 0) ignored_.insert(fmt::format("{} of '{}'", element.count, element.name));
    for (uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
      }
    }
    return {};
  }

  tl::unexpected<Error> cut_short(const PlyElement& element, uint64_t index) const {
    return bad(fmt::format("{} {} of {} is cut short or not a number", element.name, index, element.count));
  }

  /// More text than the header promises means that it promises fewer values than a line has, and all were shifted.
  Result<void> expect_end(PlyValues& values) {
    const std::string_view rest = values.rest();
    if (rest.empty()) return {};
    const std::string said = fmt::format("{} bytes are left over behind the last element", rest.size());
    if (header_.encoding == PlyEncoding::Ascii) return bad(said + "; the header must name every value of a line");
    warn(said + "; ignored");
    return {};
  }

  /// Leaves the value of a scalar in scalar_, those of a list in list_.
  bool read_value(const PlyProperty& property, PlyValues& values) {
    if (!property.count_type) return values.read(property.type, scalar_);
    double count = 0;
    if (!values.read(*property.count_type, count)) return false;
    if (!(count >= 0) || count > 4e9 || !values.can_hold(static_cast<uint64_t>(count), size_of(property.type), 1)) {
      return false;
    }
    list_.resize(static_cast<size_t>(count));
    for (double& value : list_) {
      if (!values.read(property.type, value)) return false;
    }
    return true;
  }

  /// Which roles the scalars of an element have, as bits; what has none and is no list that we read is noted.
  uint32_t roles_of(const PlyElement& element) {
    uint32_t roles = 0;
    for (const PlyProperty& p : element.properties) {
      if (const Role role = role_of(p); role != Role::None) {
        roles |= bit(role);
        if (role == Role::Red) colors_of(element).type = p.type;
      } else if (element.name != "face" || (!is_indices(p) && !is_corner_uvs(p))) {
        ignored_.insert(fmt::format("{} {}", element.name, p.name));
      }
    }
    return roles;
  }
  static constexpr uint32_t bit(Role role) { return 1u << static_cast<uint32_t>(role); }
  template <typename... Roles>
  static bool has(uint32_t roles, Roles... wanted) {
    return ((roles & bit(wanted)) && ...);
  }
  Colors& colors_of(const PlyElement& element) { return element.name == "face" ? face_colors_ : vertex_colors_; }

  Result<void> read_vertices(const PlyElement& element, PlyValues& values) {
    if (!mesh_.positions.empty()) return bad("a second 'vertex' element");
    const uint32_t roles = roles_of(element);
    if (!has(roles, Role::X, Role::Y, Role::Z)) return bad("'vertex' has no properties x, y, z");
    const bool has_color = has(roles, Role::Red, Role::Green, Role::Blue), has_uv = has(roles, Role::U, Role::V);
    const bool has_normal = has(roles, Role::NormalX, Role::NormalY, Role::NormalZ);
    mesh_.positions.reserve(element.count);
    Scalars vertex;
    for (uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
        if (!p.count_type) vertex[role_of(p)] = scalar_;
      }
      mesh_.positions.emplace_back(vertex[Role::X], vertex[Role::Y], vertex[Role::Z]);
      if (has_color) vertex_colors_.values.push_back(vertex.rgb());
      if (has(roles, Role::Alpha)) {
        least_alpha_ = std::min(least_alpha_, vertex[Role::Alpha]);
        most_alpha_ = std::max(most_alpha_, vertex[Role::Alpha]);
      }
      if (has_uv) vertex_uvs_.push_back(uv_of(vertex[Role::U], vertex[Role::V]));
      if (has(roles, Role::Texture)) vertex_textures_.push_back(texture_number(vertex[Role::Texture]));
      if (has_normal) {
        vertex_normals_.push_back(
            unit_normal(dvec3(vertex[Role::NormalX], vertex[Role::NormalY], vertex[Role::NormalZ])));
      }
    }
    return {};
  }

  /// PLY's v points up.
  static vec2 uv_of(double u, double v) { return vec2(static_cast<float>(u), static_cast<float>(1 - v)); }
  static uint32_t texture_number(double value) { return value >= 0 && value < 1e6 ? static_cast<uint32_t>(value) : 0; }

  Result<void> read_faces(const PlyElement& element, PlyValues& values) {
    if (std::none_of(element.properties.begin(), element.properties.end(), is_indices)) {
      return bad("'face' has no list vertex_indices");
    }
    const uint32_t roles = roles_of(element);
    const bool has_color = has(roles, Role::Red, Role::Green, Role::Blue);
    Scalars face;
    std::vector<double> uvs;
    for (uint64_t i = 0; i < element.count; ++i) {
      const size_t first_corner = mesh_.corner_count();
      uvs.clear();
      for (const PlyProperty& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
        if (is_indices(p)) {
          FARFIELD_TRY(add_corners(i));
        } else if (is_corner_uvs(p)) {
          uvs = list_;
        } else if (!p.count_type) {
          face[role_of(p)] = scalar_;
        }
      }
      if (mesh_.corner_count() > UINT32_MAX) return bad("more than 2^32 face corners");
      mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
      mesh_.face_material.push_back(has(roles, Role::Texture) ? texture_number(face[Role::Texture]) : 0);
      if (has_color) face_colors_.values.push_back(face.rgb());
      if (!uvs.empty()) FARFIELD_TRY(add_corner_uvs(uvs, first_corner, i));
    }
    has_face_textures_ = has(roles, Role::Texture);
    return {};
  }

  /// As the Stanford scans have them: lists of vertices, -1 between strips. Every second triangle is turned around.
  Result<void> read_strips(const PlyElement& element, PlyValues& values) {
    for (uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
        if (!is_indices(p)) continue;
        const std::vector<double> strip = std::move(list_);
        size_t begin = 0;
        for (size_t at = 0; at < strip.size(); ++at) {
          if (strip[at] < 0) {
            begin = at + 1;
          } else if (at >= begin + 2) {
            const size_t turn = (at - begin) % 2;
            list_ = {strip[at - 2], strip[at - 1 + turn], strip[at - turn]};
            FARFIELD_TRY(add_corners(mesh_.face_count()));
            mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
            mesh_.face_material.push_back(0);
          }
        }
      }
    }
    if (mesh_.corner_count() > UINT32_MAX) return bad("more than 2^32 face corners");
    return {};
  }

  Result<void> add_corners(uint64_t face) {
    for (const double index : list_) {
      // Vertices may come after the faces: only what no vertex count can make right is refused here.
      if (!(index >= 0) || index >= 4294967295.0) {
        return bad(fmt::format("face {} has the vertex index {}", face, index));
      }
      mesh_.corner_position.push_back(static_cast<uint32_t>(index));
    }
    return {};
  }

  /// MeshLab writes u and v of each corner into one list per face.
  Result<void> add_corner_uvs(const std::vector<double>& uvs, size_t first_corner, uint64_t face) {
    const size_t corners = mesh_.corner_count() - first_corner;
    if (uvs.size() != 2 * corners) {
      return bad(fmt::format("face {} has {} values in texcoord, its {} corners need {}", face, uvs.size(), corners,
                             2 * corners));
    }
    mesh_.corner_uv.resize(first_corner, no_uv());
    for (size_t k = 0; k < corners; ++k) mesh_.corner_uv.push_back(uv_of(uvs[2 * k], uvs[2 * k + 1]));
    return {};
  }

  static vec2 no_uv() { return vec2(std::numeric_limits<float>::quiet_NaN()); }

  Result<void> check_indices() {
    for (size_t i = 0; i < mesh_.corner_count(); ++i) {
      if (mesh_.corner_position[i] >= mesh_.positions.size()) {
        const auto face =
            std::upper_bound(mesh_.face_begin.begin(), mesh_.face_begin.end(), i) - mesh_.face_begin.begin() - 1;
        return bad(fmt::format("face {} has the vertex index {}, there are {} vertices", face, mesh_.corner_position[i],
                               mesh_.positions.size()));
      }
    }
    return {};
  }

  void attach_normals() {
    if (vertex_normals_.empty()) return;
    for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_normal.push_back(vertex_normals_[vertex]);
  }

  /// Those of the faces hold; they can have a seam.
  void attach_uvs() {
    if (!mesh_.corner_uv.empty()) {
      mesh_.corner_uv.resize(mesh_.corner_count(), no_uv());
    } else if (!vertex_uvs_.empty()) {
      for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_uv.push_back(vertex_uvs_[vertex]);
    }
  }

  /// One material per texture that the header names.
  Result<void> attach_textures() {
    ImageFiles images(folder_, mesh_);
    for (const std::string& file : header_.textures) {
      SourceMaterial& material = mesh_.materials.emplace_back();
      material.name = file;
      material.base_color_map.image = images.read(folder_, file, TextureUse::Color);
      material.base_color_map.is_missing = !material.base_color_map;
      if (material.base_color_map) material.base_color = vec3(1.0f);
    }
    FARFIELD_TRY(images.ready());
    if (mesh_.materials.empty()) mesh_.materials.emplace_back();
    take_textures_of_vertices();
    clamp_texture_numbers();
    const bool is_mapped = !mesh_.corner_uv.empty();
    if (is_mapped && header_.textures.empty()) {
      warn("has texture coordinates, but no line 'comment TextureFile' names their image; it has no texture");
    }
    if (!is_mapped && !header_.textures.empty())
      warn("names a texture, but has no texture coordinates; its mean is used");
    return {};
  }

  void take_textures_of_vertices() {
    if (vertex_textures_.empty() || has_face_textures_) return;
    for (size_t face = 0; face < mesh_.face_count(); ++face) {
      const uint32_t begin = mesh_.face_begin[face];
      if (begin < mesh_.face_begin[face + 1])
        mesh_.face_material[face] = vertex_textures_[mesh_.corner_position[begin]];
    }
  }

  void clamp_texture_numbers() {
    const size_t count = mesh_.materials.size();
    size_t clamped = 0;
    for (uint32_t& material : mesh_.face_material) {
      if (material < count) continue;
      material = 0;
      ++clamped;
    }
    if (clamped > 0 && !header_.textures.empty()) {
      warn(fmt::format("{} faces have a texnumber that no TextureFile has; the first texture is taken", clamped));
    }
    if (header_.textures.size() > 1 && !has_face_textures_ && vertex_textures_.empty()) {
      warn(fmt::format("names {} textures, but no face or vertex has a texnumber; {} is taken for all",
                       header_.textures.size(), header_.textures[0]));
    }
  }

  /// A colour is the albedo itself, not a tint of the default grey. Scans have the same albedo twice, as colours and as
  /// texture: not to be multiplied.
  void attach_colors() {
    const bool is_textured = std::any_of(mesh_.materials.begin(), mesh_.materials.end(),
                                         [](const SourceMaterial& m) { return bool(m.base_color_map); });
    if (vertex_colors_.values.empty() && face_colors_.values.empty()) return;
    if (is_textured) {
      warn("has colours beside its texture; the texture alone is used");
      return;
    }
    std::string note;
    // Strips, or a second list of faces, may have none.
    if (face_colors_.values.size() == mesh_.face_count()) {
      const auto colors = face_colors_.to_linear(note);
      for (size_t face = 0; face < mesh_.face_count(); ++face) {
        mesh_.corner_color.resize(mesh_.face_begin[face + 1], vec4(colors[face], 1.0f));
      }
    } else if (!vertex_colors_.values.empty()) {
      const auto colors = vertex_colors_.to_linear(note);
      for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_color.emplace_back(colors[vertex], 1.0f);
    }
    if (!note.empty()) warn(note);
    if (least_alpha_ < most_alpha_) warn("the alpha of its colours is ignored");
    for (SourceMaterial& material : mesh_.materials) material.base_color = vec3(1.0f);
  }

  std::string_view data_;
  std::filesystem::path folder_;
  std::string name_;
  PlyHeader header_;
  SourceMesh mesh_;
  Colors vertex_colors_, face_colors_;
  std::vector<vec2> vertex_uvs_;
  std::vector<vec3> vertex_normals_;
  std::vector<uint32_t> vertex_textures_;
  bool has_face_textures_ = false;
  double least_alpha_ = std::numeric_limits<double>::infinity(), most_alpha_ = 0;
  std::set<std::string> ignored_;  ///< what the header names and nothing here reads
  double scalar_ = 0;
  std::vector<double> list_;
};

}  // namespace

Result<SourceMesh> read_ply(std::span<const unsigned char> bytes, const std::filesystem::path& path) {
  return PlyReader(bytes, path).read();
}

}  // namespace farfield
