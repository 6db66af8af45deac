// SPDX-License-Identifier: Apache-2.0
// Cutting one triangle:
//
//   C                  1. sort the corners, so that neighbours see their common edge in the same direction
//   |\                 2. sample alpha on a triangular lattice; marching triangles gives directed segments with the
//   |  \               inside on their left; they chain into closed loops, along the triangle's border where the
//   |####\             inside touches it (counter-clockwise loops are outlines, clockwise ones holes)
//   |#####>\           3. straighten the loops [Douglas and Peucker 1973]; crossings
//   A--##----B            on the border stay where they are, the others give their loop its area back
//                      4. fill them by a sweep line, flip edges to Delaunay
//
// All loops live in lattice coordinates (s, t): the point A + s (B - A) + t (C - A).
#include "prefilter/alpha_cut.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "base/index.h"
#include "prefilter/fill_rings.h"

namespace farfield {
namespace {

using glm::dvec2;

constexpr double kAreaTolerance = 0.004;  // of the covered area: four times tighter than promised of whole textures
constexpr double kFinestTexels = 0.1;     // last one before the outline is taken as it is

/// The triangle in sorted order, with alpha as a function of the lattice.
struct Sorted {
  std::array<size_t, 3> order;  ///< sorted corner k is the caller's corner order[k]
  MaskedTriangle corners;
};

Sorted sort_corners(const MaskedTriangle& triangle) {
  Sorted out{{0, 1, 2}, {}};
  const auto key = [&](size_t k) { return std::make_tuple(triangle.uv[k].x, triangle.uv[k].y, triangle.alpha[k]); };
  std::sort(out.order.begin(), out.order.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
  for (size_t k = 0; k < 3; ++k) {
    out.corners.uv[k] = triangle.uv[out.order[k]];
    out.corners.alpha[k] = triangle.alpha[out.order[k]];
  }
  return out;
}

/// Alpha less the cutoff on the lattice nodes (i, j), i + j <= n. Not negative means inside.
class Lattice {
 public:
  Lattice(const SourceMaterial& material, const MaskedTriangle& corners, int n) : n_(n) {
    values_.resize(static_cast<size_t>(n + 1) * static_cast<size_t>(n + 1));
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i + j <= n; ++i) {
        const vec3 point = point_on(corners, i, j);
        values_[node(i, j)] = alpha_at(material, vec2(point)) * point.z - material.alpha_cutoff;
      }
    }
  }

  int size() const { return n_; }
  size_t node(int i, int j) const {
    return static_cast<size_t>(j) * static_cast<size_t>(n_ + 1) + static_cast<size_t>(i);
  }
  float value(int i, int j) const { return values_[node(i, j)]; }
  bool is_inside(int i, int j) const { return value(i, j) >= 0; }

 private:
  /// (u, v, vertex alpha) of a node. Nodes on an edge come from its two corners alone, so that the neighbour across
  /// the edge gets the same bits.
  vec3 point_on(const MaskedTriangle& c, int i, int j) const {
    const auto corner = [&](size_t k) { return vec3(c.uv[k], c.alpha[k]); };
    const float s = static_cast<float>(i) / static_cast<float>(n_), t = static_cast<float>(j) / static_cast<float>(n_);
    if (j == 0) return corner(0) + s * (corner(1) - corner(0));
    if (i == 0) return corner(0) + t * (corner(2) - corner(0));
    if (i + j == n_) return corner(1) + t * (corner(2) - corner(1));
    return corner(0) + s * (corner(1) - corner(0)) + t * (corner(2) - corner(0));
  }

  int n_;
  std::vector<float> values_;
};

/// A point of a loop in lattice coordinates.
struct LoopPoint {
  dvec2 at;
  bool is_fixed;  ///< on the triangle's border: shared with the neighbour
};
using Loop = std::vector<LoopPoint>;

/// Marching triangles: crossings are named by their lattice edge, 3 per node: to the right, up, and across from (i + 1,
/// j) to (i, j + 1).
class Outline {
 public:
  explicit Outline(const Lattice& lattice) : lattice_(lattice), n_(lattice.size()) {
    next_.assign(3 * static_cast<size_t>(n_ + 1) * static_cast<size_t>(n_ + 1), kNoIndex);
    for (int j = 0; j < n_; ++j) {
      for (int i = 0; i + j < n_; ++i) {
        march({{{i, j}, {i + 1, j}, {i, j + 1}}});
        if (i + j + 1 < n_) march({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}});
      }
    }
    walk_border();
  }

