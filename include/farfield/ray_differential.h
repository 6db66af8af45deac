// SPDX-License-Identifier: Apache-2.0
// Ray differentials [Igehy 1999]: how a ray's origin and direction change by one pixel to the right and one up, through
// any number of reflections, refractions and scattering events. They tell the two axes of a footprint apart, which a
// cone does not: a floor seen at a grazing angle is wide along the view and narrow across.
//
// All functions are pure; directions are unit vectors in world space unless said otherwise. What is not finite stays
// so, and asks for the finest level.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace farfield {

/// How a ray changes by a pixel in x and in y.
struct RayDifferential {
  glm::vec3 origin_dx{0.0f}, origin_dy{0.0f};        ///< world units
  glm::vec3 direction_dx{0.0f}, direction_dy{0.0f};  ///< of the unit direction: radians
};

/// The axes of the ellipse that a pixel covers where a ray is, across it; world units, diameters.
struct FootprintAxes {
  float shorter = 0;
  float longer = 0;
};

/// Which axis asks for a level. The longer one is smooth and never aliases; the shorter one keeps detail that is narrow
/// in one direction and costs samples to average along the other.
enum class FootprintAxis : unsigned char { Shorter, Longer };

// --- Cameras ---------------------------------------------------------------------------------------------------------

/// A pinhole. unnormalized: the ray's direction before it was made unit; right, up: what one pixel adds to it.
inline RayDifferential perspective_differential(const glm::vec3& unnormalized, const glm::vec3& right,
                                                const glm::vec3& up) {
  const float length = glm::length(unnormalized);
  const glm::vec3 d = unnormalized / length;
  const auto of_unit = [&](const glm::vec3& step) { return (step - glm::dot(step, d) * d) / length; };
  RayDifferential result;
  result.direction_dx = of_unit(right);
  result.direction_dy = of_unit(up);
  return result;
}

/// Parallel rays. right, up: from one pixel to the next, world units.
inline RayDifferential orthographic_differential(const glm::vec3& right, const glm::vec3& up) {
  RayDifferential result;
  result.origin_dx = right;
  result.origin_dy = up;
  return result;
}

/// A thin lens, the point on it held fixed: one pixel moves the point of focus. to_focus: from the point on the lens to
/// the point in focus, world units; right, up: what one pixel moves that by.
inline RayDifferential thin_lens_differential(const glm::vec3& to_focus, const glm::vec3& right, const glm::vec3& up) {
  return perspective_differential(to_focus, right, up);
}

// --- Along a ray -----------------------------------------------------------------------------------------------------

/// How a footprint grows along a ray with a unit direction: what the axes at any distance follow from.
class FootprintGrowth {
 public:
  FootprintGrowth() = default;
  FootprintGrowth(const RayDifferential& ray, const glm::vec3& direction) {
    const glm::dvec3 d = glm::normalize(glm::dvec3(direction));  // to more than float: a circle stays one
    const auto across = [&](const glm::vec3& v) { return glm::dvec3(v) - glm::dot(glm::dvec3(v), d) * d; };
    const glm::dvec3 u0 = across(ray.origin_dx), v0 = across(ray.origin_dy);
    const glm::dvec3 u1 = across(ray.direction_dx), v1 = across(ray.direction_dy);
    squares_[0] = glm::dot(u0, u0) + glm::dot(v0, v0);
    squares_[1] = 2 * (glm::dot(u0, u1) + glm::dot(v0, v1));
    squares_[2] = glm::dot(u1, u1) + glm::dot(v1, v1);
    area_[0] = glm::dot(glm::cross(u0, v0), d);
    area_[1] = glm::dot(glm::cross(u0, v1) + glm::cross(u1, v0), d);
    area_[2] = glm::dot(glm::cross(u1, v1), d);
  }

  /// Across the ray at a distance of t: singular values of the matrix that takes pixels there, from the sum of their
  /// squares and from their product.
  FootprintAxes at(float t) const {
    const auto value = [t](const double* c) { return c[0] + t * (c[1] + t * c[2]); };
    const double sum = value(squares_), product = std::abs(value(area_));
    const double longer = std::sqrt((sum + std::sqrt(std::max(sum * sum - 4 * product * product, 0.0))) / 2);
    FootprintAxes axes;
    axes.longer = static_cast<float>(longer);
    axes.shorter = longer > 0 ? static_cast<float>(std::min(product / longer, longer)) : axes.longer;
    return axes;
  }

 private:
  double squares_[3] = {};  ///< coefficients of 1, t, t^2
  double area_[3] = {};
};

