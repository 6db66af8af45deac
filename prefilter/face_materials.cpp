// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_materials.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "prefilter/face_textures.h"
#include "scattering/material_model.h"
#include "scattering/tangent_frame.h"

namespace farfield {
namespace {

const vec3 kMiddle(1.0f / 3);

/// Texture coordinates at a point of a triangle.
vec2 uv_at(const UvTriangle& uv, const vec3& barycentric) {
  return barycentric.x * uv[0] + barycentric.y * uv[1] + barycentric.z * uv[2];
}

float area_of(const UvTriangle& uv) {
  const vec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
  return 0.5f * std::abs(a.x * b.y - a.y * b.x);
}

UvTriangle uv_of(const SourceSurface& source, const TrianglePart& part) {
  const UvTriangle whole = source.uv_of(part.triangle);
  return {uv_at(whole, part.corners[0]), uv_at(whole, part.corners[1]), uv_at(whole, part.corners[2])};
}

/// The share of the triangle's area that the part has.
float share_of(const TrianglePart& part) {
  const auto& [a, b, c] = part.corners;
  return std::abs((b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y));
}

/// A point of the source and how much around it counts.
struct Spot {
  uint32_t triangle;
  vec3 barycentric;
  float share;  ///< area of the spot, of the triangle's
};

MaterialQuery query_at(const SourceSurface& source, const Spot& spot) {
  const UvTriangle uv = source.uv_of(spot.triangle);
  const float side = std::sqrt(spot.share);
  MaterialQuery query;
  query.material = source.material[spot.triangle];
  query.face = source.source_face[spot.triangle];
  query.uv = uv_at(uv, spot.barycentric);
  query.duv_dx = 0.5f * side * (uv[1] - uv[0]);
  query.duv_dy = 0.5f * side * (uv[2] - uv[0]);
  query.color = source.color_at(spot.triangle, spot.barycentric);
  return query;
}

/// What the host's function says of spots: in one call, if it takes many.
std::vector<MaterialSample> ask_function(const SourceSurface& source, std::span<const Spot> spots) {
  std::vector<MaterialQuery> queries;
  queries.reserve(spots.size());
  for (const Spot& spot : spots) queries.push_back(query_at(source, spot));
  std::vector<MaterialSample> samples(spots.size());
  if (source.material_batch) {
    source.material_batch(queries.data(), samples.data(), queries.size());
  } else {
    std::ranges::transform(queries, samples.begin(), source.material_function);
  }
  for (MaterialSample& sample : samples) sample = in_range(sample);
  return samples;
}

MaterialSample look_at_maps(const SourceSurface& source, const Spot& spot) {
  const UvTriangle uv = source.uv_of(spot.triangle);
  const vec4 color = source.color_at(spot.triangle, spot.barycentric);
  const SourceMaterial& material = source.material_of(spot.triangle);
  const float width = is_usable(uv) ? std::sqrt(spot.share * area_of(uv)) : 1.0f;
  return material_sample(material, textures_at(material, uv_at(uv, spot.barycentric), width, color.w), vec3(color));
}

/// What the host's function, or the materials' maps, say of spots.
std::vector<MaterialSample> sample_spots(const SourceSurface& source, std::span<const Spot> spots) {
  if (source.material_function) return ask_function(source, spots);
  std::vector<MaterialSample> samples;
  for (const Spot& spot : spots) samples.push_back(look_at_maps(source, spot));
  return samples;
}

/// Adds kFunctionSamples points that are spread evenly over the part.
void add_spots(const TrianglePart& part, std::vector<Spot>& spots) {
  constexpr int kSide = 4;  // kSide^2 small triangles: their middles
  static_assert(kSide * kSide == kFunctionSamples);
  for (int row = 0; row < kSide; ++row) {
    for (int i = 0; i < 2 * (kSide - row) - 1; ++i) {
      const bool is_upright = i % 2 == 0;
      const float third = is_upright ? 1.0f / 3 : 2.0f / 3;
      const vec2 at = vec2(static_cast<float>(i / 2) + third, static_cast<float>(row) + third) / float(kSide);
      spots.push_back({part.triangle, part.at({1 - at.x - at.y, at.x, at.y}), share_of(part) / kFunctionSamples});
    }
  }
}

/// The mean of the function's answers at the spots of a part.
MaterialSample mean_of(std::span<const MaterialSample> samples) {
  MaterialSample sum{vec3(0.0f), vec3(0.0f), vec3(0.0f), 0, 0, vec3(0.0f), vec3(0.0f)};
  float roughness2 = 0;
  for (const MaterialSample& s : samples) {
    sum.diffuse += s.opacity * s.diffuse;
    sum.specular += s.opacity * s.specular;
    sum.transmission += s.opacity * s.transmission;
    roughness2 += s.opacity * std::pow(s.roughness, 4.0f);
    sum.normal += s.opacity * (s.normal / std::max(glm::length(s.normal), 1e-6f));
    sum.emission += s.opacity * s.emission;
    sum.opacity += s.opacity;
  }
  if (!(sum.opacity > 0)) return {.opacity = 0};
  const float share = 1 / sum.opacity;
  return {sum.diffuse * share,
          sum.specular * share,
          sum.transmission * share,
          std::sqrt(std::sqrt(roughness2 * share)),
          sum.opacity / static_cast<float>(samples.size()),
          sum.normal * share,
          sum.emission * share};
}

MaterialSample average_maps(const SourceSurface& source, const TrianglePart& part) {
  const SourceMaterial& material = source.material_of(part.triangle);
  const vec4 color = source.color_at(part.triangle, part.at(kMiddle));
  return material_sample(material, average_textures(material, uv_of(source, part), color.w), vec3(color));
}

/// Second moment of unit normals around `mean`, given how much shorter than 1 their mean is; trace 1.
SymMat3 spread_normals(const vec3& mean, float mean_length) {
  const float aside = std::clamp(0.5f * (1 - mean_length * mean_length), 0.0f, 1.0f / 3);
  return SymMat3::identity() * aside + SymMat3::outer(mean) * (1 - 3 * aside);
}

/// Second moment of the shading normals that light sees on the part; `mapped`: their mean in the tangent frame.
SymMat3 shading_normals(const SourceSurface& source, const TrianglePart& part, const vec3& mapped) {
  const uvec3& t = source.triangles[part.triangle];
  const TangentFrame frame({source.positions[t.x], source.positions[t.y], source.positions[t.z]},
                           source.uv_of(part.triangle));
  const float length = std::min(glm::length(mapped), 1.0f);
  const auto at = [&](const vec3& barycentric) {
    const vec3 smooth = source.normal_at(part.triangle, barycentric);
    return spread_normals(frame.bend(smooth, mapped), length);
  };
  // The exact second moment of normals that are linear over the part, but for their length.
  const float corner = 1.0f / 12;
  return at(part.at(kMiddle)) * (9 * corner) +
         (at(part.corners[0]) + at(part.corners[1]) + at(part.corners[2])) * corner;
}

/// What is_varied() compares, of one spot.
struct Look {
  std::array<float, 12> channels;
  vec3 normal;

