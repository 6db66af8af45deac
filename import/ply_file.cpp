// SPDX-License-Identifier: Apache-2.0
#include "import/ply_file.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>

namespace farfield {
namespace {

std::optional<PlyType> parse_type(std::string_view name) {
  struct Name {
    std::string_view text;
    PlyType type;
  };
  constexpr Name kNames[] = {{"char", PlyType::Int8},     {"int8", PlyType::Int8},     {"uchar", PlyType::Uint8},
                             {"uint8", PlyType::Uint8},   {"short", PlyType::Int16},   {"int16", PlyType::Int16},
                             {"ushort", PlyType::Uint16}, {"uint16", PlyType::Uint16}, {"int", PlyType::Int32},
                             {"int32", PlyType::Int32},   {"uint", PlyType::Uint32},   {"uint32", PlyType::Uint32},
                             {"float", PlyType::Float},   {"float32", PlyType::Float}, {"double", PlyType::Double},
                             {"float64", PlyType::Double}};
  for (const Name& n : kNames) {
    if (n.text == name) return n.type;
  }
  return std::nullopt;
}

double decode(PlyType type, const unsigned char* raw) {
  const auto as = [raw](auto v) {
    std::memcpy(&v, raw, sizeof v);
    return static_cast<double>(v);
  };
  switch (type) {
    case PlyType::Int8:
      return as(int8_t{});
    case PlyType::Uint8:
      return as(uint8_t{});
    case PlyType::Int16:
      return as(int16_t{});
    case PlyType::Uint16:
      return as(uint16_t{});
    case PlyType::Int32:
      return as(int32_t{});
    case PlyType::Uint32:
      return as(uint32_t{});
    case PlyType::Float:
      return as(float{});
    case PlyType::Double:
      return as(double{});
  }
  return 0;
}
class HeaderReader {
 public:
  HeaderReader(std::string_view data, const std::string& name) : data_(data), name_(name) {}

  Result<PlyHeader> read() {
    TextCursor text(data_);
    if (text.rest_of_line() != "ply") return bad("does not start with the line 'ply'");
    PlyHeader header;
    bool has_format = false;
    for (int line = 2; !text.at_end(); ++line) {
      if (line > 10000) return bad("header has more than 10000 lines");
      const std::string_view keyword = text.word();
      if (keyword == "end_header") {
        // Binary data starts right behind this line's end, which may be \n or \r\n: nothing else may be skipped.
        while (!text.at_end() && text.peek() != '\n') text.advance();
        if (!text.at_end()) text.advance();
        if (!has_format) return bad("header has no format line");
        header.body_offset = static_cast<size_t>(text.position() - data_.data());
        return header;
      }
      const bool is_texture = keyword == "comment" && text.word() == "TextureFile";
      if (keyword == "format") {
        const std::string_view format = text.word();
        if (format == "ascii")
          header.encoding = PlyEncoding::Ascii;
        else if (format == "binary_little_endian")
          header.encoding = PlyEncoding::LittleEndian;
        else if (format == "binary_big_endian")
          header.encoding = PlyEncoding::BigEndian;
        else
          return bad(fmt::format("header line {}: unknown format", line));
        has_format = true;
      } else if (keyword == "element") {
        PlyElement element;
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
      const std::string_view rest = text.rest_of_line();
      if (is_texture && !rest.empty()) header.textures.emplace_back(rest);
    }
    return bad("header has no end_header line");
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name_, what));
  }

  static std::optional<PlyProperty> read_property(TextCursor& text) {
    PlyProperty property;
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

  std::string_view data_;
  const std::string& name_;
};

}  // namespace

size_t size_of(PlyType type) {
  constexpr std::array<size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

Result<PlyHeader> read_ply_header(std::string_view data, const std::string& name) {
  return HeaderReader(data, name).read();
}

bool PlyValues::read(PlyType type, double& value) {
  if (encoding_ == PlyEncoding::Ascii) {
    text_.skip_blanks_and_lines();
    return text_.number(value);
  }
  const size_t size = size_of(type);
  if (left_.size() < size) return false;
  std::array<unsigned char, 8> raw{};
  for (size_t i = 0; i < size; ++i) {
    const bool swap = (encoding_ == PlyEncoding::BigEndian) != (std::endian::native == std::endian::big);
    raw[swap ? size - 1 - i : i] = static_cast<unsigned char>(left_[i]);
  }
  left_.remove_prefix(size);
  value = decode(type, raw.data());
  return true;
}

bool PlyValues::can_hold(uint64_t count, uint64_t bytes, uint64_t values) const {
  const uint64_t rest = encoding_ == PlyEncoding::Ascii ? text_rest() : left_.size();
  const uint64_t each = encoding_ == PlyEncoding::Ascii ? 2 * values : bytes;
  return each == 0 || count <= (rest + 1) / each;  // + 1: the last text value needs no blank behind it
}

std::string_view PlyValues::rest() {
  if (encoding_ != PlyEncoding::Ascii) return left_;
  text_.skip_blanks_and_lines();
  return left_.substr(left_.size() - text_rest());
}

}  // namespace farfield
