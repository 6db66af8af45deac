// SPDX-License-Identifier: Apache-2.0
// PLY: ascii, little and big endian; positions, colours and faces from whatever other properties stand around them.
// A header promises counts; nothing is allocated before the bytes that would hold them are known to be there.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>

#include "base/result.h"
#include "import/read_formats.h"
#include "import/text_cursor.h"

namespace farfield {
namespace {

enum class Encoding { Ascii, LittleEndian, BigEndian };
enum class Type { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };

size_t size_of(Type type) {
  constexpr std::array<size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

std::optional<Type> parse_type(std::string_view name) {
  struct Name {
    std::string_view text;
    Type type;
  };
  constexpr Name kNames[] = {
      {"char", Type::Int8},   {"int8", Type::Int8},     {"uchar", Type::Uint8},   {"uint8", Type::Uint8},
      {"short", Type::Int16}, {"int16", Type::Int16},   {"ushort", Type::Uint16}, {"uint16", Type::Uint16},
      {"int", Type::Int32},   {"int32", Type::Int32},   {"uint", Type::Uint32},   {"uint32", Type::Uint32},
      {"float", Type::Float}, {"float32", Type::Float}, {"double", Type::Double}, {"float64", Type::Double}};
  for (const Name& n : kNames) {
    if (n.text == name) return n.type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type = Type::Float;
  std::optional<Type> count_type;  ///< set for lists
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::Ascii;
  std::vector<Element> elements;
};

/// Reads values of any type as double, from text or from bytes, never past the end.
class ValueReader {
 public:
  ValueReader(std::string_view data, Encoding encoding) : encoding_(encoding), text_(data), left_(data) {}

  bool read(Type type, double& value) {
    if (encoding_ == Encoding::Ascii) {
      text_.skip_blanks_and_lines();
      return text_.number(value);
    }
    const size_t size = size_of(type);
    if (left_.size() < size) return false;
    std::array<unsigned char, 8> raw{};
    for (size_t i = 0; i < size; ++i) {
      const bool swap = (encoding_ == Encoding::BigEndian) != (std::endian::native == std::endian::big);
      raw[swap ? size - 1 - i : i] = static_cast<unsigned char>(left_[i]);
    }
    left_.remove_prefix(size);
    value = decode(type, raw.data());
    return true;
  }

  /// Whether the rest can hold `count` items that take at least `bytes` each as binary, and two characters as text.
  bool can_hold(uint64_t count, uint64_t bytes, uint64_t values) {
    const uint64_t rest = encoding_ == Encoding::Ascii ? text_rest() : left_.size();
    const uint64_t each = encoding_ == Encoding::Ascii ? 2 * values : bytes;
    return each == 0 || count <= (rest + 1) / each;  // + 1: the last text value needs no blank behind it
  }

 private:
  static double decode(Type type, const unsigned char* raw) {
    const auto as = [raw](auto v) {
      std::memcpy(&v, raw, sizeof v);
      return static_cast<double>(v);
    };
    switch (type) {
      case Type::Int8:
        return as(int8_t{});
      case Type::Uint8:
        return as(uint8_t{});
      case Type::Int16:
        return as(int16_t{});
      case Type::Uint16:
        return as(uint16_t{});
      case Type::Int32:
        return as(int32_t{});
      case Type::Uint32:
        return as(uint32_t{});
      case Type::Float:
        return as(float{});
      case Type::Double:
        return as(double{});
    }
    return 0;
  }
  uint64_t text_rest() const { return static_cast<uint64_t>(left_.data() + left_.size() - text_.position()); }

  Encoding encoding_;
  TextCursor text_;
  std::string_view left_;
};

class PlyReader {
 public:
  PlyReader(std::span<const unsigned char> bytes, const std::filesystem::path& path)
      : data_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(path.string()) {}

  Result<SourceMesh> read() {
    size_t body = 0;
    FARFIELD_TRY_LET(auto header, read_header(body));
    ValueReader values(data_.substr(body), header.encoding);
    for (const Element& element : header.elements) {
      FARFIELD_TRY(read_element(element, values));
    }
    return finish();
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name_, what));
  }

  Result<Header> read_header(size_t& body) {
    TextCursor text(data_);
    if (text.rest_of_line() != "ply") return bad("does not start with the line 'ply'");
    Header header;
    bool has_format = false;
    for (int line = 2; !text.at_end(); ++line) {
      if (line > 10000) return bad("header has more than 10000 lines");
      const std::string_view keyword = text.word();
      if (keyword == "end_header") {
        // Binary data starts right behind this line's end, which may be \n or \r\n: nothing else may be skipped.
        while (!text.at_end() && text.peek() != '\n') text.advance();
        if (!text.at_end()) text.advance();
        if (!has_format) return bad("header has no format line");
        body = static_cast<size_t>(text.position() - data_.data());
        return header;
      }
      if (keyword == "format") {
        const std::string_view format = text.word();
        if (format == "ascii")
          header.encoding = Encoding::Ascii;
        else if (format == "binary_little_endian")
          header.encoding = Encoding::LittleEndian;
        else if (format == "binary_big_endian")
          header.encoding = Encoding::BigEndian;
        else
          return bad(fmt::format("header line {}: unknown format", line));
        has_format = true;
      } else if (keyword == "element") {
        Element element;
        element.name = text.word();
        int64_t count = 0;
        if (!text.integer(count) || count < 0) return bad(fmt::format("header line {}: bad element count", line));
        element.count = static_cast<uint64_t>(count);
        header.elements.push_back(std::move(element));
      } else if (keyword == "property") {
        if (header.elements.empty()) return bad(fmt::format("header line {}: property before any element", line));
        auto property = read_property(text);
        if (!property) return bad(fmt::format("header line {}: unknown property type", line));
        header.elements.back().properties.push_back(std::move(*property));
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        return bad(fmt::format("header line {}: unknown keyword", line));
      }
      text.rest_of_line();
    }
    return bad("header has no end_header line");
  }

  static std::optional<Property> read_property(TextCursor& text) {
    Property property;
    std::string_view word = text.word();
    if (word == "list") {
      property.count_type = parse_type(text.word());
      if (!property.count_type) return std::nullopt;
      word = text.word();
    }
    const auto type = parse_type(word);
    if (!type) return std::nullopt;
    property.type = *type;
    property.name = text.word();
    return property;
  }

  Result<void> read_element(const Element& element, ValueReader& values) {
    uint64_t bytes = 0;
    for (const Property& p : element.properties) bytes += size_of(p.count_type.value_or(p.type));
    if (!values.can_hold(element.count, bytes, element.properties.size())) {
      return bad(fmt::format("the header promises {} of '{}', the file ends before them", element.count, element.name));
    }
    if (element.properties.empty()) return {};  // any count of nothing
    if (element.name == "vertex") return read_vertices(element, values);
    if (element.name == "face") return read_faces(element, values);
    if (element.name == "tristrips") {
      return make_error(ErrorCode::Unsupported, fmt::format("{}: triangle strips; save it with faces", name_));
    }
    for (uint64_t i = 0; i < element.count; ++i) {
      for (const Property& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
      }
    }
    return {};
  }

  tl::unexpected<Error> cut_short(const Element& element, uint64_t index) const {
    return bad(fmt::format("{} {} of {} is cut short or not a number", element.name, index, element.count));
  }

  /// Leaves the value of a scalar in scalar_, those of a list in list_.
  bool read_value(const Property& property, ValueReader& values) {
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

  /// Which of r, g, b a property is, or -1.
  static int color_channel(const Property& property) {
    constexpr std::array<std::string_view, 3> kLong{"red", "green", "blue"},
        kDiffuse{"diffuse_red", "diffuse_green", "diffuse_blue"};
    for (size_t c = 0; c < 3; ++c) {
      if (!property.count_type && (property.name == kLong[c] || property.name == kDiffuse[c]))
        return static_cast<int>(c);
    }
    return -1;
  }

  /// Integers are sRGB over their whole range, as scanners and Blender write them; floats are linear.
  static float to_linear(double value, Type type) {
    switch (type) {
      case Type::Uint8:
        return srgb_to_linear(static_cast<float>(value / 255.0));
      case Type::Uint16:
        return srgb_to_linear(static_cast<float>(value / 65535.0));
      default:
        return static_cast<float>(value >= 0 ? std::min(value, 1.0) : 0.0);  // NaN becomes 0
    }
  }

  Result<void> read_vertices(const Element& element, ValueReader& values) {
    if (!mesh_.positions.empty()) return bad("a second 'vertex' element");
    const bool has_color = std::any_of(element.properties.begin(), element.properties.end(),
                                       [](const Property& p) { return color_channel(p) >= 0; });
    mesh_.positions.reserve(element.count);
    if (has_color) vertex_colors_.reserve(element.count);
    int axes = 0;
    for (const Property& p : element.properties) axes |= p.name == "x" ? 1 : p.name == "y" ? 2 : p.name == "z" ? 4 : 0;
    if (axes != 7) return bad("'vertex' has no properties x, y, z");
    for (uint64_t i = 0; i < element.count; ++i) {
      dvec3 position(0.0);
      vec3 color(1.0f);
      for (const Property& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
        if (p.count_type) continue;
        if (p.name == "x") position.x = scalar_;
        if (p.name == "y") position.y = scalar_;
        if (p.name == "z") position.z = scalar_;
        if (const int c = color_channel(p); c >= 0) color[c] = to_linear(scalar_, p.type);
      }
      mesh_.positions.push_back(position);
      if (has_color) vertex_colors_.push_back(color);
    }
    return {};
  }

  Result<void> read_faces(const Element& element, ValueReader& values) {
    const auto is_indices = [](const Property& p) {
      return p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    if (std::none_of(element.properties.begin(), element.properties.end(), is_indices)) {
      return bad("'face' has no list vertex_indices");
    }
    for (uint64_t i = 0; i < element.count; ++i) {
      vec3 color(1.0f);
      bool has_color = false;
      for (const Property& p : element.properties) {
        if (!read_value(p, values)) return cut_short(element, i);
        if (is_indices(p)) {
          for (const double index : list_) {
            // Vertices may come after the faces: only what no vertex count can make right is refused here.
            if (!(index >= 0) || index >= 4294967295.0) {
              return bad(fmt::format("face {} has the vertex index {}", i, index));
            }
            mesh_.corner_position.push_back(static_cast<uint32_t>(index));
          }
        } else if (const int c = color_channel(p); c >= 0) {
          color[c] = to_linear(scalar_, p.type);
          has_color = true;
        }
      }
      if (has_color) {
        mesh_.corner_color.resize(mesh_.face_begin.back(), vec4(1.0f));
        mesh_.corner_color.resize(mesh_.corner_count(), vec4(color, 1.0f));
      }
      if (mesh_.corner_count() > UINT32_MAX) return bad("more than 2^32 face corners");
      mesh_.face_begin.push_back(static_cast<uint32_t>(mesh_.corner_count()));
      mesh_.face_material.push_back(0);
    }
    return {};
  }

  Result<SourceMesh> finish() {
    for (size_t i = 0; i < mesh_.corner_count(); ++i) {
      if (mesh_.corner_position[i] >= mesh_.positions.size()) {
        const auto face =
            std::upper_bound(mesh_.face_begin.begin(), mesh_.face_begin.end(), i) - mesh_.face_begin.begin() - 1;
        return bad(fmt::format("face {} has the vertex index {}, there are {} vertices", face, mesh_.corner_position[i],
                               mesh_.positions.size()));
      }
    }
    mesh_.materials.emplace_back();
    if (!mesh_.corner_color.empty()) {
      mesh_.corner_color.resize(mesh_.corner_count(), vec4(1.0f));
    } else if (!vertex_colors_.empty()) {
      for (const uint32_t vertex : mesh_.corner_position) mesh_.corner_color.emplace_back(vertex_colors_[vertex], 1.0f);
    }
    // The colour is the albedo itself, not a tint of the default grey.
    if (!mesh_.corner_color.empty()) mesh_.materials[0].base_color = vec3(1.0f);
    return std::move(mesh_);
  }

  std::string_view data_;
  std::string name_;
  SourceMesh mesh_;
  std::vector<vec3> vertex_colors_;
  double scalar_ = 0;
  std::vector<double> list_;
};

}  // namespace

Result<SourceMesh> read_ply(std::span<const unsigned char> bytes, const std::filesystem::path& path) {
  return PlyReader(bytes, path).read();
}

}  // namespace farfield