  /// All loops, in the order of their first crossing. Without any crossing: the whole border, or nothing.
  std::vector<Loop> loops() {
    std::vector<Loop> out;
    for (uint32_t start = 0; start < next_.size(); ++start) {
      if (next_[start] == kNoIndex) continue;
      Loop loop;
      uint32_t at = start;
      while (next_[at] != kNoIndex) {
        loop.push_back({position(at), is_on_border(at)});
        const uint32_t following = next_[at];
        next_[at] = kNoIndex;
        at = following;
        if (const auto inner = border_.find(at); inner != border_.end()) {
          loop.push_back({position(at), true});
          for (const dvec2& corner : inner->second.corners) loop.push_back({corner, true});
          at = inner->second.exit;
        }
      }
      out.push_back(std::move(loop));
    }
    if (out.empty() && lattice_.is_inside(0, 0)) {
      out.push_back({{dvec2(0, 0), true}, {dvec2(1, 0), true}, {dvec2(0, 1), true}});
    }
    return out;
  }

 private:
  using Node = std::array<int, 2>;

  /// From where the outline comes in on the border, along the border to where it leaves it.
  struct BorderRun {
    std::vector<dvec2> corners;
    uint32_t exit;
  };

  bool is_inside(const Node& a) const { return lattice_.is_inside(a[0], a[1]); }

  uint32_t crossing(Node a, Node b) const {
    if (b[0] < a[0] && b[1] == a[1]) std::swap(a, b);  // right
    if (b[1] < a[1] && b[0] == a[0]) std::swap(a, b);  // up
    const int kind = b[1] == a[1] ? 0 : b[0] == a[0] ? 1 : 2;
    const Node base = kind == 2 ? Node{std::min(a[0], b[0]), std::min(a[1], b[1])} : a;
    return static_cast<uint32_t>(3 * lattice_.node(base[0], base[1])) + static_cast<uint32_t>(kind);
  }

  std::array<Node, 2> ends(uint32_t crossing) const {
    const int node = static_cast<int>(crossing / 3), i = node % (n_ + 1), j = node / (n_ + 1);
    switch (crossing % 3) {
      case 0:
        return {{{i, j}, {i + 1, j}}};
      case 1:
        return {{{i, j}, {i, j + 1}}};
      default:
        return {{{i + 1, j}, {i, j + 1}}};
    }
  }

  bool is_on_border(uint32_t crossing) const {
    const auto [a, b] = ends(crossing);
    return (a[0] == 0 && b[0] == 0) || (a[1] == 0 && b[1] == 0) || (a[0] + a[1] == n_ && b[0] + b[1] == n_);
  }

  dvec2 position(uint32_t crossing) const {
    const auto [a, b] = ends(crossing);
    const double va = lattice_.value(a[0], a[1]), vb = lattice_.value(b[0], b[1]);
    // Away from the nodes, so that no two crossings of different edges fall together.
    const double f = std::clamp(va / (va - vb), 1.0 / 64, 63.0 / 64);
    return (dvec2(a[0], a[1]) + f * dvec2(b[0] - a[0], b[1] - a[1])) / static_cast<double>(n_);
  }

  /// One small triangle, counter-clockwise.
  void march(const std::array<Node, 3>& t) {
    const int inside = is_inside(t[0]) + is_inside(t[1]) + is_inside(t[2]);
    if (inside == 0 || inside == 3) return;
    size_t k = 0;  // the corner that is alone on its side
    while (is_inside(t[k]) != (inside == 1)) ++k;
    const uint32_t p = crossing(t[k], t[(k + 1) % 3]), q = crossing(t[(k + 2) % 3], t[k]);
    if (inside == 1)
      next_[p] = q;
    else
      next_[q] = p;
  }

