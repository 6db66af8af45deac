// SPDX-License-Identifier: Apache-2.0
#include "prefilter/scheme_parts.h"

#include <algorithm>
#include <limits>

#include "base/index.h"

namespace farfield {
namespace {

/// Creases, corners and holes of what was taken; kNoIndex: not taken.
CageTags tags_of(const CageTags& tags, const std::vector<uint32_t>& point, const std::vector<uint32_t>& face) {
  CageTags out;
  out.boundary = tags.boundary;
  out.uv = tags.uv;
  out.creasing = tags.creasing;
  for (size_t i = 0; i < tags.crease_edges.size(); ++i) {
    const uint32_t a = point[tags.crease_edges[i].x], b = point[tags.crease_edges[i].y];
    if (a == kNoIndex || b == kNoIndex) continue;
    out.crease_edges.emplace_back(a, b);
    out.crease_sharpness.push_back(tags.crease_sharpness[i]);
  }
  for (size_t i = 0; i < tags.sharp_vertices.size(); ++i) {
    if (point[tags.sharp_vertices[i]] == kNoIndex) continue;
    out.sharp_vertices.push_back(point[tags.sharp_vertices[i]]);
    out.vertex_sharpness.push_back(tags.vertex_sharpness[i]);
  }
  for (const uint32_t hole : tags.holes) {
    if (face[hole] != kNoIndex) out.holes.push_back(face[hole]);
  }
  return out;
}

/// Appends `more`, or `missing` for each corner that lacks a value.
template <typename T>
void append_corners(const std::vector<T>& more, size_t before, size_t after, const T& missing, std::vector<T>& out) {
  if (more.empty() && out.empty()) return;
  out.resize(before, missing);
  out.insert(out.end(), more.begin(), more.end());
  out.resize(after, missing);
}

}  // namespace

SourceMesh take_scheme(const SourceMesh& mesh, SubdivisionScheme scheme, SubdivisionScheme usual) {
  SourceMesh out;
  out.materials = mesh.materials;
  out.heights = mesh.heights;
  out.material_function = mesh.material_function;
  out.material_batch = mesh.material_batch;
  out.is_split = mesh.is_split;
  std::vector<uint32_t> point(mesh.positions.size(), kNoIndex), face_as(mesh.face_count(), kNoIndex);
  for (uint32_t face = 0; face < mesh.face_count(); ++face) {
    if (mesh.face_scheme[face].value_or(usual) != scheme) continue;
    face_as[face] = static_cast<uint32_t>(out.face_count());
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) {
      uint32_t& p = point[mesh.corner_position[i]];
      if (p == kNoIndex) {
        p = static_cast<uint32_t>(out.positions.size());
        out.positions.push_back(mesh.positions[mesh.corner_position[i]]);
      }
      out.corner_position.push_back(p);
      if (!mesh.corner_uv.empty()) out.corner_uv.push_back(mesh.corner_uv[i]);
      if (!mesh.corner_color.empty()) out.corner_color.push_back(mesh.corner_color[i]);
      if (!mesh.corner_normal.empty()) out.corner_normal.push_back(mesh.corner_normal[i]);
    }
    out.face_begin.push_back(static_cast<uint32_t>(out.corner_count()));
    out.face_material.push_back(mesh.face_material[face]);
    out.face_number.push_back(mesh.face_number.empty() ? face : mesh.face_number[face]);
    if (!mesh.face_height_scale.empty()) out.face_height_scale.push_back(mesh.face_height_scale[face]);
  }
  out.cage = tags_of(mesh.cage, point, face_as);
  return out;
}

void append_part(const SourceMesh& part, SourceMesh& out) {
  const auto first_point = static_cast<uint32_t>(out.positions.size());
  const size_t before = out.corner_count(), after = before + part.corner_count();
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  append_corners(part.corner_uv, before, after, vec2(kNone), out.corner_uv);
  append_corners(part.corner_color, before, after, vec4(1.0f), out.corner_color);
  append_corners(part.corner_normal, before, after, vec3(0.0f), out.corner_normal);
  out.positions.insert(out.positions.end(), part.positions.begin(), part.positions.end());
  for (const uint32_t p : part.corner_position) out.corner_position.push_back(first_point + p);
  for (size_t face = 0; face < part.face_count(); ++face) {
    out.face_begin.push_back(static_cast<uint32_t>(before) + part.face_begin[face + 1]);
    out.face_material.push_back(part.face_material[face]);
    out.face_number.push_back(part.face_number[face]);
  }
  out.warnings.insert(out.warnings.end(), part.warnings.begin(), part.warnings.end());
}

}  // namespace farfield
