// SPDX-License-Identifier: Apache-2.0
#include "prefilter/weld.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/hash.h"
#include "base/index.h"

namespace farfield {
namespace {
constexpr float kNearOfBounds = 1e-6f;  // what six written decimals can tell apart
constexpr float kNearOfEdge = 0.01f;
// A cell with more vertices than this is finely modelled on purpose; also bounds the work on hostile input.
constexpr int kMaxPerCell = 64;

/// Chained hash table from 64-bit keys to vertex indices. Several vertices may have the same key.
class VertexTable {
 public:
  explicit VertexTable(size_t vertex_count)
      : heads_(std::bit_ceil(std::max<size_t>(16, 2 * vertex_count)), kNoIndex), next_(vertex_count, kNoIndex) {}

  uint32_t first(uint64_t key) const { return heads_[key & (heads_.size() - 1)]; }
  uint32_t next(uint32_t vertex) const { return next_[vertex]; }
  void insert(uint64_t key, uint32_t vertex) {
    uint32_t& head = heads_[key & (heads_.size() - 1)];
    next_[vertex] = head;
    head = vertex;
  }

 private:
  std::vector<uint32_t> heads_, next_;
};

uint64_t position_key(const vec3& p) {
  const vec3 canonical = p + vec3(0.0f);  // -0 + 0 = 0
  uint32_t bits[3];
  std::memcpy(bits, &canonical, sizeof bits);
  return mix64(mix64(bits[0], bits[1]), bits[2]);
}

uint64_t cell_key(const glm::i64vec3& cell) {
  return mix64(mix64(static_cast<uint64_t>(cell.x), static_cast<uint64_t>(cell.y)), static_cast<uint64_t>(cell.z));
}

/// Output vertices by exact position, in order of first use.
WeldResult weld_exactly(std::span<const vec3> positions, std::span<const uint32_t> corner_vertex, const Job& job) {
  WeldResult result;
  result.vertex_of.assign(positions.size(), kNoIndex);
  VertexTable table(positions.size());
  for (const uint32_t vertex : corner_vertex) {
    if (job.is_cancelled()) break;
    uint32_t& target = result.vertex_of[vertex];
    if (target != kNoIndex) continue;
    const uint64_t key = position_key(positions[vertex]);
    for (uint32_t v = table.first(key); v != kNoIndex && target == kNoIndex; v = table.next(v)) {
      if (result.positions[v] == positions[vertex]) target = v;
    }
    if (target != kNoIndex) continue;
    target = static_cast<uint32_t>(result.positions.size());
    result.positions.push_back(positions[vertex]);
    table.insert(key, target);
  }
  return result;
}

/// For each vertex how far another may be to be taken for it.
std::vector<float> tolerances(const WeldResult& exact, std::span<const uint32_t> face_begin,
                              std::span<const uint32_t> corner_vertex, float near_of_bounds) {
  std::vector<float> tolerance(exact.positions.size(), near_of_bounds);
  for (size_t face = 0; face + 1 < face_begin.size(); ++face) {
    const uint32_t begin = face_begin[face], end = face_begin[face + 1];
    for (uint32_t i = begin; i < end; ++i) {
      const uint32_t a = exact.vertex_of[corner_vertex[i]];
      const uint32_t b = exact.vertex_of[corner_vertex[i + 1 == end ? begin : i + 1]];
      if (a == b) continue;
      const float limit = kNearOfEdge * glm::length(exact.positions[a] - exact.positions[b]);
      tolerance[a] = std::min(tolerance[a], limit);
      tolerance[b] = std::min(tolerance[b], limit);
    }
  }
  return tolerance;
}

/// For each vertex an earlier one that it joins, or itself.
class NearWelder {
 public:
  NearWelder(const std::vector<vec3>& positions, const std::vector<float>& tolerance, float largest)
      : positions_(positions), tolerance_(tolerance), table_(positions.size()), scale_(1.0 / (16.0 * largest)) {}

  uint32_t find_or_insert(uint32_t vertex) {
    const vec3& p = positions_[vertex];
    const double reach = tolerance_[vertex];
    // Cells are much larger than the reach, so nearly always this is one cell.
    const glm::i64vec3 lower = cell_of(dvec3(p) - reach), upper = cell_of(dvec3(p) + reach);
    for (int64_t z = lower.z; z <= upper.z; ++z) {
      for (int64_t y = lower.y; y <= upper.y; ++y) {
        for (int64_t x = lower.x; x <= upper.x; ++x) {
          const uint32_t found = find(vertex, cell_key({x, y, z}));
          if (found != kNoIndex) return found;
        }
      }
    }
    table_.insert(cell_key(cell_of(dvec3(p))), vertex);
    return vertex;
  }

 private:
  glm::i64vec3 cell_of(const dvec3& p) const { return glm::i64vec3(glm::floor(p * scale_)); }

  uint32_t find(uint32_t vertex, uint64_t key) const {
    int seen = 0;
    for (uint32_t v = table_.first(key); v != kNoIndex && seen < kMaxPerCell; v = table_.next(v), ++seen) {
      const float distance = glm::length(positions_[v] - positions_[vertex]);
      if (distance <= std::min(tolerance_[v], tolerance_[vertex])) return v;
    }
    return kNoIndex;
  }

  const std::vector<vec3>& positions_;
  const std::vector<float>& tolerance_;
  VertexTable table_;
  double scale_;
};

}  // namespace

WeldResult weld(std::span<const vec3> positions, std::span<const uint32_t> face_begin,
                std::span<const uint32_t> corner_vertex, const Job& job) {
  WeldResult result = weld_exactly(positions, corner_vertex, job);
  if (job.is_cancelled()) return result;
  Box3 bounds;
  for (const vec3& p : result.positions) bounds.extend(p);
  const float near = kNearOfBounds * max_component(bounds.size());
  if (!(near > 0)) return result;

  const std::vector<float> tolerance = tolerances(result, face_begin, corner_vertex, near);
  NearWelder welder(result.positions, tolerance, near);
  std::vector<uint32_t> merged(result.positions.size());
  std::vector<vec3> kept;
  for (uint32_t v = 0; v < merged.size() && !job.is_cancelled(); ++v) {
    const uint32_t target = welder.find_or_insert(v);
    if (target == v) {
      merged[v] = static_cast<uint32_t>(kept.size());
      kept.push_back(result.positions[v]);
    } else {
      merged[v] = merged[target];
      ++result.near_welds;
    }
  }
  if (result.near_welds == 0) return result;
  for (uint32_t& v : result.vertex_of) v = v == kNoIndex ? kNoIndex : merged[v];
  result.positions = std::move(kept);
  return result;
}

}  // namespace farfield