  /// Once around the border, counter-clockwise, noting every run that is inside.
  void walk_border() {
    std::vector<Node> nodes;
    for (int i = 0; i < n_; ++i) nodes.push_back({i, 0});
    for (int j = 0; j < n_; ++j) nodes.push_back({n_ - j, j});
    for (int j = n_; j > 0; --j) nodes.push_back({0, j});
    const size_t count = nodes.size();
    size_t start = 0;
    while (start < count && is_inside(nodes[start])) ++start;
    if (start == count) return;  // all inside: no crossings
    uint32_t enter = kNoIndex;
    std::vector<dvec2> corners;
    for (size_t k = 0; k < count; ++k) {
      const Node &a = nodes[(start + k) % count], &b = nodes[(start + k + 1) % count];
      if (is_inside(a) != is_inside(b)) {
        if (is_inside(b)) {
          enter = crossing(a, b);
          corners.clear();
        } else {
          border_[enter] = {corners, crossing(a, b)};
        }
      }
      const bool is_corner = (b[0] == 0 && b[1] == 0) || b[0] == n_ || b[1] == n_;
      if (is_inside(b) && is_corner) corners.push_back(dvec2(b[0] / n_, b[1] / n_));
    }
  }

  const Lattice& lattice_;
  int n_;
  std::vector<uint32_t> next_;
  std::map<uint32_t, BorderRun> border_;
};

/// Measures lattice coordinates in texels.
struct TexelMetric {
  dvec2 ds, dt;

  dvec2 operator()(const dvec2& p) const { return p.x * ds + p.y * dt; }
};

double distance_to_segment(const dvec2& p, const dvec2& a, const dvec2& b) {
  const dvec2 ab = b - a;
  const double length2 = glm::dot(ab, ab);
  const double t = length2 > 0 ? std::clamp(glm::dot(p - a, ab) / length2, 0.0, 1.0) : 0.0;
  return glm::length(p - (a + t * ab));
}

/// Marks which of loop[begin .. end] (indices modulo its size) to keep, besides the two ends; at least one if asked.
void straighten_run(const std::vector<dvec2>& texels, size_t begin, size_t end, double tolerance, bool keeps_one,
                    std::vector<bool>& keep) {
  std::vector<std::pair<size_t, size_t>> stack{{begin, end}};
  while (!stack.empty()) {
    const auto [a, b] = stack.back();
    stack.pop_back();
    double farthest = std::exchange(keeps_one, false) ? -1 : tolerance;
    size_t split = a;
    for (size_t k = a + 1; k < b; ++k) {
      const double d =
          distance_to_segment(texels[k % texels.size()], texels[a % texels.size()], texels[b % texels.size()]);
      if (d > farthest) {
        farthest = d;
        split = k;
      }
    }
    if (split == a) continue;
    keep[split % texels.size()] = true;
    stack.push_back({a, split});
    stack.push_back({split, b});
  }
}

/// Whether a straight line between two points would lie on the triangle's border.
bool are_on_one_side(const dvec2& a, const dvec2& b) {
  const auto is_far = [](const dvec2& p) { return std::abs(p.x + p.y - 1) < 1e-12; };
  return (a.x == 0 && b.x == 0) || (a.y == 0 && b.y == 0) || (is_far(a) && is_far(b));
}

Loop straighten(const Loop& loop, const TexelMetric& metric, double tolerance) {
  const size_t n = loop.size();
  std::vector<dvec2> texels(n);
  for (size_t k = 0; k < n; ++k) texels[k] = metric(loop[k].at);
  std::vector<bool> keep(n);
  std::vector<size_t> anchors;
  for (size_t k = 0; k < n; ++k) {
    if (loop[k].is_fixed) anchors.push_back(k);
  }
  if (anchors.size() < 2) {
    // Anchor a loop inside the triangle at two points that are far from each other.
    const size_t first = anchors.empty() ? 0 : anchors[0];
    size_t far = first;
    for (size_t k = 0; k < n; ++k) {
      if (glm::length(texels[k] - texels[first]) > glm::length(texels[far] - texels[first])) far = k;
    }
    anchors = {std::min(first, far), std::max(first, far)};
  }
  for (size_t a = 0; a < anchors.size(); ++a) {
    const size_t begin = anchors[a], end = a + 1 < anchors.size() ? anchors[a + 1] : anchors[0] + n;
    keep[begin] = true;
    // What touches the border keeps some width there, as narrow as it may be: the neighbour has the other half of it.
    const LoopPoint &from = loop[begin % n], &to = loop[end % n];
    const bool keeps_one = from.is_fixed && to.is_fixed && are_on_one_side(from.at, to.at);
    straighten_run(texels, begin, end, tolerance, keeps_one, keep);
  }
  Loop out;
  for (size_t k = 0; k < n; ++k) {
    if (keep[k]) out.push_back(loop[k]);
  }
  return out;
}

