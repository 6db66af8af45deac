// SPDX-License-Identifier: Apache-2.0
#include "prefilter/edge_table.h"

#include <algorithm>

namespace farfield {

namespace {

struct HalfEdge {
  uint32_t larger_vertex, face, corner;
};

/// Half-edges grouped by their smaller vertex (a counting sort), each group sorted by larger vertex, then face.
struct GroupedHalfEdges {
  std::vector<uint32_t> begin;
  std::vector<HalfEdge> half_edges;
};

GroupedHalfEdges group_half_edges(std::span<const uvec3> triangles, size_t vertex_count) {
  GroupedHalfEdges groups;
  groups.begin.assign(vertex_count + 1, 0);
  const auto for_each_half_edge = [&](const auto& visit) {
    for (uint32_t face = 0; face < triangles.size(); ++face) {
      for (uint32_t corner = 0; corner < 3; ++corner) {
        const auto [smaller, larger] = std::minmax<uint32_t>(triangles[face][static_cast<int>(corner)],
                                                             triangles[face][static_cast<int>((corner + 1) % 3)]);
        visit(smaller, HalfEdge{larger, face, corner});
      }
    }
  };
  for_each_half_edge([&](uint32_t smaller, const HalfEdge&) { ++groups.begin[smaller + 1]; });
  for (size_t v = 0; v < vertex_count; ++v) groups.begin[v + 1] += groups.begin[v];

  std::vector<uint32_t> next(groups.begin.begin(), groups.begin.end() - 1);
  groups.half_edges.resize(triangles.size() * 3);
  for_each_half_edge(
      [&](uint32_t smaller, const HalfEdge& half_edge) { groups.half_edges[next[smaller]++] = half_edge; });
  for (size_t v = 0; v < vertex_count; ++v) {
    // Filled in ascending face order, so a stable sort keeps the faces of an edge ascending.
    std::stable_sort(groups.half_edges.begin() + groups.begin[v], groups.half_edges.begin() + groups.begin[v + 1],
                     [](const HalfEdge& a, const HalfEdge& b) { return a.larger_vertex < b.larger_vertex; });
  }
  return groups;
}

}  // namespace

EdgeTable build_edge_table(std::span<const uvec3> triangles, size_t vertex_count) {
  const GroupedHalfEdges groups = group_half_edges(triangles, vertex_count);
  EdgeTable table;
  table.face_edges.resize(triangles.size());
  table.faces.reserve(groups.half_edges.size());
  for (uint32_t smaller = 0; smaller < vertex_count; ++smaller) {
    for (uint32_t i = groups.begin[smaller]; i < groups.begin[smaller + 1]; ++i) {
      const HalfEdge& half_edge = groups.half_edges[i];
      const bool is_new =
          i == groups.begin[smaller] || groups.half_edges[i - 1].larger_vertex != half_edge.larger_vertex;
      if (is_new) {
        table.first_face.push_back(static_cast<uint32_t>(table.faces.size()));
        table.smaller_vertex.push_back(smaller);
        table.larger_vertex.push_back(half_edge.larger_vertex);
      }
      table.face_edges[half_edge.face][static_cast<int>(half_edge.corner)] = table.size() - 1;
      table.faces.push_back(half_edge.face);
    }
  }
  table.first_face.push_back(static_cast<uint32_t>(table.faces.size()));
  return table;
}

bool runs_upwards(std::span<const uvec3> triangles, const EdgeTable& edges, uint32_t face, uint32_t edge) {
  const uvec3& of_face = edges.face_edges[face];
  const int corner = of_face.x == edge ? 0 : of_face.y == edge ? 1 : 2;
  return triangles[face][corner] == edges.smaller_vertex[edge];
}

std::vector<uint8_t> flipped_faces(std::span<const uvec3> triangles, const EdgeTable& edges) {
  std::vector<uint8_t> is_flipped(triangles.size(), 0), is_found(triangles.size(), 0);
  std::vector<uint32_t> front;
  for (uint32_t first = 0; first < triangles.size(); ++first) {
    if (is_found[first]) continue;
    is_found[first] = 1;
    front.assign(1, first);
    while (!front.empty()) {
      const uint32_t face = front.back();
      front.pop_back();
      for (int c = 0; c < 3; ++c) {
        const uint32_t edge = edges.face_edges[face][c];
        const auto faces = edges.faces_of(edge);
        if (faces.size() != 2) continue;
        const uint32_t neighbour = faces[0] == face ? faces[1] : faces[0];
        if (is_found[neighbour]) continue;
        is_found[neighbour] = 1;
        is_flipped[neighbour] = is_flipped[face] ^ (runs_upwards(triangles, edges, face, edge) ==
                                                    runs_upwards(triangles, edges, neighbour, edge));
        front.push_back(neighbour);
      }
    }
  }
  return is_flipped;
}

}  // namespace farfield
