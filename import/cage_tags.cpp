// SPDX-License-Identifier: Apache-2.0
#include "import/cage_tags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "import/text_cursor.h"

namespace farfield {
namespace {

constexpr int64_t kMostArguments = 1 << 20;  // of a tag: a count is not trusted with memory

/// The arguments of a tag.
struct Tag {
  std::string_view name;
  std::vector<uint32_t> integers;
  std::vector<float> floats;
  std::vector<std::string_view> strings;
};

/// "2/1/0"
bool read_counts(std::string_view word, std::array<int64_t, 3>& counts) {
  TextCursor cursor(word);
  for (size_t i = 0; i < 3; ++i) {
    if (i > 0) {
      if (cursor.peek() != '/') return false;
      cursor.advance();
    }
    if (!cursor.integer(counts[i]) || counts[i] < 0 || counts[i] > kMostArguments) return false;
  }
  return cursor.at_end();
}

bool read_tag(std::string_view line, Tag& tag) {
  TextCursor cursor(line);
  tag.name = cursor.word();
  std::array<int64_t, 3> counts{};
  if (!read_counts(cursor.word(), counts)) return false;
  for (int64_t i = 0; i < counts[0]; ++i) {
    int64_t value = 0;
    if (!cursor.integer(value) || value < 0 || value >= UINT32_MAX) return false;
    tag.integers.push_back(static_cast<uint32_t>(value));
  }
  for (int64_t i = 0; i < counts[1]; ++i) {
    double value = 0;
    if (!cursor.number(value)) return false;
    tag.floats.push_back(static_cast<float>(value));
  }
  for (int64_t i = 0; i < counts[2]; ++i) {
    tag.strings.push_back(cursor.word());
    if (tag.strings.back().empty()) return false;
  }
  return true;
}

/// One sharpness for all of `count` things, or one for each; what is wrong with them, or nothing.
std::string check_sharpness(const Tag& tag, size_t count) {
  if (tag.floats.size() != 1 && tag.floats.size() != count) return "does not give one sharpness, or one for each";
  const bool are_good = std::ranges::all_of(tag.floats, [](float s) { return s >= 0; });
  return are_good ? "" : "has a sharpness that is negative or no number";
}

float sharpness(const Tag& tag, size_t i) { return tag.floats[tag.floats.size() == 1 ? 0 : i]; }

std::string add_creases(const Tag& tag, CageTags& tags) {
  if (tag.integers.empty() || tag.integers.size() % 2 != 0) return "does not name pairs of vertices";
  const size_t count = tag.integers.size() / 2;
  if (std::string wrong = check_sharpness(tag, count); !wrong.empty()) return wrong;
  for (size_t i = 0; i < count; ++i) {
    tags.crease_edges.emplace_back(tag.integers[2 * i], tag.integers[2 * i + 1]);
    tags.crease_sharpness.push_back(sharpness(tag, i));
  }
  return "";
}

std::string add_corners(const Tag& tag, CageTags& tags) {
  if (tag.integers.empty()) return "names no vertex";
  if (std::string wrong = check_sharpness(tag, tag.integers.size()); !wrong.empty()) return wrong;
  for (size_t i = 0; i < tag.integers.size(); ++i) {
    tags.sharp_vertices.push_back(tag.integers[i]);
    tags.vertex_sharpness.push_back(sharpness(tag, i));
  }
  return "";
}

/// RenderMan's numbers.
std::string set_boundary(const Tag& tag, CageTags& tags) {
  if (tag.integers.size() != 1 || tag.integers[0] < 1 || tag.integers[0] > 2) return "is neither 1 nor 2";
  tags.boundary = tag.integers[0] == 1 ? CageBoundary::EdgeAndCorner : CageBoundary::EdgeOnly;
  return "";
}

std::string set_uv(const Tag& tag, CageTags& tags) {
  if (tag.integers.size() != 1 || tag.integers[0] > 5) return "is not 0 to 5";
  tags.uv = static_cast<CageUv>(tag.integers[0]);  // CageUv is in their order
  return "";
}

std::string set_creasing(const Tag& tag, CageTags& tags) {
  const std::string_view method = tag.strings.size() == 1 ? tag.strings[0] : "";
  if (method != "normal" && method != "chaikin") return "is neither normal nor chaikin";
  tags.creasing = method == "chaikin" ? CageCreasing::Chaikin : CageCreasing::Uniform;
  return "";
}

/// Keeps of `things`, with their sharpness, those for which keep() holds.
template <typename Thing, typename Keep>
size_t keep_only(std::vector<Thing>& things, std::vector<float>& sharpness, const Keep& keep) {
  size_t kept = 0;
  for (size_t i = 0; i < things.size(); ++i) {
    if (!keep(things[i])) continue;
    things[kept] = things[i];
    sharpness[kept] = sharpness[i];
    ++kept;
  }
  const size_t dropped = things.size() - kept;
  things.resize(kept);
  sharpness.resize(kept);
  return dropped;
}

}  // namespace

std::string read_cage_tag(std::string_view line, CageTags& tags) {
  Tag tag;
  if (!read_tag(line, tag)) return "is no tag";
  if (tag.name == "crease") return add_creases(tag, tags);
  if (tag.name == "corner") return add_corners(tag, tags);
  if (tag.name == "interpolateboundary") return set_boundary(tag, tags);
  if (tag.name == "facevaryinginterpolateboundary") return set_uv(tag, tags);
  if (tag.name == "creasemethod") return set_creasing(tag, tags);
  if (tag.name != "hole") return "is not known";
  tags.holes.insert(tags.holes.end(), tag.integers.begin(), tag.integers.end());
  return "";
}

size_t drop_tags_out_of_range(CageTags& tags, size_t vertex_count) {
  size_t dropped = keep_only(tags.crease_edges, tags.crease_sharpness,
                             [&](const glm::uvec2& edge) { return edge.x < vertex_count && edge.y < vertex_count; });
  dropped += keep_only(tags.sharp_vertices, tags.vertex_sharpness, [&](uint32_t v) { return v < vertex_count; });
  return dropped;
}

}  // namespace farfield
