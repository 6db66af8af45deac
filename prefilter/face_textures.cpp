// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_textures.h"

#include <algorithm>
#include <cmath>

namespace farfield {
namespace {

constexpr float kMaxUv = 1e6f;
// A triangle that covers more texels than this is averaged from a half-size level: its border texels, the only ones
// that lose exactness, are then a small part of it.
constexpr double kMaxTexels = 2048;
constexpr int kLineSamples = 32;  // along a triangle without area

int wrap(int i, int size, Wrap mode) {
  switch (mode) {
    case Wrap::Clamp:
      return std::clamp(i, 0, size - 1);
    case Wrap::Mirror: {
      const int period = 2 * size, k = ((i % period) + period) % period;
      return k < size ? k : period - 1 - k;
    }
    case Wrap::Repeat:
      break;
  }
  return ((i % size) + size) % size;
}

vec4 fetch(const SourceTexture& texture, const Texture::Level& level, int x, int y) {
  return texture.image->texel(level, wrap(x, level.width, texture.wrap_u), wrap(y, level.height, texture.wrap_v));
}

vec4 sample_bilinear(const SourceTexture& texture, const Texture::Level& level, vec2 uv) {
  const float x = uv.x * static_cast<float>(level.width) - 0.5f, y = uv.y * static_cast<float>(level.height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y);
  const int ix = static_cast<int>(x0), iy = static_cast<int>(y0);
  const vec4 top = glm::mix(fetch(texture, level, ix, iy), fetch(texture, level, ix + 1, iy), x - x0);
  const vec4 bottom = glm::mix(fetch(texture, level, ix, iy + 1), fetch(texture, level, ix + 1, iy + 1), x - x0);
  return glm::mix(top, bottom, y - y0);
}

/// The level whose texels are about as large as those of a `width` texels wide image.
const Texture::Level& matching_level(const Texture& image, int width) {
  int level = 0;
  while (level + 1 < image.level_count() && image.level(level).width > width) ++level;
  return image.level(level);
}

/// The texture whose texels are walked; the others are looked up at their centres.
const SourceTexture& driver(const SourceMaterial& m) {
  return m.base_color_map ? m.base_color_map : m.metallic_roughness_map ? m.metallic_roughness_map : m.alpha_map;
}

/// Sums of what TextureAverage holds, over texels of one level of the driving texture.
class Accumulator {
 public:
  Accumulator(const SourceMaterial& material, int width) : material_(material), width_(width) {}

  /// One sample with its premultiplied base colour (of the driver's texel, where that is the base colour map).
  void add(const vec4& base, vec2 uv, float area) {
    float alpha = base.w;
    if (material_.alpha_map) {
      alpha *= sample_bilinear(material_.alpha_map, matching_level(*material_.alpha_map.image, width_), uv).w;
    }
    const float weight = area * (base.w > 0 ? alpha / base.w : 0.0f);  // base is multiplied with its own alpha already
    float metallic = material_.metallic, roughness = material_.roughness;
    if (material_.metallic_roughness_map) {
      const vec4 mr = sample_bilinear(material_.metallic_roughness_map,
                                      matching_level(*material_.metallic_roughness_map.image, width_), uv);
      roughness *= mr.y;
      metallic *= mr.z;
    }
    const float roughness2 = roughness * roughness * roughness * roughness;
    sum_.dielectric += weight * (1 - metallic) * vec3(base);
    sum_.metal += weight * metallic * vec3(base);
    sum_.metallic += weight * base.w * metallic;
    sum_.roughness2 += weight * base.w * roughness2;
    total_ += weight * base.w;
  }

  /// False when nothing with alpha was added.
  bool finish(TextureAverage& average) const {
    if (!(total_ > 1e-12f)) return false;
    average = {sum_.dielectric / total_, sum_.metal / total_, sum_.metallic / total_, sum_.roughness2 / total_};
    return true;
  }

