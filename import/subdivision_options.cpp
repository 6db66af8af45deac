// SPDX-License-Identifier: Apache-2.0
#include "import/subdivision_options.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/hash.h"

namespace farfield {
namespace {

/// Goes up when the same cage and options give other faces.
constexpr int kSubdivisionVersion = 1;

constexpr std::array<std::pair<SubdivisionScheme, const char*>, 3> kSchemes{
    {{SubdivisionScheme::None, "none"},
     {SubdivisionScheme::CatmullClark, "catmull-clark"},
     {SubdivisionScheme::Loop, "loop"}}};
constexpr std::array<std::pair<CageBoundary, const char*>, 2> kBoundaries{
    {{CageBoundary::EdgeAndCorner, "edge-and-corner"}, {CageBoundary::EdgeOnly, "edge-only"}}};
constexpr std::array<std::pair<CageUv, const char*>, 6> kUvRules{{{CageUv::None, "none"},
                                                                  {CageUv::CornersOnly, "corners-only"},
                                                                  {CageUv::CornersPlus1, "corners-plus1"},
                                                                  {CageUv::CornersPlus2, "corners-plus2"},
                                                                  {CageUv::Boundaries, "boundaries"},
                                                                  {CageUv::All, "all"}}};

template <typename Table, typename Value>
const char* name_in(const Table& table, Value value) {
  for (const auto& [known, name] : table)
    if (known == value) return name;
  return "";
}

template <typename Value, size_t N>
Result<Value> parse_in(const std::array<std::pair<Value, const char*>, N>& table, const std::string& text) {
  std::string names;
  for (const auto& [value, name] : table) {
    if (text == name) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is none of {}", text, names));
}

bool is_usual(const SubdivisionOptions& options) {
  const SubdivisionOptions usual;
  return options.scheme == usual.scheme && options.error == usual.error && options.edge == usual.edge &&
         options.boundary == usual.boundary && options.uv == usual.uv && options.displace == usual.displace &&
         options.detail == usual.detail && options.most_faces == usual.most_faces;
}

/// All but the grid, which is the bake's.
std::string text_without_grid(const SubdivisionOptions& options) {
  if (is_usual(options)) return "";
  std::string text =
      fmt::format("subdivide={}/{} error={}", name_of(options.scheme), kSubdivisionVersion, options.error);
  if (options.edge > 0) text += fmt::format(" edge={}", options.edge);
  if (options.boundary) text += fmt::format(" boundary={}", name_of(*options.boundary));
  if (options.uv) text += fmt::format(" uv_rule={}", name_of(*options.uv));
  if (options.most_faces != SubdivisionOptions{}.most_faces) text += fmt::format(" faces={}", options.most_faces);
  if (!options.displace) text += " undisplaced";
  if (options.detail != SubdivisionOptions{}.detail) text += fmt::format(" detail={}", options.detail);
  return text;
}

}  // namespace

Result<void> check_options(const SubdivisionOptions& options) {
  constexpr double kLeast = 1e-4;  // of either: rounding is not far below, and nothing would see it
  if (!(options.error >= kLeast) || !std::isfinite(options.error)) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the error of a subdivision must be at least {} and "
                                                              "finite, not {}",
                                                              kLeast, options.error));
  }
  if (!(options.edge == 0 || options.edge >= kLeast) || !std::isfinite(options.edge)) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the longest edge of a subdivision must be 0 or at least "
                                                              "{} and finite, not {}",
                                                              kLeast, options.edge));
  }
  if (!(options.detail >= kLeast) || !std::isfinite(options.detail)) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the detail of displacement maps must be at least {} "
                                                              "and finite, not {}",
                                                              kLeast, options.detail));
  }
  return {};
}

std::string canonical_text(const SubdivisionOptions& options) {
  const std::string text = text_without_grid(options);
  return text.empty() ? text : fmt::format("{} cage_grid={} ", text, options.grid);
}

uint64_t hash_of(const SubdivisionOptions& options) {
  const std::string text = text_without_grid(options);
  return text.empty() ? 0 : hash_values(std::span<const char>(text));
}

const char* name_of(SubdivisionScheme scheme) { return name_in(kSchemes, scheme); }
const char* name_of(CageBoundary boundary) { return name_in(kBoundaries, boundary); }
const char* name_of(CageUv uv) { return name_in(kUvRules, uv); }

Result<SubdivisionScheme> parse_subdivision_scheme(const std::string& name) { return parse_in(kSchemes, name); }
Result<std::optional<CageBoundary>> parse_cage_boundary(const std::string& name) { return parse_in(kBoundaries, name); }
Result<std::optional<CageUv>> parse_cage_uv(const std::string& name) { return parse_in(kUvRules, name); }

}  // namespace farfield
