// SPDX-License-Identifier: Apache-2.0
#include "prefilter/gentle_slopes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"

namespace farfield {
namespace {

/// One look around serves the faces around a point within this fraction of the resolution. Larger patches are fewer,
/// but must be smooth farther out.
constexpr double kPatchRadius = 0.5;

/// Between a normal and the axis, in radians: slopes are below 1 at 45 degrees.
constexpr double kMostAngle = 0.72;

/// Blocks larger than this fraction of the resolution are explored without a look.
constexpr double kLargeBlock = 0.5;

/// How smooth a block is.
struct Slope {
  dvec3 normal{0.0};        ///< sum of its faces' area vectors, as they are turned
  dvec3 direction{0.0};     ///< of it
  double least_cosine = 2;  ///< between it and an axis to which all its normals are near; 2: none is
};

/// Sides of faces that agree across edges of two faces, as far as winding allows.
class Sides {
 public:
  Sides(const Surface& surface, const EdgeTable& edges)
      : surface_(surface), edges_(edges), is_flipped_(flipped_faces(surface.triangles, edges)) {}

  /// Area vector, twice as long as the area is large.
  dvec3 normal(uint32_t face) const {
    const dvec3 a = corner_position(surface_, face, 0);
    const dvec3 normal = glm::cross(corner_position(surface_, face, 1) - a, corner_position(surface_, face, 2) - a);
    return is_flipped_[face] ? -normal : normal;
  }

  /// Whether two faces meet at the edge, and have the same side there.
  bool agree_at(uint32_t edge) const {
    const auto faces = edges_.faces_of(edge);
    return faces.size() == 2 && runs_forward(faces[0], edge) != runs_forward(faces[1], edge);
  }

 private:
  /// From the edge's smaller vertex to its larger one, on the face's side.
  bool runs_forward(uint32_t face, uint32_t edge) const {
    return runs_upwards(surface_.triangles, edges_, face, edge) != (is_flipped_[face] != 0);
  }

  const Surface& surface_;
  const EdgeTable& edges_;
  const std::vector<uint8_t> is_flipped_;
};

std::vector<Slope> block_slopes(const Surface& surface, const EdgeTable& edges, const Blocks& blocks) {
  const Sides sides(surface, edges);
  std::vector<Slope> slopes(blocks.center.size());
  for (uint32_t face = 0; face < surface.triangles.size(); ++face) {
    slopes[blocks.block_of_face[face]].normal += sides.normal(face);
  }
  for (Slope& slope : slopes) slope.direction = glm::normalize(slope.normal);
  std::vector<double> cosine(slopes.size(), 1);  // of the half angle of the cone around all its normals
  for (uint32_t face = 0; face < surface.triangles.size(); ++face) {
    const uint32_t block = blocks.block_of_face[face];
    const dvec3 normal = glm::normalize(sides.normal(face));
    const uvec3& e = edges.face_edges[face];
    const bool has_border = !sides.agree_at(e.x) || !sides.agree_at(e.y) || !sides.agree_at(e.z);
    const double own = has_border ? -1 : glm::dot(normal, slopes[block].direction);
    cosine[block] = own > -1 ? std::min(cosine[block], own) : -1;  // no direction, no cone
  }
  for (size_t i = 0; i < slopes.size(); ++i) {
    const double half_angle = std::acos(cosine[i]);
    if (half_angle <= kMostAngle) slopes[i].least_cosine = std::cos(kMostAngle - half_angle);
  }
  return slopes;
}

/// Looks around points. Keeps its scratch memory between calls; one thread at a time.
class SlopeExplorer {
 public:
  SlopeExplorer(const Blocks& blocks, const std::vector<Slope>& slopes, double radius)
      : blocks_(blocks), slopes_(slopes), radius_(radius), round_of_block_(slopes.size()) {}

  /// Whether all blocks that are connected to this one and touch the ball around the point are gentle.
  bool is_gentle_around(const dvec3& center, uint32_t block) {
    ++round_;
    reached_.clear();
    reach(center, block);
    dvec3 sum(0.0);
    for (size_t i = 0; i < reached_.size(); ++i) {
      const Slope& slope = slopes_[reached_[i]];
      if (!(slope.least_cosine <= 1 && glm::dot(slope.direction, slopes_[block].direction) > 0)) return false;
      sum += slope.normal;
      for (const uint32_t face : blocks_.outside_of(reached_[i])) reach(center, blocks_.block_of_face[face]);
    }
    const dvec3 axis = glm::normalize(sum);
    return std::ranges::all_of(
        reached_, [&](uint32_t i) { return glm::dot(slopes_[i].direction, axis) >= slopes_[i].least_cosine; });
  }

 private:
  void reach(const dvec3& center, uint32_t block) {
    const double reach = radius_ + blocks_.radius[block];
    const dvec3 offset = blocks_.center[block] - center;
    if (!(glm::dot(offset, offset) <= reach * reach) || std::exchange(round_of_block_[block], round_) == round_) return;
    reached_.push_back(block);
  }

  const Blocks& blocks_;
  const std::vector<Slope>& slopes_;
  const double radius_;
  uint32_t round_ = 0;                    ///< counts calls
  std::vector<uint32_t> round_of_block_;  ///< in which it was last reached
  std::vector<uint32_t> reached_;
};

}  // namespace

std::vector<uint8_t> find_gentle_faces(const Surface& surface, const EdgeTable& edges, const Blocks& blocks,
                                       double resolution, const Job& job) {
  const Patches patches = make_patches(surface, edges, kPatchRadius * resolution);
  const std::vector<Slope> slopes = block_slopes(surface, edges, blocks);
  std::vector<uint8_t> is_gentle(patches.seeds.size());
  const size_t grain = std::max<size_t>(256, patches.seeds.size() / 64);  // an explorer has room for each block
  parallel_for(patches.seeds.size(), grain, [&](size_t begin, size_t end) {
    SlopeExplorer explorer(blocks, slopes, (1 + kPatchRadius) * resolution);
    for (size_t i = begin; i < end && !job.is_cancelled(); ++i) {
      const uint32_t seed = patches.seeds[i], block = blocks.block_of_face[seed];
      is_gentle[i] = blocks.radius[block] <= kLargeBlock * resolution &&
                     explorer.is_gentle_around(evaluation_point(surface, seed), block);
    }
  });
  std::vector<uint8_t> result(surface.triangles.size());
  for (size_t face = 0; face < result.size(); ++face) result[face] = is_gentle[patches.patch_of_face[face]];
  return result;
}

}  // namespace farfield