 private:
  const SourceMaterial& material_;
  int width_;
  TextureAverage sum_{vec3(0.0f), vec3(0.0f), 0, 0};
  float total_ = 0;
};

/// Samples a material at texels of its driving texture.
class TexelWalk {
 public:
  TexelWalk(const SourceMaterial& material, const Texture::Level& level)
      : texture_(driver(material)),
        level_(level),
        drives_color_(bool(material.base_color_map)),
        sums_(material, level.width) {}

  void add_texel(int x, int y, float area) {
    const vec2 uv((static_cast<float>(x) + 0.5f) / static_cast<float>(level_.width),
                  (static_cast<float>(y) + 0.5f) / static_cast<float>(level_.height));
    sums_.add(drives_color_ ? fetch(texture_, level_, x, y) : vec4(1.0f), uv, area);
  }
  void add_point(vec2 uv) { sums_.add(drives_color_ ? sample_bilinear(texture_, level_, uv) : vec4(1.0f), uv, 1); }
  bool finish(TextureAverage& average) const { return sums_.finish(average); }

 private:
  const SourceTexture& texture_;
  const Texture::Level& level_;
  bool drives_color_;
  Accumulator sums_;
};

/// A convex polygon of at most 7 corners: a triangle cut by the four sides of a texel.
struct SmallPolygon {
  std::array<glm::dvec2, 8> corners;
  int count = 0;

  void add(const glm::dvec2& p) { corners[static_cast<size_t>(count++)] = p; }
  double area() const {
    double sum = 0;
    for (int i = 0; i < count; ++i) {
      const glm::dvec2 &a = corners[static_cast<size_t>(i)], &b = corners[static_cast<size_t>((i + 1) % count)];
      sum += a.x * b.y - a.y * b.x;
    }
    return 0.5 * std::abs(sum);
  }
};

/// The part of a polygon where sign * coordinate[axis] >= sign * limit [Sutherland and Hodgman 1974].
SmallPolygon clip(const SmallPolygon& in, int axis, double limit, double sign) {
  SmallPolygon out;
  for (int i = 0; i < in.count; ++i) {
    const glm::dvec2 &a = in.corners[static_cast<size_t>(i)], &b = in.corners[static_cast<size_t>((i + 1) % in.count)];
    const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
    if (da >= 0) out.add(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) out.add(a + (b - a) * (da / (da - db)));
  }
  return out;
}

/// Calls visit(x, y, area) for all texels that a triangle in texel space touches, with the area it covers of each.
template <typename Visit>
void rasterize(const std::array<glm::dvec2, 3>& p, const Visit& visit) {
  SmallPolygon triangle;
  for (const auto& corner : p) triangle.add(corner);
  const auto row_range = std::minmax({p[0].y, p[1].y, p[2].y});
  for (int y = static_cast<int>(std::floor(row_range.first)); y < row_range.second; ++y) {
    const SmallPolygon row = clip(clip(triangle, 1, y, 1), 1, y + 1, -1);
    if (row.count < 3) continue;
    double begin = row.corners[0].x, end = begin;
    for (int i = 1; i < row.count; ++i) {
      begin = std::min(begin, row.corners[static_cast<size_t>(i)].x);
      end = std::max(end, row.corners[static_cast<size_t>(i)].x);
    }
    for (int x = static_cast<int>(std::floor(begin)); x < end; ++x) {
      const double area = clip(clip(row, 0, x, 1), 0, x + 1, -1).area();
      if (area > 0) visit(x, y, area);
    }
  }
}

TextureAverage average_whole(const SourceMaterial& material) {
  const Texture& image = *driver(material).image;
  // Down to about 32 x 32 texels, so that products of textures are still taken texel by texel.
  int index = 0;
  while (index + 1 < image.level_count() && image.level(index).width > 32) ++index;
  const Texture::Level& level = image.level(index);
  TexelWalk walk(material, level);
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) walk.add_texel(x, y, 1);
  }
  TextureAverage average;
  const float roughness2 = std::pow(material.roughness, 4.0f);
  if (!walk.finish(average)) {
    average = {vec3(1 - material.metallic), vec3(material.metallic), material.metallic, roughness2};
  }
  return average;
}

}  // namespace

