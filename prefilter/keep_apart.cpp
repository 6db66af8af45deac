// SPDX-License-Identifier: Apache-2.0
#include "prefilter/keep_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/index.h"
#include "base/just_behind.h"
#include "base/parallel.h"
#include "prefilter/ray_scene.h"
#include "prefilter/surface_parts.h"

namespace farfield {

namespace {

// All lengths are parts of the resolution.
constexpr float kReach = 0.5f;       ///< how near a wall must be: twice what simplification may move each of two
constexpr float kTouching = 1e-4f;   ///< walls that are nearer have no side of each other
constexpr float kRoom = 0.01f;       ///< what is left between walls, if as much was
constexpr float kMostMoved = 0.25f;  ///< as simplification itself
constexpr float kLeastArea = 4.0f;   ///< of what runs side by side, in squares of the resolution
constexpr float kMostAcross = 0.1f;  ///< share of that area with the other part on the other side: the two cross
constexpr float kAlongside = 0.5f;   ///< least cosine between normals of walls that run side by side
constexpr float kMostTurned = 0.5f;  ///< least cosine by which a face may turn
constexpr int kMostHits = 16;        ///< of walls along one ray
constexpr int kMostRounds = 6;       ///< what is moved may meet what it had not met before
constexpr size_t kGrain = 1024;      ///< vertices or faces per task

/// Another wall close to a vertex.
struct Neighbour {
  uint32_t part;
  vec3 towards;  ///< unit
  float room;    ///< what is to be left in between
};

/// A wall on the side that the normal points to, and one on the other; part kNoIndex: none.
using Sides = std::array<Neighbour, 2>;
constexpr Neighbour kNobody{kNoIndex, vec3(0.0f), 0.0f};

using PartPair = std::pair<uint32_t, uint32_t>;

/// What a part is to another beside it.
struct PairSums {
  std::array<double, 2> area{};  ///< of it, that has the other on one side and on the other one
  double shrinks = 0;            ///< how much area it loses by moving away from the other, up to a factor
};

/// Normals of vertices, any length. Faces may be wound either way: each adds to the side of what was added before.
std::vector<vec3> vertex_normals(const Surface& surface) {
  std::vector<vec3> normals(surface.positions.size(), vec3(0.0f));
  for (const uvec3& t : surface.triangles) {
    const vec3 &a = surface.positions[t.x], &b = surface.positions[t.y], &c = surface.positions[t.z];
    const vec3 normal = glm::cross(b - a, c - a);
    for (int i = 0; i < 3; ++i) {
      vec3& sum = normals[t[i]];
      sum += glm::dot(sum, normal) < 0 ? -normal : normal;
    }
  }
  return normals;
}

std::optional<vec3> direction_of(const vec3& v) {
  const float length = glm::length(v);
  return length > 0 && std::isfinite(length) ? std::optional(v / length) : std::nullopt;
}

/// Per vertex the number of its part; kNoIndex: no face uses it.
std::vector<uint32_t> parts_of_vertices(const Surface& surface, const SurfaceParts& parts) {
  std::vector<uint32_t> part_of(surface.positions.size(), kNoIndex);
  for (uint32_t part = 0; part < parts.size(); ++part) {
    for (const uint32_t vertex : parts.vertices_of(part)) part_of[vertex] = part;
  }
  return part_of;
}

/// Of the input vertices that became an output vertex, the one that is nearest to it.
std::vector<uint32_t> nearest_sources(const Surface& before, const SimplifyResult& after) {
  const std::vector<vec3>& positions = after.surface.positions;
  std::vector<uint32_t> nearest(positions.size(), kNoIndex);
  const auto distance = [&](uint32_t v, uint32_t w) { return glm::length(before.positions[v] - positions[w]); };
  for (uint32_t v = 0; v < after.vertex_map.size(); ++v) {
    const uint32_t w = after.vertex_map[v];
    if (w >= positions.size()) continue;
    if (nearest[w] == kNoIndex || distance(v, w) < distance(nearest[w], w)) nearest[w] = v;
  }
  return nearest;
}

class Walls {
 public:
  Walls(const Surface& before, float resolution, SimplifyResult& after, std::vector<uint32_t> part_before,
        std::span<const uint8_t> is_pinned)
      : before_(before),
        surface_(after.surface),
        resolution_(resolution),
        is_pinned_(is_pinned),
        part_before_(std::move(part_before)),
        sources_(nearest_sources(before, after)),
        start_(after.surface.positions) {
    part_.resize(sources_.size());
    for (size_t w = 0; w < part_.size(); ++w) part_[w] = sources_[w] == kNoIndex ? kNoIndex : part_before_[sources_[w]];
    first_face_.assign(part_.size(), kNoIndex);
    for (uint32_t f = 0; f < surface_.triangles.size(); ++f) {
      for (int c = 0; c < 3; ++c)
        first_face_[surface_.triangles[f][c]] = std::min(first_face_[surface_.triangles[f][c]], f);
    }
  }

