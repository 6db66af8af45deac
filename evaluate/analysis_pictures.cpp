// SPDX-License-Identifier: Apache-2.0
#include "evaluate/analysis_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "base/parallel.h"
#include "base/result.h"
#include "evaluate/label.h"
#include "evaluate/views.h"
#include "prefilter/ray_scene.h"

namespace farfield {
namespace {

constexpr vec3 kCircleColor{0.02f, 0.10f, 0.80f};
constexpr int kSamples = 3;  ///< per pixel, along either axis

using ColorOfFace = std::function<vec3(uint32_t face)>;

vec3 trace_color(const RayScene& scene, const OrthoView& view, float x, float y, const ColorOfFace& color_of,
                 float depth) {
  const float right = (x - 0.5f * static_cast<float>(view.width_px)) * view.pixel_size;
  const float up = (0.5f * static_cast<float>(view.height_px) - y) * view.pixel_size;
  const vec3 origin = view.center + right * view.right() + up * view.up - 0.5f * depth * view.direction;
  const auto hit = scene.first_hit(origin, view.direction, 0, depth);
  if (!hit) return vec3(kSheetBackground);
  const float cosine = std::abs(glm::dot(glm::normalize(hit->normal), view.direction));
  return (0.25f + 0.75f * cosine) * color_of(hit->triangle);
}

Result<Image> draw(const Surface& surface, const OrthoView& view, float depth, const ColorOfFace& color_of) {
  Image image(view.width_px, view.height_px, {"R", "G", "B"});
  FARFIELD_TRY_LET(const auto scene, RayScene::build(surface));
  parallel_for(static_cast<size_t>(view.height_px), 1, [&](size_t row, size_t) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < view.width_px; ++x) {
      vec3 sum(0.0f);
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const float across = (static_cast<float>(s % kSamples) + 0.5f) / kSamples;
        const float down = (static_cast<float>(s / kSamples) + 0.5f) / kSamples;
        sum += trace_color(scene, view, static_cast<float>(x) + across, static_cast<float>(y) + down, color_of, depth);
      }
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = sum[c] / (kSamples * kSamples);
    }
  });
  return image;
}

/// In the lower left corner, so that it hides little.
void draw_circle(Image& image, float radius_px) {
  const float middle_x = radius_px + 3, middle_y = static_cast<float>(image.height) - radius_px - 3;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float off = std::hypot(static_cast<float>(x) + 0.5f - middle_x, static_cast<float>(y) + 0.5f - middle_y);
      if (std::abs(off - radius_px) > 0.7f) continue;
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = kCircleColor[c];
    }
}

/// Faces of both, without what they look like.
Surface join_faces(const Surface& first, const Surface& second) {
  Surface both;
  both.positions = first.positions;
  both.positions.insert(both.positions.end(), second.positions.begin(), second.positions.end());
  both.triangles = first.triangles;
  const auto offset = static_cast<uint32_t>(first.positions.size());
  for (const uvec3& t : second.triangles) both.triangles.push_back(t + offset);
  return both;
}

ColorOfFace by_scale(const std::vector<float>& values) {
  return [&values](uint32_t face) { return scale_color(values[face]); };
}

}  // namespace

vec3 scale_color(float value) {
  constexpr std::array<vec3, 4> kColors = {vec3(0.05f, 0.01f, 0.20f), vec3(0.02f, 0.20f, 0.40f),
                                           vec3(0.10f, 0.50f, 0.15f), vec3(1.00f, 0.80f, 0.05f)};
  const float at = std::clamp(value, 0.0f, 1.0f) * (kColors.size() - 1);
  const size_t i = std::min(static_cast<size_t>(at), kColors.size() - 2);
  return glm::mix(kColors[i], kColors[i + 1], at - static_cast<float>(i));
}

Result<std::vector<Image>> draw_analysis(const LevelSurfaces& level, const FaceFigures& faces, const Box3& bounds,
                                         const vec3& direction, int longest_px) {
  const OrthoView coarse = frame_view(bounds, direction, 1e-3f * glm::length(bounds.size()));
  const float extent = coarse.pixel_size * static_cast<float>(std::max(coarse.width_px, coarse.height_px));
  OrthoView view = frame_view(bounds, direction, extent / static_cast<float>(longest_px - 4));
  view.width_px = std::min(view.width_px, longest_px), view.height_px = std::min(view.height_px, longest_px);
  const float depth = 2 * glm::length(bounds.size());  // faces of coarse levels may stand out a little

  const auto macro_faces = static_cast<uint32_t>(level.macrosurface.triangles.size());
  FARFIELD_TRY_LET(Image parts,
                   draw(join_faces(level.macrosurface, level.sub_resolution), view, depth,
                        [&](uint32_t f) { return f < macro_faces ? kMacrosurfaceColor : kSubResolutionColor; }));
  draw_circle(parts, static_cast<float>(level.resolution) / view.pixel_size);
  FARFIELD_TRY_LET(Image by_size, draw(level.simplified, view, depth, by_scale(faces.size)));
  FARFIELD_TRY_LET(Image by_roughness, draw(level.simplified, view, depth, by_scale(faces.roughness)));
  return std::vector<Image>{std::move(parts), std::move(by_size), std::move(by_roughness)};
}

}  // namespace farfield
