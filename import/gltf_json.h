// SPDX-License-Identifier: Apache-2.0
// The JSON of a glTF file, before anybody says what it means. Internal to the room.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>

namespace farfield {

/// tinygltf walks `extras` recursively: a deeper document could overflow the stack.
inline constexpr int kMaxJsonDepth = 200;

bool is_binary_gltf(std::span<const unsigned char> bytes);
/// Whether the text begins as a JSON object does.
bool may_be_json(std::span<const unsigned char> text);
/// The JSON text of a .glb, or all of a .gltf.
std::span<const unsigned char> json_text(std::span<const unsigned char> bytes);
/// The binary chunk of a .glb; empty where there is none.
std::span<const unsigned char> binary_chunk(std::span<const unsigned char> bytes);
/// Whether a JSON text is nested deeper than kMaxJsonDepth.
bool is_too_deep(std::span<const unsigned char> json);

/// Nothing if the text is no JSON object, or nested too deep.
std::optional<nlohmann::json> parse_json(std::span<const unsigned char> text);

}  // namespace farfield
