// SPDX-License-Identifier: Apache-2.0
#include "cache/level.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scattering/fog_phase.h"

namespace farfield {

namespace {

/// [0, 1] to 0 .. 255, rounded. NaN gives 0.
uint8_t to_unorm8(float x) {
  if (!(x > 0.0f)) return 0;
  return static_cast<uint8_t>(std::lround(255.0f * std::min(x, 1.0f)));
}

}  // namespace

Box3 active_box(const Brick& brick) {
  static_assert(kBrickSide == 8);  // a word is a slice of constant z, and a byte of it a row along x
  uint64_t slices = 0, slice = 0, rows = 0, row = 0;
  for (int z = 0; z < kBrickSide; ++z) {
    const uint64_t word = brick.mask[static_cast<size_t>(z)];
    slices |= uint64_t{word != 0} << z;
    slice |= word;
  }
  for (int y = 0; y < kBrickSide; ++y) {
    const uint64_t byte = (slice >> (8 * y)) & 0xff;
    rows |= uint64_t{byte != 0} << y;
    row |= byte;
  }
  if (slices == 0) return {};
  const auto first = [](uint64_t bits) { return static_cast<float>(std::countr_zero(bits)); };
  const auto end = [](uint64_t bits) { return static_cast<float>(std::bit_width(bits)); };
  return {{first(row), first(rows), first(slices)}, {end(row), end(rows), end(slices)}};
}

uint8_t pack_unorm8(float x) { return to_unorm8(x); }

PackedColor pack_color(const vec3& linear_rgb) {
  PackedColor packed;
  for (int i = 0; i < 3; ++i) packed.sqrt_rgb[static_cast<size_t>(i)] = to_unorm8(std::sqrt(linear_rgb[i]));
  return packed;
}

PackedSheetShape pack_sheet_shape(const SheetShape& shape) {
  if (!shape.is_sheet()) return {};
  return {to_unorm8(shape.edge), std::max(to_unorm8(shape.order), uint8_t{1}), to_unorm8(shape.caught)};
}

SheetShape unpack_sheet_shape(PackedSheetShape shape) {
  return {unpack_unorm8(shape.edge), unpack_unorm8(shape.order), unpack_unorm8(shape.caught)};
}

vec3 unpack_color(PackedColor color) {
  const vec3 root(unpack_unorm8(color.sqrt_rgb[0]), unpack_unorm8(color.sqrt_rgb[1]), unpack_unorm8(color.sqrt_rgb[2]));
  return root * root;
}

PackedAlbedo pack_albedo(const vec3& albedo) {
  PackedAlbedo packed;
  for (int i = 0; i < 3; ++i) {
    const float root = std::sqrt(std::fmin(std::fmax(albedo[i], 0.0f), 1.0f));  // NaN becomes 0
    packed.angle_rgb[static_cast<size_t>(i)] = to_unorm8(std::asin(root) / (0.5f * kPi));
  }
  return packed;
}

vec3 unpack_albedo(PackedAlbedo albedo) {
  vec3 result;
  for (int i = 0; i < 3; ++i) {
    const uint8_t angle = albedo.angle_rgb[static_cast<size_t>(i)];
    const float root = std::sin(0.5f * kPi * unpack_unorm8(angle));
    result[i] = angle == 255 ? 1.0f : root * root;
  }
  return result;
}

int8_t pack_anisotropy(float g) {
  if (!(std::abs(g) > 0)) return 0;  // NaN, too
  return static_cast<int8_t>(std::lround(127 * std::clamp(g, -kMostFogAnisotropy, kMostFogAnisotropy)));
}

PackedVertexColor pack_vertex_color(const vec4& linear_rgba) {
  PackedVertexColor packed;
  for (int i = 0; i < 4; ++i) packed.sqrt_rgba[static_cast<size_t>(i)] = to_unorm8(std::sqrt(linear_rgba[i]));
  return packed;
}

vec4 unpack_vertex_color(PackedVertexColor color) {
  vec4 root;
  for (int i = 0; i < 4; ++i) root[i] = unpack_unorm8(color.sqrt_rgba[static_cast<size_t>(i)]);
  return root * root;
}

PackedRadiance pack_radiance(const vec3& radiance) {
  constexpr float kLeast = 1e-30f, kMost = 1e30f;
  const float largest = std::min(max_component(radiance), kMost);
  if (!(largest >= kLeast)) return {};
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest < 2^exponent
  // Rounding up to 256 takes the next exponent.
  if (std::lround(std::ldexp(largest, 8 - exponent)) > 255) ++exponent;
  PackedRadiance packed;
  for (int i = 0; i < 3; ++i) {
    const float channel = radiance[i] > 0 ? std::min(radiance[i], kMost) : 0.0f;
    packed.rgbe[static_cast<size_t>(i)] = static_cast<uint8_t>(std::lround(std::ldexp(channel, 8 - exponent)));
  }
  packed.rgbe[3] = static_cast<uint8_t>(exponent + 128);
  return packed;
}

vec3 unpack_radiance(PackedRadiance radiance) {
  if (radiance.rgbe[3] == 0) return vec3(0.0f);
  const float unit = std::ldexp(1.0f, int{radiance.rgbe[3]} - 128 - 8);
  return unit * vec3(radiance.rgbe[0], radiance.rgbe[1], radiance.rgbe[2]);
}

PackedNormal pack_normal(const vec3& unit_normal) {
  const vec3 n = unit_normal / (std::abs(unit_normal.x) + std::abs(unit_normal.y) + std::abs(unit_normal.z));
  const auto sign = [](float x) { return x < 0 ? -1.0f : 1.0f; };
  const vec2 p = n.z >= 0 ? vec2(n) : vec2((1 - std::abs(n.y)) * sign(n.x), (1 - std::abs(n.x)) * sign(n.y));
  const auto pack = [](float x) { return static_cast<int16_t>(std::lround(std::clamp(x, -1.0f, 1.0f) * 32767.0f)); };
  return {{pack(p.x), pack(p.y)}};
}

vec3 unpack_normal(PackedNormal normal) {
  const auto at = [&](size_t i) { return std::max(static_cast<float>(normal.octahedral[i]) / 32767.0f, -1.0f); };
  vec3 n(at(0), at(1), 0);
  n.z = 1 - std::abs(n.x) - std::abs(n.y);
  const float below = std::max(-n.z, 0.0f);
  n.x += n.x < 0 ? below : -below;
  n.y += n.y < 0 ? below : -below;
  return glm::normalize(n);
}

LevelData copy_of(const LevelView& level) {
  LevelData data;
  data.header = level.header;
#define FARFIELD_COPY(id, Name, field, Element, Group) data.field.assign(level.field.begin(), level.field.end());
  FARFIELD_LEVEL_ARRAYS(FARFIELD_COPY)
#undef FARFIELD_COPY
  return data;
}

}  // namespace farfield
