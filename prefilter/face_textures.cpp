// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_textures.h"

#include <algorithm>
#include <cmath>

#include "import/texels.h"

namespace farfield {
namespace {

// A triangle that covers more texels than this is averaged from a half-size level: its border texels, the only ones
// that lose exactness, are then a small part of it.
constexpr double kMaxTexels = 2048;
constexpr int kLineSamples = 32;  // along a triangle without area

vec4 fetch(const SourceTexture& texture, const Texture::Level& level, int x, int y) {
  return texture.image->texel(level, wrapped_texel(x, level.width, texture.wrap_u),
                              wrapped_texel(y, level.height, texture.wrap_v));
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

/// The texture whose texels are walked: the first. The others are looked up at their centres.
const SourceTexture& driver(const SourceMaterial& m) {
  const auto maps = m.maps();
  const auto found = std::ranges::find_if(maps, [](const SourceTexture* map) { return bool(*map); });
  return found == maps.end() ? *maps.back() : **found;
}

/// The normal that a normal map's texel means. Of texels that are averages themselves a mean, shorter than 1.
vec3 decode_normal(const vec4& texel, float scale, bool is_average) {
  const vec3 normal = mapped_normal(vec3(texel), scale);
  const float length = glm::length(normal);
  if (!(length > 1e-6f)) return {0, 0, 1};
  return is_average && length < 1 ? normal : normal / length;
}

/// Sums of what MapMeans holds, over texels of one level of the driving texture.
class Accumulator {
 public:
  Accumulator(const SourceMaterial& material, float vertex_alpha, int width)
      : material_(material), own_alpha_(material.alpha * vertex_alpha), width_(width) {}

  /// One sample with its premultiplied base colour (of the driver's texel, where that is the base colour map).
  void add(const vec4& base, vec2 uv, float area) {
    float alpha = base.w;
    if (material_.alpha_map) alpha *= look_up(material_.alpha_map, uv).w;
    const float shown = area * (base.w > 0 ? alpha / base.w : 0.0f);  // base is multiplied with its own alpha already
    const float weight = shown * base.w;
    float metallic = material_.metallic, roughness = material_.roughness;
    if (material_.metallic_roughness_map) {
      const vec4 mr = look_up(material_.metallic_roughness_map, uv);
      roughness *= mr.y;
      metallic *= mr.z;
    }
    sum_.dielectric += shown * (1 - metallic) * vec3(base);
    sum_.metal += shown * metallic * vec3(base);
    sum_.metallic += weight * metallic;
    sum_.roughness2 += weight * roughness * roughness * roughness * roughness;
    sum_.emission += weight * (material_.emission_map ? vec3(look_up(material_.emission_map, uv)) : vec3(1.0f));
    sum_.normal += weight * normal_at(uv);
    sum_.opacity += area * opacity(alpha * own_alpha_);
    shown_ += weight;
    area_ += area;
  }

  /// False when nothing with alpha was added.
  bool finish(MapMeans& means) const {
    if (!(shown_ > 1e-12f)) return false;
    means = {sum_.dielectric / shown_, sum_.metal / shown_,    sum_.metallic / shown_, sum_.roughness2 / shown_,
             sum_.opacity / area_,     sum_.emission / shown_, sum_.normal / shown_};
    return true;
  }

 private:
  const Texture::Level& level_of(const SourceTexture& map) const { return matching_level(*map.image, width_); }
  vec4 look_up(const SourceTexture& map, vec2 uv) const { return sample_bilinear(map, level_of(map), uv); }

  vec3 normal_at(vec2 uv) const {
    if (!material_.normal_map) return {0, 0, 1};
    const bool is_average = level_of(material_.normal_map).width < material_.normal_map.image->width();
    return decode_normal(look_up(material_.normal_map, uv), material_.normal_scale, is_average);
  }

  /// Of a texel that is an average, alpha is the share that a mask leaves.
  float opacity(float alpha) const {
    if (material_.alpha_mode == AlphaMode::Opaque) return 1;
    const SourceTexture& map = material_.base_color_map ? material_.base_color_map : material_.alpha_map;
    const bool is_average = map && level_of(map).width < map.image->width();
    if (material_.alpha_mode == AlphaMode::Blend || is_average) return std::clamp(alpha, 0.0f, 1.0f);
    return alpha >= material_.alpha_cutoff ? 1.0f : 0.0f;
  }

  const SourceMaterial& material_;
  float own_alpha_;
  int width_;
  MapMeans sum_{vec3(0.0f), vec3(0.0f), 0, 0, 0, vec3(0.0f), vec3(0.0f)};
  float shown_ = 0, area_ = 0;
};

/// Samples a material at texels of its driving texture.
class TexelWalk {
 public:
  TexelWalk(const SourceMaterial& material, float vertex_alpha, const Texture::Level& level)
      : texture_(driver(material)),
        level_(level),
        drives_color_(bool(material.base_color_map)),
        sums_(material, vertex_alpha, level.width) {}

  void add_texel(int x, int y, float area) {
    const vec2 uv((static_cast<float>(x) + 0.5f) / static_cast<float>(level_.width),
                  (static_cast<float>(y) + 0.5f) / static_cast<float>(level_.height));
    sums_.add(drives_color_ ? fetch(texture_, level_, x, y) : vec4(1.0f), uv, area);
  }
  void add_point(vec2 uv) { sums_.add(drives_color_ ? sample_bilinear(texture_, level_, uv) : vec4(1.0f), uv, 1); }
  bool finish(MapMeans& means) const { return sums_.finish(means); }

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

/// Where nothing has alpha: what the factors alone say, and that it is not there.
MapMeans invisible(const SourceMaterial& material) {
  MapMeans means = means_without_maps(material);
  if (material.alpha_mode != AlphaMode::Opaque) means.opacity = 0;
  return means;
}

MapMeans average_whole(const SourceMaterial& material, float vertex_alpha) {
  const Texture& image = *driver(material).image;
  // Down to about 32 x 32 texels, so that products of textures are still taken texel by texel.
  const Texture::Level& level = matching_level(image, 32);
  TexelWalk walk(material, vertex_alpha, level);
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) walk.add_texel(x, y, 1);
  }
  MapMeans means;
  return walk.finish(means) ? means : invisible(material);
}

}  // namespace

bool has_textures(const SourceMaterial& m) { return bool(driver(m)); }

bool is_usable(const UvTriangle& uv) { return std::ranges::all_of(uv, is_usable_uv); }

MapMeans average_textures(const SourceMaterial& material, const UvTriangle& uv, float vertex_alpha) {
  if (!has_textures(material)) return means_without_maps(material, vertex_alpha);
  if (!is_usable(uv)) return average_whole(material, vertex_alpha);

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
  if (is_too_many(image.level(index))) return average_whole(material, vertex_alpha);

  const Texture::Level& level = image.level(index);
  const auto p = to_texels(level);
  TexelWalk walk(material, vertex_alpha, level);
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
  MapMeans means;
  return walk.finish(means) ? means : invisible(material);
}

MapMeans textures_at(const SourceMaterial& material, vec2 uv, float width, float vertex_alpha) {
  if (!has_textures(material)) return means_without_maps(material, vertex_alpha);
  if (!is_usable({uv, uv, uv})) return average_whole(material, vertex_alpha);
  const float texels = 1 / std::max(width, 1e-6f);
  TexelWalk walk(material, vertex_alpha, matching_level(*driver(material).image, static_cast<int>(texels)));
  walk.add_point(uv);
  MapMeans means;
  return walk.finish(means) ? means : invisible(material);
}

float alpha_at(const SourceMaterial& material, vec2 uv) {
  float alpha = material.alpha;
  for (const SourceTexture* map : {&material.base_color_map, &material.alpha_map}) {
    if (*map) alpha *= sample_bilinear(*map, map->image->level(0), uv).w;
  }
  return alpha;
}

}  // namespace farfield