/// The footprint at a distance of t along a unit direction, across it.
inline FootprintAxes footprint_axes(const RayDifferential& ray, const glm::vec3& direction, float t) {
  return FootprintGrowth(ray, direction).at(t);
}
inline float width_of(const FootprintAxes& axes, FootprintAxis axis) {
  return axis == FootprintAxis::Shorter ? axes.shorter : axes.longer;
}

/// At a hit: the origin of what goes on from there, on the plane with this normal, t away. A ray in the plane keeps
/// what it has across itself.
inline RayDifferential transferred(const RayDifferential& ray, const glm::vec3& direction, float t,
                                   const glm::vec3& normal) {
  RayDifferential result = ray;
  const float cosine = glm::dot(direction, normal);
  const auto onto_plane = [&](const glm::vec3& p) {
    return cosine != 0.0f ? p - glm::dot(p, normal) / cosine * direction : p;
  };
  result.origin_dx = onto_plane(ray.origin_dx + t * ray.direction_dx);
  result.origin_dy = onto_plane(ray.origin_dy + t * ray.direction_dy);
  return result;
}
/// The same in a volume, where there is no plane.
inline RayDifferential transferred(const RayDifferential& ray, float t) {
  RayDifferential result = ray;
  result.origin_dx += t * ray.direction_dx;
  result.origin_dy += t * ray.direction_dy;
  return result;
}

// --- At a hit, after transfer ----------------------------------------------------------------------------------------

/// Mirrored at a surface. direction: of the ray that came; curvature: of the surface, 1 / world units, positive where
/// it bends away from the normal like a ball's outside; the normal turns by curvature times the way along the surface.
inline RayDifferential reflected(const RayDifferential& ray, const glm::vec3& direction, const glm::vec3& normal,
                                 float curvature = 0) {
  RayDifferential result = ray;
  const float cosine = glm::dot(direction, normal);
  const auto mirror = [&](const glm::vec3& origin_d, const glm::vec3& direction_d) {
    const glm::vec3 normal_d = curvature * origin_d;
    const float cosine_d = glm::dot(direction_d, normal) + glm::dot(direction, normal_d);
    return direction_d - 2.0f * (cosine * normal_d + cosine_d * normal);
  };
  result.direction_dx = mirror(ray.origin_dx, ray.direction_dx);
  result.direction_dy = mirror(ray.origin_dy, ray.direction_dy);
  return result;
}

/// Refracted into `refracted_direction`. eta: the index of refraction on the side the ray came from over that of the
/// other; normal on the side the ray came from (direction . normal < 0); curvature as for reflected().
inline RayDifferential refracted(const RayDifferential& ray, const glm::vec3& direction,
                                 const glm::vec3& refracted_direction, const glm::vec3& normal, float eta,
                                 float curvature = 0) {
  RayDifferential result = ray;
  const float cosine = glm::dot(direction, normal), cosine_out = glm::dot(refracted_direction, normal);
  const float mu = eta * cosine - cosine_out;
  const float mu_per_cosine = eta - eta * eta * cosine / cosine_out;
  const auto bend = [&](const glm::vec3& origin_d, const glm::vec3& direction_d) {
    const glm::vec3 normal_d = curvature * origin_d;
    const float cosine_d = glm::dot(direction_d, normal) + glm::dot(direction, normal_d);
    return eta * direction_d - mu * normal_d - mu_per_cosine * cosine_d * normal;
  };
  result.direction_dx = bend(ray.origin_dx, ray.direction_dx);
  result.direction_dy = bend(ray.origin_dy, ray.direction_dy);
  return result;
}

/// Scattered into `direction`, a sample of a lobe that one ray stands for `spread` radians of (Interaction::
/// next_cone_spread() less the spread that came): both axes widen by it, around the direction.
inline RayDifferential widened(const RayDifferential& ray, const glm::vec3& direction, float spread) {
  RayDifferential result = ray;
  const glm::vec3 aside = std::abs(direction.x) < 0.5f ? glm::vec3(1.0f, 0.0f, 0.0f) : glm::vec3(0.0f, 1.0f, 0.0f);
  const glm::vec3 x = glm::normalize(glm::cross(direction, aside)), y = glm::cross(direction, x);
  const auto widen = [&](const glm::vec3& d, const glm::vec3& otherwise) {
    const glm::vec3 across = d - glm::dot(d, direction) * direction;
    const float length = glm::length(across);
    return length > 0.0f ? across * (1.0f + spread / length) : spread * otherwise;
  };
  result.direction_dx = widen(ray.direction_dx, x);
  result.direction_dy = widen(ray.direction_dy, y);
  return result;
}

}  // namespace farfield