double twice_area(const Loop& loop) {
  double sum = 0;
  for (size_t k = 0; k < loop.size(); ++k) {
    const dvec2 &a = loop[k].at, &b = loop[(k + 1) % loop.size()].at;
    sum += a.x * b.y - a.y * b.x;
  }
  return sum;
}

/// Keeps a point that is not on the triangle's border off it.
dvec2 within_triangle(dvec2 p) {
  constexpr double kMargin = 1e-6;
  p = glm::max(p, kMargin);
  const double over = p.x + p.y - (1 - kMargin);
  return over > 0 ? glm::max(p - 0.5 * over, kMargin) : p;
}

/// Straightening takes from what bulges out and adds to what bulges in. Moves the free points of the straightened loop
/// perpendicularly to their neighbours until it has the area of the loop before.
void restore_area(const Loop& before, Loop& loop) {
  std::vector<dvec2> gradient(loop.size(), dvec2(0.0));  // of twice the area
  double norm2 = 0;
  for (size_t k = 0; k < loop.size(); ++k) {
    if (loop[k].is_fixed) continue;
    const dvec2 across = loop[(k + 1) % loop.size()].at - loop[(k + loop.size() - 1) % loop.size()].at;
    gradient[k] = {across.y, -across.x};
    norm2 += glm::dot(across, across);
  }
  if (!(norm2 > 0)) return;
  const double step = (twice_area(before) - twice_area(loop)) / norm2;
  for (size_t k = 0; k < loop.size(); ++k) {
    if (!loop[k].is_fixed) loop[k].at = within_triangle(loop[k].at + step * gradient[k]);
  }
}

double twice_area(const std::vector<Loop>& loops) {
  double sum = 0;
  for (const Loop& loop : loops) sum += twice_area(loop);
  return sum;
}