bool has_textures(const SourceMaterial& m) { return m.base_color_map || m.metallic_roughness_map || m.alpha_map; }

bool is_usable(const UvTriangle& uv) {
  return std::all_of(uv.begin(), uv.end(),
                     [](const vec2& c) { return std::abs(c.x) <= kMaxUv && std::abs(c.y) <= kMaxUv; });
}

TextureAverage average_textures(const SourceMaterial& material, const UvTriangle& uv) {
  if (!has_textures(material)) {
    const float m = material.metallic;
    return {vec3(1 - m), vec3(m), m, std::pow(material.roughness, 4.0f)};
  }
  if (!is_usable(uv)) return average_whole(material);

  const Texture& image = *driver(material).image;
  const auto to_texels = [&](const Texture::Level& level) {
    std::array<glm::dvec2, 3> p;
    for (size_t k = 0; k < 3; ++k) p[k] = glm::dvec2(uv[k]) * glm::dvec2(level.width, level.height);
    return p;
  };
  // Half the level until the texels that the triangle's box touches are few enough.
  int index = 0;
  const auto is_too_many = [&](const Texture::Level& level) {
    const auto p = to_texels(level);
    const auto xs = std::minmax({p[0].x, p[1].x, p[2].x}), ys = std::minmax({p[0].y, p[1].y, p[2].y});
    return (xs.second - xs.first + 2) * (ys.second - ys.first + 2) > 2 * kMaxTexels;
  };
  while (index + 1 < image.level_count() && is_too_many(image.level(index))) ++index;
  // Still too many of single texels: the texture repeats thousands of times within the triangle.
  if (is_too_many(image.level(index))) return average_whole(material);

  const Texture::Level& level = image.level(index);
  const auto p = to_texels(level);
  TexelWalk walk(material, level);
  const double area = 0.5 * std::abs((p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x));
  if (area > 1e-9) {
    rasterize(p, [&](int x, int y, double part) { walk.add_texel(x, y, static_cast<float>(part / area)); });
  } else {
    // All corners on a line or a point: along the two longer sides of what is left of the triangle.
    for (int i = 0; i < kLineSamples; ++i) {
      const float t = (static_cast<float>(i) + 0.5f) / kLineSamples;
      for (size_t k = 0; k < 3; ++k) walk.add_point(glm::mix(uv[k], uv[(k + 1) % 3], t));
    }
  }
  TextureAverage average;
  return walk.finish(average) ? average : average_whole(material);
}

FaceMaterial face_material(const SourceMaterial& material, const TextureAverage& average, const vec3& color,
                           const vec3& normal) {
  const vec3 base = glm::clamp(material.base_color * color, vec3(0.0f), vec3(1.0f));
  FaceMaterial out;
  out.sggx = SymMat3::outer(normal);
  out.specular =
      glm::clamp(material.dielectric_f0 * (1 - average.metallic) + base * average.metal, vec3(0.0f), vec3(1.0f));
  const vec3 room = 1.0f - out.specular;
  const float through = material.diffuse_transmission;
  out.diffuse = glm::min(base * average.dielectric * (1 - through) * room, room);
  out.transmission =
      glm::min(material.diffuse_transmission_color * (through * (1 - average.metallic)) * room, room - out.diffuse);
  out.roughness2 = std::clamp(average.roughness2, 0.0f, 1.0f);
  return out;
}

float alpha_at(const SourceMaterial& material, vec2 uv) {
  float alpha = material.alpha;
  for (const SourceTexture* map : {&material.base_color_map, &material.alpha_map}) {
    if (*map) alpha *= sample_bilinear(*map, map->image->level(0), uv).w;
  }
  return alpha;
}

}  // namespace farfield
