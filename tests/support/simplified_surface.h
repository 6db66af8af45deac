// SPDX-License-Identifier: Apache-2.0
// What tests ask of a simplified surface.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "cache/level.h"
#include "prefilter/edge_table.h"
#include "prefilter/material_filter.h"
#include "prefilter/simplify.h"

namespace farfield::test {

/// What holds for every input: indices, maps, materials, finiteness.
inline void expect_valid(const Surface& input, const SimplifyResult& result) {
  const Surface& output = result.surface;
  ASSERT_EQ(result.vertex_map.size(), input.positions.size());
  ASSERT_EQ(result.face_map.size(), input.triangles.size());
  ASSERT_EQ(output.materials.size(), output.triangles.size());
  std::set<uint32_t> vertices_used;
  for (const uvec3& t : output.triangles) {
    ASSERT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
    for (int c = 0; c < 3; ++c) ASSERT_LT(t[c], output.positions.size());
    vertices_used.insert({t.x, t.y, t.z});
  }
  EXPECT_EQ(vertices_used.size(), output.positions.size());
  for (const vec3& p : output.positions) ASSERT_TRUE(is_finite(p));

  // A face goes where its corners go, in the same order, or collapses because two of them meet.
  std::vector<bool> is_vertex_used(input.positions.size(), false);
  uint32_t next_face = 0;
  for (size_t face = 0; face < input.triangles.size(); ++face) {
    const uvec3& t = input.triangles[face];
    uvec3 mapped;
    for (int c = 0; c < 3; ++c) {
      is_vertex_used[t[c]] = true;
      mapped[c] = result.vertex_map[t[c]];
      ASSERT_LT(mapped[c], output.positions.size());
    }
    if (result.face_map[face] == kMorphCollapsed) {
      EXPECT_TRUE(mapped.x == mapped.y || mapped.y == mapped.z || mapped.z == mapped.x);
    } else {
      ASSERT_EQ(result.face_map[face], next_face++);  // faces keep their order
      EXPECT_EQ(output.triangles[result.face_map[face]], mapped);
    }
  }
  EXPECT_EQ(next_face, output.triangles.size());
  for (size_t v = 0; v < input.positions.size(); ++v) {
    if (!is_vertex_used[v]) {
      EXPECT_EQ(result.vertex_map[v], kMorphVoxelized);
    }
  }
}

struct Topology {
  int64_t euler = 0;
  size_t borders = 0, border_edges = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0;
};

/// Faces around a vertex that hang together through edges at it; 1 on a manifold.
inline size_t fan_count(const Surface& surface, uint32_t vertex, const std::vector<uint32_t>& faces) {
  std::vector<bool> is_found(faces.size(), false);
  size_t fans = 0;
  for (size_t first = 0; first < faces.size(); ++first) {
    if (is_found[first]) continue;
    ++fans;
    std::vector<size_t> front = {first};
    is_found[first] = true;
    while (!front.empty()) {
      const uvec3 a = surface.triangles[faces[front.back()]];
      front.pop_back();
      for (size_t i = 0; i < faces.size(); ++i) {
        if (is_found[i]) continue;
        const uvec3 b = surface.triangles[faces[i]];
        int shared = 0;
        for (int j = 0; j < 3; ++j) {
          for (int k = 0; k < 3; ++k) shared += a[j] == b[k] && a[j] != vertex;
        }
        if (shared == 0) continue;
        is_found[i] = true;
        front.push_back(i);
      }
    }
  }
  return fans;
}

inline Topology topology_of(const Surface& surface) {
  Topology topology;
  const EdgeTable edges = build_edge_table(surface.triangles, surface.positions.size());
  std::vector<std::vector<uint32_t>> faces_at(surface.positions.size());
  for (uint32_t face = 0; face < surface.triangles.size(); ++face) {
    for (int c = 0; c < 3; ++c) faces_at[surface.triangles[face][c]].push_back(face);
  }
  const auto used_vertices =
      std::count_if(faces_at.begin(), faces_at.end(), [](const auto& faces) { return !faces.empty(); });
  topology.euler = used_vertices - static_cast<int64_t>(edges.size()) + static_cast<int64_t>(surface.triangles.size());
  std::map<uint32_t, std::vector<uint32_t>> border_next;
  for (uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.faces_of(e).size() > 2) ++topology.nonmanifold_edges;
    if (edges.faces_of(e).size() != 1) continue;
    ++topology.border_edges;
    border_next[edges.smaller_vertex[e]].push_back(edges.larger_vertex[e]);
    border_next[edges.larger_vertex[e]].push_back(edges.smaller_vertex[e]);
  }
  for (uint32_t v = 0; v < surface.positions.size(); ++v)
    topology.nonmanifold_vertices += fan_count(surface, v, faces_at[v]) > 1;
  std::set<uint32_t> seen;
  for (const auto& [start, unused] : border_next) {
    if (seen.count(start)) continue;
    ++topology.borders;
    std::vector<uint32_t> front = {start};
    while (!front.empty()) {
      const uint32_t v = front.back();
      front.pop_back();
      if (!seen.insert(v).second) continue;
      for (const uint32_t w : border_next[v]) front.push_back(w);
    }
  }
  return topology;
}

inline void randomize_materials(Surface& surface) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<float> u;
  for (FaceMaterial& material : surface.materials) {
    material.diffuse = vec3(u(rng), u(rng), u(rng));
    material.specular = vec3(u(rng));
    material.transmission = vec3(u(rng), 0.0f, 0.0f);
    material.roughness2 = u(rng);
    material.sggx = {u(rng), u(rng), u(rng), u(rng), u(rng), u(rng)};
  }
}

/// Material times area, summed over the surface.
inline FaceMaterial total_material(const Surface& surface) {
  FaceMaterial total = mix(surface.materials[0], 0.0f, surface.materials[0], 0.0f);
  for (size_t face = 0; face < surface.triangles.size(); ++face) {
    const uvec3& t = surface.triangles[face];
    const float area = 0.5f * glm::length(glm::cross(surface.positions[t.y] - surface.positions[t.x],
                                                     surface.positions[t.z] - surface.positions[t.x]));
    total = mix(total, 1.0f, surface.materials[face], area);
  }
  return total;
}

}  // namespace farfield::test
