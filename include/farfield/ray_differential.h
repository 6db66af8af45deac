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

/// The footprint at a distance of t along a unit direction, across it.
inline FootprintAxes footprint_axes(const RayDifferential& ray, const glm::vec3& direction, float t) {
  const auto across = [&](const glm::vec3& v) { return glm::dvec3(v - glm::dot(v, direction) * direction); };
  const glm::dvec3 u = across(ray.origin_dx + t * ray.direction_dx), v = across(ray.origin_dy + t * ray.direction_dy);
  // Singular values of the matrix with columns u and v.
  const double uu = glm::dot(u, u), uv = glm::dot(u, v), vv = glm::dot(v, v);
  const double middle = (uu + vv) / 2, spread = std::hypot((uu - vv) / 2, uv);
  const double longer = std::sqrt(middle + spread);
  const double area = glm::length(glm::cross(u, v));  // the product of both: exact where their squares cancel
  FootprintAxes axes;
  axes.longer = static_cast<float>(longer);
  axes.shorter = longer > 0 ? static_cast<float>(std::min(area / longer, longer)) : axes.longer;
  return axes;
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