  explicit Look(const MaterialSample& s)
      : channels{s.diffuse.x,
                 s.diffuse.y,
                 s.diffuse.z,
                 s.specular.x,
                 s.specular.y,
                 s.specular.z,
                 s.emission.x,
                 s.emission.y,
                 s.emission.z,
                 component_sum(s.transmission) / 3,
                 s.roughness * s.roughness,
                 s.opacity} {
    for (float& channel : channels) channel = std::sqrt(channel);
    normal = glm::normalize(s.normal + vec3(0, 0, 1e-6f));
  }
};

/// The longest side of a part, in scene units.
float longest_side(const SourceSurface& source, const TrianglePart& part) {
  const uvec3& t = source.triangles[part.triangle];
  std::array<vec3, 3> p;
  for (size_t k = 0; k < 3; ++k) {
    const vec3& b = part.corners[k];
    p[k] = b.x * source.positions[t.x] + b.y * source.positions[t.y] + b.z * source.positions[t.z];
  }
  return std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

bool has_varied_normals(const SourceSurface& source, const TrianglePart& part) {
  if (source.corner_normal.empty()) return false;
  const float cosine = std::cos(kVisibleAngle);
  std::array<vec3, 3> n;
  for (size_t k = 0; k < 3; ++k) n[k] = source.normal_at(part.triangle, part.corners[k]);
  return std::min({glm::dot(n[0], n[1]), glm::dot(n[1], n[2]), glm::dot(n[2], n[0])}) < cosine;
}

/// Whether nothing can vary but the normals of corners.
bool is_uniform(const SourceSurface& source, const TrianglePart& part) {
  if (source.material_function) return false;
  if (has_textures(source.material_of(part.triangle))) return false;
  if (source.corner_color.empty()) return true;
  const vec4* c = &source.corner_color[3 * part.triangle];
  return c[0] == c[1] && c[1] == c[2];
}

FaceMaterial to_face(const SourceSurface& source, const TrianglePart& part, const MaterialSample& sample) {
  FaceMaterial out;
  out.sggx = SymMat3::outer(vec3(glm::normalize(source.area_vector(part.triangle))));
  out.diffuse = sample.diffuse;
  out.specular = sample.specular;
  out.transmission = glm::min(sample.transmission, 1.0f - glm::min(sample.diffuse, vec3(1.0f)));
  out.roughness2 = std::pow(sample.roughness, 4.0f);
  out.opacity = sample.opacity;
  out.emission = sample.emission;
  if (source.has_shading_normals()) out.shading_sggx = shading_normals(source, part, sample.normal);
  return out;
}

}  // namespace

std::vector<FaceMaterial> average_materials(const SourceSurface& source, std::span<const TrianglePart> parts,
                                            const Job& job) {
  std::vector<FaceMaterial> out(parts.size());
  if (!source.material_function) {
    for (size_t i = 0; i < parts.size() && !job.is_cancelled(); ++i) {
      out[i] = to_face(source, parts[i], average_maps(source, parts[i]));
    }
    return out;
  }
  std::vector<Spot> spots;
  spots.reserve(kFunctionSamples * parts.size());
  for (const TrianglePart& part : parts) add_spots(part, spots);
  const std::vector<MaterialSample> samples = ask_function(source, spots);
  for (size_t i = 0; i < parts.size(); ++i) {
    const std::span of_part = std::span(samples).subspan(kFunctionSamples * i, kFunctionSamples);
    out[i] = to_face(source, parts[i], mean_of(of_part));
  }
  return out;
}

bool is_varied(const SourceSurface& source, const TrianglePart& part, float width) {
  if (has_varied_normals(source, part)) return true;
  if (is_uniform(source, part)) return false;
  const int steps = static_cast<int>(std::clamp(std::ceil(longest_side(source, part) / width), 1.0f, 24.0f));
  const float share = share_of(part) / static_cast<float>(steps * steps);
  Look lower{MaterialSample{}}, upper = lower;  // from the first spot on; both keep its normal
  for (int i = 0; i <= steps; ++i) {
    std::vector<Spot> row;
    for (int j = 0; i + j <= steps; ++j) {
      const vec2 at = vec2(i, j) / static_cast<float>(steps);
      row.push_back({part.triangle, part.at({1 - at.x - at.y, at.x, at.y}), share});
    }
    const std::vector<MaterialSample> samples = sample_spots(source, row);
    for (size_t j = 0; j < samples.size(); ++j) {
      const Look look(samples[j]);
      if (i == 0 && j == 0) lower = upper = look;
      for (size_t c = 0; c < look.channels.size(); ++c) {
        lower.channels[c] = std::min(lower.channels[c], look.channels[c]);
        upper.channels[c] = std::max(upper.channels[c], look.channels[c]);
        if (upper.channels[c] - lower.channels[c] > kVisibleStep) return true;
      }
      if (glm::dot(look.normal, lower.normal) < std::cos(kVisibleAngle)) return true;
    }
  }
  return false;
}

Surface average_faces(const SourceSurface& source, const Job& job) {
  Surface surface;
  surface.origin = source.origin;
  surface.positions = source.positions;
  surface.triangles = source.triangles;
  surface.materials.resize(source.triangles.size());
  parallel_for(source.triangles.size(), 1024, [&](size_t begin, size_t end) {
    if (job.is_cancelled()) return;
    std::vector<TrianglePart> whole;
    for (size_t i = begin; i < end; ++i) whole.push_back({static_cast<uint32_t>(i)});
    std::ranges::copy(average_materials(source, whole, job),
                      surface.materials.begin() + static_cast<std::ptrdiff_t>(begin));
  });
  return surface;
}

}  // namespace farfield
