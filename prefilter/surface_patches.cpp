// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface_patches.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/index.h"

namespace farfield {
namespace {

/// Length of a triangle's longest edge over the height on it, above which the middle of that edge represents the
/// triangle better than its centre of mass (thesis 7.2.2). The halves of a square have 2: both are judged from the
/// square's middle, so that quads rarely fall apart. An equilateral triangle has 1.15.
constexpr double kElongated = 1.5;

/// Calls visit(face, neighbour) for each pair of faces of different blocks that share an edge, both ways.
template <typename Visit>
void for_each_border(const EdgeTable& edges, const std::vector<uint32_t>& block_of_face, Visit&& visit) {
  for (uint32_t edge = 0; edge < edges.size(); ++edge) {
    for (const uint32_t face : edges.faces_of(edge)) {
      for (const uint32_t neighbour : edges.faces_of(edge)) {
        if (block_of_face[face] != block_of_face[neighbour]) visit(face, neighbour);
      }
    }
  }
}

}  // namespace

dvec3 evaluation_point(const Surface& surface, uint32_t face) {
  const std::array<dvec3, 3> p = {corner_position(surface, face, 0), corner_position(surface, face, 1),
                                  corner_position(surface, face, 2)};
  int longest = 0;
  double longest2 = -1;
  for (int c = 0; c < 3; ++c) {
    const dvec3 edge = p[static_cast<size_t>(next_corner(c))] - p[static_cast<size_t>(c)];
    if (glm::dot(edge, edge) > longest2) longest2 = glm::dot(edge, edge), longest = c;
  }
  const double twice_area = glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  const bool is_elongated = longest2 > kElongated * twice_area;
  if (!is_elongated) return (p[0] + p[1] + p[2]) / 3.0;
  return 0.5 * (p[static_cast<size_t>(longest)] + p[static_cast<size_t>(next_corner(longest))]);
}

Patches make_patches(const Surface& surface, const EdgeTable& edges, double radius) {
  Patches patches;
  patches.patch_of_face.assign(surface.triangles.size(), kNoIndex);
  std::vector<uint32_t> front;
  for (uint32_t seed = 0; seed < surface.triangles.size(); ++seed) {
    if (patches.patch_of_face[seed] != kNoIndex) continue;
    const uint32_t patch = static_cast<uint32_t>(patches.seeds.size());
    patches.seeds.push_back(seed);
    patches.patch_of_face[seed] = patch;
    const dvec3 center = evaluation_point(surface, seed);
    const auto is_near = [&](uint32_t face) {
      for (int c = 0; c < 3; ++c) {
        const dvec3 offset = corner_position(surface, face, c) - center;
        if (!(glm::dot(offset, offset) <= radius * radius)) return false;
      }
      return true;
    };
    front.assign(1, seed);
    while (!front.empty()) {
      const uint32_t face = front.back();
      front.pop_back();
      for (int c = 0; c < 3; ++c) {
        for (const uint32_t neighbour : edges.faces_of(edges.face_edges[face][c])) {
          if (patches.patch_of_face[neighbour] != kNoIndex || !is_near(neighbour)) continue;
          patches.patch_of_face[neighbour] = patch;
          front.push_back(neighbour);
        }
      }
    }
  }
  return patches;
}

Blocks make_blocks(const Surface& surface, const EdgeTable& edges, double radius) {
  Patches patches = make_patches(surface, edges, radius);
  Blocks blocks;
  blocks.block_of_face = std::move(patches.patch_of_face);
  for (const uint32_t seed : patches.seeds) blocks.center.push_back(evaluation_point(surface, seed));
  blocks.face_count.assign(blocks.center.size(), 0);
  blocks.radius.assign(blocks.center.size(), 0);
  for (uint32_t face = 0; face < blocks.block_of_face.size(); ++face) {
    const uint32_t block = blocks.block_of_face[face];
    ++blocks.face_count[block];
    for (int c = 0; c < 3; ++c) {
      const double distance = glm::length(corner_position(surface, face, c) - blocks.center[block]);
      blocks.radius[block] = std::max(blocks.radius[block], distance);
    }
  }
  blocks.first_outside.assign(blocks.center.size() + 1, 0);
  for_each_border(edges, blocks.block_of_face,
                  [&](uint32_t face, uint32_t) { ++blocks.first_outside[blocks.block_of_face[face] + 1]; });
  std::partial_sum(blocks.first_outside.begin(), blocks.first_outside.end(), blocks.first_outside.begin());
  blocks.outside.resize(blocks.first_outside.back());
  std::vector<uint32_t> next = blocks.first_outside;
  for_each_border(edges, blocks.block_of_face, [&](uint32_t face, uint32_t neighbour) {
    blocks.outside[next[blocks.block_of_face[face]]++] = neighbour;
  });
  return blocks;
}

}  // namespace farfield
