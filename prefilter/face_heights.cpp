// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_heights.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace farfield {
namespace {

using glm::dvec2;

/// Calls visit(direction, curve) for curves along u (direction 0) and v (1), from one end of the face to the other.
template <typename Visit>
void for_each_line(const FaceLimit& limit, const Visit& visit) {
  if (limit.is_triangle()) {
    visit(0, [](double t) { return dvec2(t, 0); });
    visit(0, [](double t) { return dvec2(0, t); });
    visit(0, [](double t) { return dvec2(t, 1 - t); });
    return;
  }
  for (const double across : {0.0, 0.5, 1.0}) {
    visit(0, [across](double t) { return dvec2(t, across); });
    visit(1, [across](double t) { return dvec2(across, t); });
  }
}

}  // namespace

FaceHeights::FaceHeights(const Cage& cage, const SourceMesh& mesh) {
  if (mesh.heights.empty() || cage.uv.corner_value.empty()) return;
  of_face_.assign(cage.face_size.size(), nullptr);
  size_t corner = 0;
  for (size_t face = 0; face < of_face_.size(); ++face) {
    bool has_uv = true;
    for (int i = 0; i < cage.face_size[face]; ++i) {
      const dvec2& uv = cage.uv.values[static_cast<size_t>(cage.uv.corner_value[corner++])];
      has_uv &= std::isfinite(uv.x) && std::isfinite(uv.y);
    }
    const SourceHeights& heights = mesh.heights[mesh.face_material[cage.face[face]]];
    if (heights && has_uv) of_face_[face] = &heights;
    if (!mesh.face_height_scale.empty()) scale_.push_back(mesh.face_height_scale[cage.face[face]]);
  }
}

HeightDetail detail_of(const SourceHeights& heights, const FaceLimit& limit, double detail) {
  constexpr int kParts = 8;
  const dvec2 size(heights.map->width(), heights.map->height());
  HeightDetail out;
  out.detail = detail;
  for_each_line(limit, [&](int direction, const auto& curve) {
    double length = 0, texels = 0;
    dvec3 p = limit.position(curve(0.0));
    dvec2 uv = limit.uv(curve(0.0));
    for (int i = 1; i <= kParts; ++i) {
      const dvec2 at = curve(static_cast<double>(i) / kParts);
      length += glm::length(limit.position(at) - std::exchange(p, limit.position(at)));
      texels += glm::length(size * (limit.uv(at) - std::exchange(uv, limit.uv(at))));
    }
    out.length[direction] = std::max(out.length[direction], length);
    out.texels[direction] = std::max(out.texels[direction], texels);
  });
  if (limit.is_triangle()) {
    out.length.y = out.length.x;
    out.texels.y = out.texels.x;
  }
  double footprint = 1;
  for (int i = 0; i < 2; ++i) {
    out.most[i] = std::max(1.0, std::ceil(std::min(out.length[i] / detail, out.texels[i])));
    if (out.length[i] > 0) footprint = std::max(footprint, out.texels[i] * detail / out.length[i]);
  }
  out.footprint = static_cast<float>(std::min(footprint, 1e9));
  return out;
}

double height_at(const SourceHeights& heights, const dvec2& uv, float footprint) {
  const vec2 at(uv);
  if (!std::isfinite(at.x) || !std::isfinite(at.y)) return 0;
  return double{heights.base} + double{heights.gain} * heights.map->at(at, footprint, heights.wrap_u, heights.wrap_v);
}

}  // namespace farfield
