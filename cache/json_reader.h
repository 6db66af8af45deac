// SPDX-License-Identifier: Apache-2.0
// Fields of untrusted JSON.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/hash.h"
#include "base/vec.h"

namespace farfield {

// Keys are written in the order of the documentation, but read into a sorted map: an ordered one is searched from the
// start for each key, and a hostile manifest has hundreds of thousands.
using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

/// What is wrong, for a message; nothing if all is well.
using Problem = std::optional<std::string>;

/// Reads fields and remembers the first thing that is wrong, so that the reading code states no errors itself.
class FieldReader {
 public:
  Problem problem;

  const Json* field(const Json& object, const char* key, const std::string& where) {
    if (problem) return nullptr;
    if (!object.is_object()) return fail(where, "an object");
    const auto found = object.find(key);
    if (found == object.end()) {
      problem = fmt::format("\"{}\" is missing{}{}", key, where.empty() ? "" : " in ", where);
      return nullptr;
    }
    return &*found;
  }
  std::string text(const Json& object, const char* key, const std::string& where = "") {
    const Json* value = field(object, key, where);
    if (value == nullptr) return {};
    return text(*value, join(where, key));
  }
  std::string text(const Json& value, const std::string& where) {
    if (!value.is_string()) return fail(where, "a text"), std::string();
    return value.get<std::string>();
  }
  uint64_t count(const Json& object, const char* key, const std::string& where = "") {
    const Json* value = field(object, key, where);
    if (value == nullptr) return 0;
    if (!value->is_number_unsigned()) return fail(join(where, key), "an integer from 0 to 2^64 - 1"), 0;
    return value->get<uint64_t>();
  }
  uint32_t count32(const Json& object, const char* key, const std::string& where) {
    const uint64_t value = count(object, key, where);
    if (value > 0xffffffffu) fail(join(where, key), "an integer below 2^32");
    return static_cast<uint32_t>(value);
  }
  /// Hashes are text: many JSON tools round integers above 2^53.
  uint64_t hash(const Json& object, const char* key, const std::string& where = "") {
    const std::optional<uint64_t> value = from_hex(text(object, key, where));
    if (!value) fail(join(where, key), "a hash of 16 hexadecimal digits");
    return value.value_or(0);
  }
  double number(const Json& value, const std::string& where) {
    if (!value.is_number()) return fail(where, "a number"), 0.0;
    return value.get<double>();
  }
  double number(const Json& object, const char* key, const std::string& where) {
    const Json* value = field(object, key, where);
    return value == nullptr ? 0.0 : number(*value, join(where, key));
  }
  dvec3 point(const Json& value, const std::string& where) {
    if (problem) return {};
    if (!value.is_array() || value.size() != 3) return fail(where, "three numbers"), dvec3();
    return {number(value[0], where), number(value[1], where), number(value[2], where)};
  }
  dvec3 point(const Json& object, const char* key, const std::string& where = "") {
    const Json* value = field(object, key, where);
    return value == nullptr ? dvec3() : point(*value, join(where, key));
  }
  const Json& array(const Json& object, const char* key) {
    static const Json kEmpty = Json::array();
    const Json* value = field(object, key, "");
    if (value == nullptr) return kEmpty;
    if (!value->is_array()) return fail(key, "a list"), kEmpty;
    return *value;
  }

 private:
  static std::string join(const std::string& where, const char* key) {
    return where.empty() ? std::string(key) : where + "." + key;
  }
  const Json* fail(const std::string& where, const char* expected) {
    if (!problem) problem = fmt::format("{} must be {}", where, expected);
    return nullptr;
  }
};

}  // namespace farfield