  Result<ApartReport> keep_apart() {
    FARFIELD_TRY(find_neighbours());
    sum_up_pairs();
    for (size_t w = 0; w < sides_.size(); ++w) {
      for (Neighbour& side : sides_[w]) {
        if (side.part != kNoIndex && !runs_beside({part_[w], side.part})) side = kNobody;
      }
    }
    ApartReport report;
    report.walls = static_cast<uint64_t>(std::ranges::count_if(sides_, is_wall));
    if (report.walls == 0) return report;
    for (int round = 0; round < kMostRounds; ++round) {
      FARFIELD_TRY_LET(report.crossing, push_apart());
      if (report.crossing == 0) break;
    }
    if (report.crossing > 0) {
      FARFIELD_TRY_LET(report.crossing, count_crossing());
    }
    for (size_t w = 0; w < start_.size(); ++w) report.moved += surface_.positions[w] != start_[w];
    return report;
  }

 private:
  static bool is_wall(const Sides& sides) { return sides[0].part != kNoIndex || sides[1].part != kNoIndex; }

  bool runs_beside(const PartPair& pair) const {
    const auto found = pairs_.find(pair);
    if (found == pairs_.end()) return false;
    const auto [less, more] = std::minmax(found->second.area[0], found->second.area[1]);
    return less + more >= kLeastArea * resolution_ * resolution_ && less <= kMostAcross * (less + more);
  }
  /// Whether the first part of the pair is the one that makes room for the other.
  bool makes_room(const PartPair& pair) const {
    const auto own = pairs_.find(pair), other = pairs_.find({pair.second, pair.first});
    if (other == pairs_.end()) return true;
    if (own->second.shrinks != other->second.shrinks) return own->second.shrinks > other->second.shrinks;
    return pair.first < pair.second;
  }

  /// Which other part the surface before the simplification has close to each vertex.
  Result<void> find_neighbours() {
    sides_.assign(sources_.size(), {kNobody, kNobody});
    FARFIELD_TRY_LET(const RayScene scene, RayScene::build(before_));
    const std::vector<vec3> normals = vertex_normals(before_);
    parallel_for(sources_.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t w = begin; w < end; ++w) {
        if (sources_[w] == kNoIndex) continue;
        const auto normal = direction_of(normals[sources_[w]]);
        if (!normal) continue;
        sides_[w] = {neighbour(scene, sources_[w], *normal), neighbour(scene, sources_[w], -*normal)};
      }
    });
    return {};
  }

  Neighbour neighbour(const RayScene& scene, uint32_t vertex, const vec3& towards) const {
    float near = 0;
    for (int i = 0; i < kMostHits; ++i) {
      const auto hit = scene.first_hit(before_.positions[vertex], towards, near, kReach * resolution_);
      if (!hit) break;
      const uint32_t part = part_before_[before_.triangles[hit->triangle].x];
      if (part != part_before_[vertex]) {
        const auto normal = direction_of(hit->normal);
        const bool is_beside = normal && std::abs(glm::dot(*normal, towards)) >= kAlongside;
        if (!is_beside || hit->distance < kTouching * resolution_) break;
        return {part, towards, std::min(hit->distance, kRoom * resolution_)};
      }
      if (hit->distance > kTouching * resolution_) break;  // its own part is in between
      near = just_behind(near, hit->distance);
    }
    return kNobody;
  }

