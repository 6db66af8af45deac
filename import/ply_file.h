// SPDX-License-Identifier: Apache-2.0
// What a PLY file says of itself, and its values one by one: ascii, little and big endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "import/text_cursor.h"

namespace farfield {

enum class PlyEncoding { Ascii, LittleEndian, BigEndian };
enum class PlyType { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };

/// Bytes of a value where the file is binary.
size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::Float;
  std::optional<PlyType> count_type;  ///< set for lists
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::Ascii;
  std::vector<PlyElement> elements;
  std::vector<std::string> textures;  ///< of "comment TextureFile NAME", in the file's order
  size_t body_offset = 0;             ///< where the values start
};

/// `name` is for messages. Errors: BadFile.
Result<PlyHeader> read_ply_header(std::string_view data, const std::string& name);

/// Reads values of any type as double, from text or from bytes, never past the end.
class PlyValues {
 public:
  PlyValues(std::string_view body, PlyEncoding encoding) : encoding_(encoding), text_(body), left_(body) {}

  /// False at the end, and at what is no number.
  bool read(PlyType type, double& value);

  /// Whether the rest can hold `count` items that take at least `bytes` each as binary, and two characters as text.
  bool can_hold(uint64_t count, uint64_t bytes, uint64_t values) const;

  /// What was not read yet; of text without the blanks before it.
  std::string_view rest();

 private:
  uint64_t text_rest() const { return static_cast<uint64_t>(left_.data() + left_.size() - text_.position()); }

  PlyEncoding encoding_;
  TextCursor text_;
  std::string_view left_;
};

}  // namespace farfield
