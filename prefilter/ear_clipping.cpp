// SPDX-License-Identifier: Apache-2.0
#include "prefilter/ear_clipping.h"

#include <algorithm>

namespace farfield {
namespace {

using glm::dvec2;

/// Twice the signed area of a triangle.
double cross(const dvec2& a, const dvec2& b, const dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Whether p lies in the counter-clockwise triangle or on its border.
bool contains(const dvec2& a, const dvec2& b, const dvec2& c, const dvec2& p) {
  return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

/// The ring that is left, as a list of positions in the ring linked both ways.
class EarClipper {
 public:
  EarClipper(std::span<const dvec2> points, std::span<const uint32_t> ring) : points_(points), ring_(ring) {
    const auto n = static_cast<uint32_t>(ring.size());
    previous_.resize(n);
    next_.resize(n);
    is_reflex_.resize(n);
    for (uint32_t i = 0; i < n; ++i) {
      previous_[i] = (i + n - 1) % n;
      next_[i] = (i + 1) % n;
    }
    for (uint32_t i = 0; i < n; ++i) {
      if (area_at(i) <= 0) {
        is_reflex_[i] = true;
        reflex_.push_back(i);
      }
    }
  }

  std::vector<uvec3> run() {
    std::vector<uvec3> triangles;
    auto left = static_cast<uint32_t>(ring_.size());
    if (left < 3) return triangles;
    triangles.reserve(left - 2);
    uint32_t at = 0, tried = 0;
    while (left > 3) {
      // After a whole round without an ear the ring crosses itself or has no area left: any convex corner, then any
      // corner at all, keeps the work finite.
      const bool is_ear_here = tried < left ? is_ear(at) : tried < 2 * left ? area_at(at) > 0 : true;
      if (!is_ear_here) {
        at = next_[at];
        ++tried;
        continue;
      }
      triangles.emplace_back(ring_[previous_[at]], ring_[at], ring_[next_[at]]);
      at = remove(at);
      --left;
      tried = 0;
    }
    triangles.emplace_back(ring_[previous_[at]], ring_[at], ring_[next_[at]]);
    return triangles;
  }

 private:
  const dvec2& point(uint32_t i) const { return points_[ring_[i]]; }
  double area_at(uint32_t i) const { return cross(point(previous_[i]), point(i), point(next_[i])); }

  bool is_ear(uint32_t i) const {
    if (area_at(i) <= 0) return false;
    const dvec2 &a = point(previous_[i]), &b = point(i), &c = point(next_[i]);
    for (const uint32_t r : reflex_) {
      if (!is_reflex_[r]) continue;
      const dvec2& p = point(r);
      // Corners themselves, and the other side of a bridge, do not block.
      if (p == a || p == b || p == c) continue;
      if (contains(a, b, c, p)) return false;
    }
    return true;
  }

  /// Takes vertex i out. Returns where to go on: two further, so that the ears spread instead of forming a fan.
  uint32_t remove(uint32_t i) {
    const uint32_t before = previous_[i], after = next_[i];
    next_[before] = after;
    previous_[after] = before;
    is_reflex_[i] = false;
    if (is_reflex_[before] && area_at(before) > 0) is_reflex_[before] = false;
    if (is_reflex_[after] && area_at(after) > 0) is_reflex_[after] = false;
    if (++removed_since_cleanup_ > 64) {
      std::erase_if(reflex_, [&](uint32_t r) { return !is_reflex_[r]; });
      removed_since_cleanup_ = 0;
    }
    return next_[after];
  }

  std::span<const dvec2> points_;
  std::span<const uint32_t> ring_;
  std::vector<uint32_t> previous_, next_;
  std::vector<bool> is_reflex_;
  std::vector<uint32_t> reflex_;  ///< may hold some that no longer are
  int removed_since_cleanup_ = 0;
};

/// The vertex of `outer` (as a position in it) that the hole's rightmost point sees: the nearer corner of the edge that
/// a ray to the right meets, unless reflex corners stand between; then the one of them that is least off the ray.
size_t find_bridge(std::span<const dvec2> points, const Ring& outer, const dvec2& m) {
  double nearest = std::numeric_limits<double>::infinity();
  size_t best = outer.size();
  for (size_t i = 0; i < outer.size(); ++i) {
    const size_t j = (i + 1) % outer.size();
    const dvec2 &a = points[outer[i]], &b = points[outer[j]];
    // Counter-clockwise: edges to the right of an inner point go up. Horizontal ones count by their corners.
    if (!(a.y <= m.y && m.y <= b.y) || a.y == b.y) continue;
    const double x = a.x + (m.y - a.y) / (b.y - a.y) * (b.x - a.x);
    if (x >= m.x && x < nearest) {
      nearest = x;
      best = a.x > b.x ? i : j;
      if (m.y == a.y) best = i;
      if (m.y == b.y) best = j;
    }
  }
  if (best == outer.size()) return best;

  const dvec2 hit(nearest, m.y), corner = points[outer[best]];
  double least = std::numeric_limits<double>::infinity();
  size_t bridge = best;
  for (size_t i = 0; i < outer.size(); ++i) {
    const dvec2& p = points[outer[i]];
    if (p == corner || p.x < m.x) continue;
    const bool is_between = corner.y > m.y ? contains(m, hit, corner, p) : contains(m, corner, hit, p);
    if (!is_between) continue;
    const double slope = std::abs(p.y - m.y) / std::max(p.x - m.x, 1e-300);
    if (slope < least) {
      least = slope;
      bridge = i;
    }
  }
  return bridge;
}

}  // namespace

double twice_area(std::span<const dvec2> points, std::span<const uint32_t> ring) {
  double sum = 0;
  for (size_t i = 0; i < ring.size(); ++i) {
    const dvec2 &a = points[ring[i]], &b = points[ring[(i + 1) % ring.size()]];
    sum += a.x * b.y - a.y * b.x;
  }
  return sum;
}

std::vector<uvec3> clip_ears(std::span<const dvec2> points, std::span<const uint32_t> ring) {
  return EarClipper(points, ring).run();
}

Ring join_holes(std::span<const dvec2> points, Ring outer, std::vector<Ring> holes) {
  const auto rightmost = [&](const Ring& hole) {
    return std::max_element(hole.begin(), hole.end(),
                            [&](uint32_t a, uint32_t b) { return points[a].x < points[b].x; }) -
           hole.begin();
  };
  // From right to left: a hole then sees the outer ring or holes that are already part of it.
  std::sort(holes.begin(), holes.end(), [&](const Ring& a, const Ring& b) {
    return points[a[static_cast<size_t>(rightmost(a))]].x > points[b[static_cast<size_t>(rightmost(b))]].x;
  });
  for (Ring& hole : holes) {
    std::rotate(hole.begin(), hole.begin() + rightmost(hole), hole.end());
    const size_t bridge = find_bridge(points, outer, points[hole[0]]);
    if (bridge == outer.size()) continue;  // not inside of outer
    Ring insert(hole);
    insert.push_back(hole[0]);
    insert.push_back(outer[bridge]);
    outer.insert(outer.begin() + static_cast<std::ptrdiff_t>(bridge) + 1, insert.begin(), insert.end());
  }
  return outer;
}

}  // namespace farfield