double twice_area(const Filling& filling, const uvec3& t) {
  const dvec2 &a = filling.points[t.x], &b = filling.points[t.y], &c = filling.points[t.z];
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

Filling fill(const std::vector<Loop>& loops) {
  std::vector<dvec2> points;
  std::vector<Ring> rings;
  for (const Loop& loop : loops) {
    Ring ring(loop.size());
    std::iota(ring.begin(), ring.end(), static_cast<Index>(points.size()));
    for (const LoopPoint& p : loop) points.push_back(p.at);
    rings.push_back(std::move(ring));
  }
  Filling out = fill_rings(std::move(points), rings, Winding::Positive);
  std::erase_if(out.triangles, [&](const uvec3& t) { return twice_area(out, t) == 0; });
  return out;
}

/// Flips inner edges until every one is locally Delaunay in texel space [Lawson 1977]: a sweep line leaves needles.
void flip_to_delaunay(Filling& filling, const TexelMetric& metric) {
  using Edge = std::pair<uint32_t, uint32_t>;
  const auto position = [&](uint32_t v) { return metric(filling.points[v]); };
  const auto angle_cosine = [&](uint32_t apex, uint32_t a, uint32_t b) {
    const dvec2 u = position(a) - position(apex), v = position(b) - position(apex);
    return glm::dot(u, v) / std::max(glm::length(u) * glm::length(v), 1e-300);
  };
  std::map<Edge, std::array<uint32_t, 2>> faces;  // the triangles left and right of each edge
  const auto name = [](uint32_t a, uint32_t b) { return Edge(std::min(a, b), std::max(a, b)); };
  const auto link = [&](uint32_t triangle) {
    const uvec3& t = filling.triangles[triangle];
    for (int k = 0; k < 3; ++k) {
      auto& sides =
          faces.try_emplace(name(t[k], t[(k + 1) % 3]), std::array<uint32_t, 2>{kNoIndex, kNoIndex}).first->second;
      (sides[0] == kNoIndex ? sides[0] : sides[1]) = triangle;
    }
  };
  for (uint32_t i = 0; i < filling.triangles.size(); ++i) link(i);

  std::vector<Edge> stack;
  for (const auto& [edge, sides] : faces) {
    if (sides[1] != kNoIndex) stack.push_back(edge);
  }
  const auto replace_side = [&](Edge edge, uint32_t from, uint32_t to) {
    for (uint32_t& side : faces[edge]) {
      if (side == from) {
        side = to;
        return;
      }
    }
  };
  // Lawson's flips end by themselves; the limit only guards against ties that rounding makes go in circles.
  size_t flips_left = 20 * filling.triangles.size() + 100;
  while (!stack.empty() && flips_left > 0) {
    const Edge edge = stack.back();
    stack.pop_back();
    const auto found = faces.find(edge);
    if (found == faces.end() || found->second[1] == kNoIndex) continue;
    const uint32_t left = found->second[0], right = found->second[1];
    uvec3 &l = filling.triangles[left], &r = filling.triangles[right];
    int k = 0;
    while (name(l[k], l[(k + 1) % 3]) != edge) ++k;
    const uint32_t a = l[k], b = l[(k + 1) % 3], c = l[(k + 2) % 3], d = r.x + r.y + r.z - a - b;
    // Delaunay: the angles against the edge sum up to at most 180 degrees.
    if (angle_cosine(c, a, b) + angle_cosine(d, a, b) >= -1e-9) continue;
    const uvec3 first(c, a, d), second(d, b, c);
    if (twice_area(filling, first) <= 0 || twice_area(filling, second) <= 0) continue;
    if (faces.count(name(c, d)) != 0) continue;
    l = first;
    r = second;
    faces.erase(found);
    faces[name(c, d)] = {left, right};
    replace_side(name(a, d), right, left);
    replace_side(name(b, c), left, right);
    for (const Edge& e : {name(c, a), name(a, d), name(d, b), name(b, c)}) stack.push_back(e);
    --flips_left;
  }
}

/// The loops straightened as much as their area allows, and filled. The first tolerance for which the area and the
/// filling are right wins.
Filling fill_straightened(const std::vector<Loop>& loops, const TexelMetric& metric, double coarsest_texels) {
  const double area = twice_area(loops);
  for (double tolerance = coarsest_texels; tolerance >= kFinestTexels; tolerance *= 0.75) {
    std::vector<Loop> straight;
    for (const Loop& loop : loops) {
      Loop straightened = straighten(loop, metric, tolerance);
      if (straightened.size() < 3) continue;
      restore_area(loop, straightened);
      straight.push_back(std::move(straightened));
    }
    if (std::abs(twice_area(straight) - area) > kAreaTolerance * area) continue;
    Filling filling = fill(straight);
    // A straightened loop might cross another one: then the triangles overlap and their area gives it away.
    double filled = 0;
    bool is_flipped = false;
    for (const uvec3& t : filling.triangles) {
      filled += twice_area(filling, t);
      is_flipped |= twice_area(filling, t) < 0;
    }
    if (!is_flipped && std::abs(filled - area) <= kAreaTolerance * area) return filling;
  }
  Filling filling = fill(loops);
  std::erase_if(filling.triangles, [&](const uvec3& t) { return twice_area(filling, t) < 0; });
  return filling;
}

/// Lattice to barycentric coordinates of the caller's corners; exactly on an edge stays exactly on it.
vec3 to_barycentric(const dvec2& p, const std::array<size_t, 3>& order) {
  std::array<float, 3> sorted{};
  const float s = static_cast<float>(p.x), t = static_cast<float>(p.y);
  const bool is_on_far_edge = std::abs(p.x + p.y - 1) < 1e-12;
  sorted[1] = is_on_far_edge ? 1 - t : s;
  sorted[2] = t;
  sorted[0] = is_on_far_edge ? 0.0f : 1 - s - t;
  vec3 out;
  for (size_t k = 0; k < 3; ++k) out[static_cast<int>(order[k])] = sorted[k];
  return out;
}

CutPattern whole_triangle() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}}, 1}; }