  /// The area that a part loses by moving is the sum of what its corners pull at each other.
  void sum_up_pairs() {
    for (const uvec3& t : surface_.triangles) {
      const vec3 corners[] = {surface_.positions[t.x], surface_.positions[t.y], surface_.positions[t.z]};
      const double area = 0.5 * glm::length(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
      for (int c = 0; c < 3; ++c) {
        const vec3 pull = 0.5f * (corners[(c + 1) % 3] + corners[(c + 2) % 3]) - corners[c];
        for (size_t s = 0; s < 2; ++s) {
          const Neighbour& side = sides_[t[c]][s];
          if (side.part == kNoIndex) continue;
          PairSums& sums = pairs_[{part_[t[c]], side.part}];
          sums.area[s] += area / 3;
          sums.shrinks -= static_cast<double>(glm::dot(pull, side.towards));
        }
      }
    }
  }

  /// How far a point beside a part has come through it, and what it would meet; none: it is on its side.
  struct Crossing {
    float depth;
    uint32_t face;
  };
  std::optional<Crossing> crossing(const RayScene& scene, const vec3& point, const Neighbour& side) const {
    const float reach = kReach * resolution_;
    const vec3 start = point - reach * side.towards;
    std::optional<RayHit> found;
    float near = 0;
    for (int i = 0; i < kMostHits; ++i) {
      const auto hit = scene.first_hit(start, side.towards, near, 2 * reach);
      if (!hit) break;
      const bool is_other = part_[surface_.triangles[hit->triangle].x] == side.part;
      const auto off = [&](const RayHit& at) { return std::abs(at.distance - reach); };
      if (is_other && (!found || off(*hit) < off(*found))) found = hit;
      near = just_behind(near, hit->distance);
    }
    if (!found || found->distance >= reach + 0.5f * side.room) return {};  // not to the last digit, or it would not end
    return Crossing{reach + side.room - found->distance, found->triangle};
  }

  /// A point of the surface that lies beside a part, and the corners that move with it.
  struct Sample {
    vec3 point;
    Neighbour side;
    std::array<uint32_t, 3> corners;
  };

  /// Calls visit(Sample) for corners (each in the first face that has it), middles of sides and the middle of a face,
  /// as far as all corners that each is between lie beside the same part.
  template <typename Visit>
  void visit_samples(uint32_t face, Visit&& visit) const {
    const uvec3& t = surface_.triangles[face];
    const auto at = [&](uint32_t v) { return surface_.positions[v]; };
    for (const Neighbour& first : sides_[t.x])
      visit_shared(first, t, [&](const Neighbour& side) {
        visit(Sample{(at(t.x) + at(t.y) + at(t.z)) / 3.0f, side, {t.x, t.y, t.z}});
      });
    for (int c = 0; c < 3; ++c) {
      const uint32_t v = t[c], w = t[(c + 1) % 3];
      for (const Neighbour& first : sides_[v]) {
        if (first.part == kNoIndex) continue;
        if (first_face_[v] == face) visit(Sample{at(v), first, {v, v, v}});
        visit_shared(first, {v, w, w}, [&](const Neighbour& side) {
          visit(Sample{0.5f * (at(v) + at(w)), side, {v, w, w}});
        });
      }
    }
  }

  /// Calls visit(what they have in common) if all three vertices lie beside the part that `first` names.
  template <typename Visit>
  void visit_shared(const Neighbour& first, const uvec3& vertices, Visit&& visit) const {
    if (first.part == kNoIndex) return;
    Neighbour shared{first.part, vec3(0.0f), first.room};
    for (int c = 0; c < 3; ++c) {
      const Neighbour* same = nullptr;
      for (const Neighbour& side : sides_[vertices[c]]) {
        if (side.part == first.part && glm::dot(side.towards, first.towards) > 0) same = &side;
      }
      if (!same) return;
      shared.towards += same->towards;
      shared.room = std::min(shared.room, same->room);
    }
    const auto towards = direction_of(shared.towards);
    if (!towards) return;
    shared.towards = *towards;
    visit(shared);
  }

  struct Push {
    std::array<uint32_t, 3> vertices;
    vec3 by;
  };

  /// What crosses, as how it is to be pushed back; faces in order.
  Result<std::vector<std::vector<Push>>> find_pushes() const {
    FARFIELD_TRY_LET(const RayScene scene, RayScene::build(surface_));
    const size_t tasks = (surface_.triangles.size() + kGrain - 1) / kGrain;
    std::vector<std::vector<Push>> pushes(tasks);
    parallel_for(tasks, 1, [&](size_t begin, size_t end) {
      for (size_t task = begin; task < end; ++task) {
        const size_t last = std::min(surface_.triangles.size(), (task + 1) * kGrain);
        for (size_t f = task * kGrain; f < last; ++f) {
          visit_samples(static_cast<uint32_t>(f), [&](const Sample& sample) {
            const auto found = crossing(scene, sample.point, sample.side);
            if (found) pushes[task].push_back(push_of(sample, *found));
          });
        }
      }
    });
    return pushes;
  }

  Push push_of(const Sample& sample, const Crossing& found) const {
    const vec3 away = found.depth * sample.side.towards;
    if (makes_room({part_[sample.corners[0]], sample.side.part})) return {sample.corners, -away};
    const uvec3& t = surface_.triangles[found.face];
    return {{t.x, t.y, t.z}, away};
  }

  /// Moves what crosses. How many vertices had to.
  Result<uint64_t> push_apart() {
    FARFIELD_TRY_LET(const auto pushes, find_pushes());
    std::vector<vec3> moves(surface_.positions.size(), vec3(0.0f));
    for (const auto& of_task : pushes) {
      for (const Push& push : of_task) {
        for (const uint32_t v : push.vertices) {
          if (glm::dot(push.by, push.by) > glm::dot(moves[v], moves[v])) moves[v] = push.by;
        }
      }
    }
    for (size_t v = 0; v < is_pinned_.size(); ++v) {
      if (is_pinned_[v]) moves[v] = vec3(0.0f);
    }
    leave_faces_standing(moves);
    for (size_t v = 0; v < moves.size(); ++v) surface_.positions[v] = moved(v, moves[v]);
    return static_cast<uint64_t>(std::ranges::count_if(moves, [](const vec3& move) { return move != vec3(0.0f); }));
  }

  vec3 moved(size_t vertex, const vec3& by) const {
    const vec3 away = surface_.positions[vertex] + by - start_[vertex];
    const float length = glm::length(away), most = kMostMoved * resolution_;
    return start_[vertex] + (length > most ? away * (most / length) : away);
  }

  /// Takes back what would turn a face over.
  void leave_faces_standing(std::vector<vec3>& moves) const {
    for (bool is_done = false; !is_done;) {
      is_done = true;
      for (const uvec3& t : surface_.triangles) {
        if (moves[t.x] == vec3(0.0f) && moves[t.y] == vec3(0.0f) && moves[t.z] == vec3(0.0f)) continue;
        const vec3 a = moved(t.x, moves[t.x]), b = moved(t.y, moves[t.y]), c = moved(t.z, moves[t.z]);
        const vec3 after = glm::cross(b - a, c - a);
        const vec3 before = glm::cross(start_[t.y] - start_[t.x], start_[t.z] - start_[t.x]);
        if (glm::dot(before, after) >= kMostTurned * glm::length(before) * glm::length(after)) continue;
        moves[t.x] = moves[t.y] = moves[t.z] = vec3(0.0f);
        is_done = false;
      }
    }
  }

  /// Vertices on the wrong side of a wall, or of which a face is.
  Result<uint64_t> count_crossing() const {
    FARFIELD_TRY_LET(const auto pushes, find_pushes());
    std::vector<uint8_t> is_crossing(surface_.positions.size(), 0);
    for (const auto& of_task : pushes) {
      for (const Push& push : of_task) {
        for (const uint32_t v : push.vertices) is_crossing[v] = 1;
      }
    }
    return static_cast<uint64_t>(std::ranges::count(is_crossing, 1));
  }

  const Surface& before_;
  Surface& surface_;
  const float resolution_;
  const std::span<const uint8_t> is_pinned_;
  const std::vector<uint32_t> part_before_;  ///< per vertex before
  const std::vector<uint32_t> sources_;      ///< per vertex after: the vertex before that stands for it
  const std::vector<vec3> start_;            ///< positions after the simplification
  std::vector<uint32_t> part_;               ///< per vertex after
  std::vector<uint32_t> first_face_;         ///< per vertex after, of those that have it
  std::vector<Sides> sides_;                 ///< per vertex after
  std::map<PartPair, PairSums> pairs_;
};

}  // namespace

Result<ApartReport> keep_apart(const Surface& macrosurface, float resolution, SimplifyResult& simplified,
                               std::span<const uint8_t> is_pinned) {
  if (!(resolution > 0)) return ApartReport{};
  const SurfaceParts parts = find_parts(macrosurface);
  if (parts.size() < 2) return ApartReport{};
  return Walls(macrosurface, resolution, simplified, parts_of_vertices(macrosurface, parts), is_pinned).keep_apart();
}

}  // namespace farfield