/// Whether the sorted corners run the other way round than the caller's.
bool is_odd(const std::array<size_t, 3>& order) { return (order[0] + 1) % 3 != order[1]; }

dvec2 texture_size(const SourceMaterial& material) {
  dvec2 size(1, 1);
  for (const SourceTexture* map : {&material.base_color_map, &material.alpha_map}) {
    if (*map) size = glm::max(size, dvec2(map->image->width(), map->image->height()));
  }
  return size;
}

}  // namespace

int cut_subdivisions(const SourceMaterial& material, std::span<const MaskedTriangle> triangles) {
  const dvec2 size = texture_size(material);
  double longest = 1;
  for (const MaskedTriangle& t : triangles) {
    if (!is_usable(t.uv)) continue;
    for (size_t k = 0; k < 3; ++k) {
      longest = std::max(longest, glm::length(dvec2(t.uv[(k + 1) % 3] - t.uv[k]) * size));
    }
  }
  // One lattice edge per texel, less where that would be more than 2e8 lattice nodes in all.
  int subdivisions = 1;
  while (subdivisions < 1024 && subdivisions < longest) subdivisions *= 2;
  const auto work = [&] { return 0.5 * static_cast<double>(triangles.size()) * subdivisions * subdivisions; };
  while (subdivisions > 4 && work() > 2e8) subdivisions /= 2;
  return subdivisions;
}

double texel_size(const SourceMaterial& material, const MaskedTriangle& triangle, const std::array<vec3, 3>& corners) {
  double largest = 0;
  if (!is_usable(triangle.uv)) return 0;
  for (size_t k = 0; k < 3; ++k) {
    const dvec2 texels = dvec2(triangle.uv[(k + 1) % 3] - triangle.uv[k]) * texture_size(material);
    if (glm::length(texels) < 1e-3) return 0;
    largest = std::max(largest, glm::length(dvec3(corners[(k + 1) % 3]) - dvec3(corners[k])) / glm::length(texels));
  }
  return largest;
}

CutPattern cut_by_mask(const SourceMaterial& material, const MaskedTriangle& triangle, int subdivisions,
                       double tolerance_texels) {
  if (!is_usable(triangle.uv)) return whole_triangle();
  const Sorted sorted = sort_corners(triangle);
  const Lattice lattice(material, sorted.corners, subdivisions);
  const std::vector<Loop> loops = Outline(lattice).loops();
  if (loops.empty()) return {};
  const bool is_all_border = loops.size() == 1 && loops[0].size() == 3 && twice_area(loops[0]) == 1;
  if (is_all_border) return whole_triangle();

  const dvec2 size = texture_size(material);
  const auto& uv = sorted.corners.uv;
  TexelMetric metric{dvec2(uv[1] - uv[0]) * size, dvec2(uv[2] - uv[0]) * size};
  // Without area in UV space (alpha then comes from vertices or along a line), measure in units of the triangle.
  if (std::abs(metric.ds.x * metric.dt.y - metric.ds.y * metric.dt.x) < 1e-6) metric = {dvec2(64, 0), dvec2(0, 64)};

  Filling filling = fill_straightened(loops, metric, tolerance_texels);
  flip_to_delaunay(filling, metric);
  CutPattern out;
  for (const dvec2& p : filling.points) out.vertices.push_back(to_barycentric(p, sorted.order));
  double covered = 0;
  for (const uvec3& t : filling.triangles) {
    covered += twice_area(filling, t);
    out.triangles.push_back(is_odd(sorted.order) ? uvec3(t.x, t.z, t.y) : t);
  }
  out.coverage = static_cast<float>(covered);
  return out;
}

}  // namespace farfield
