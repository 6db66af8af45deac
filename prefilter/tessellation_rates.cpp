// SPDX-License-Identifier: Apache-2.0
// A patch that is cut into nu * nv cells, each of two triangles, is off by no more than the sum of three parts: how far
// its curves along u bend away from their chords, the same along v, and how far it is twisted within a cell. Each part
// gets its share of the error that is allowed; a sixth is left for what is bent unevenly.
#include "prefilter/tessellation_rates.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "prefilter/height_rates.h"

namespace farfield {
namespace {

using glm::dvec2;
using Parameterization = OpenSubdiv::Bfr::Parameterization;

constexpr double kShareOfCurve = 0.33, kShareOfTwist = 0.17;
// Triangles bend along three directions that are not independent: in the middle of one the error is 4 / 9 of the sum
// over its edges.
constexpr double kShareOfTriangle = 0.6;

double distance_to_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
  const dvec3 ab = b - a;
  const double length2 = glm::dot(ab, ab);
  const double t = length2 > 0 ? std::clamp(glm::dot(p - a, ab) / length2, 0.0, 1.0) : 0.0;
  return glm::length(p - (a + t * ab));
}

/// How far curve([0, 1]) lies from the chords of `count` equal parts of it, looked at in at least eight places.
template <typename Curve>
double deviation(const Curve& curve, int count) {
  const int samples = std::max(4, 8 / count);  // per part; its ends are two of them
  double most = 0;
  dvec3 begin = curve(0.0);
  for (int part = 0; part < count; ++part) {
    const dvec3 end = curve((part + 1.0) / count);
    for (int i = 1; i < samples; ++i) {
      const dvec3 p = curve((part + static_cast<double>(i) / samples) / count);
      most = std::max(most, distance_to_segment(p, begin, end));
    }
    begin = end;
  }
  return most;
}

/// The longest of what equal parts of a curve would be, were they as long as the longest sixteenth is at its pace.
template <typename Curve>
double longest(const Curve& curve) {
  constexpr int kParts = 16;
  double most = 0;
  dvec3 last = curve(0.0);
  for (int i = 1; i <= kParts; ++i) {
    const dvec3 next = curve(static_cast<double>(i) / kParts);
    most = std::max(most, kParts * glm::length(next - last));
    last = next;
  }
  return most;
}

int rate_of(double parts) { return parts < kMostRate ? std::max(1, static_cast<int>(std::ceil(parts))) : kMostRate; }

/// Parts of a curve whose chords keep within the limits. The error of chords falls with the square of their number.
template <typename Curve>
int find_rate(const Curve& curve, const TessellationLimits& limits, double share) {
  int rate = 1;
  while (rate < kMostRate) {
    const double off = deviation(curve, rate) / (share * limits.error);
    if (!(off > 1)) break;
    rate = std::clamp(rate_of(rate * std::sqrt(off)), rate + 1, kMostRate);
  }
  return limits.edge > 0 ? std::max(rate, rate_of(longest(curve) / limits.edge)) : rate;
}

/// What one face asks for.
struct RatesOfFace {
  std::array<int, 2> inside{1, 1};
  double cells = 1;       ///< that its twist asks for
  std::vector<int> edge;  ///< the least that each of its edges may have
};

/// The rates of one face after the other. One thread at a time.
class FaceRates {
 public:
  FaceRates(const LimitSurface& surface, const FaceHeights& heights, const TessellationLimits& limits)
      : is_smoothed_(surface.is_smoothed()), limit_(surface), heights_(heights), limits_(limits) {}

  bool move_to(int face) {
    face_ = face;
    return limit_.move_to(face);
  }

  RatesOfFace find() const {
    RatesOfFace rates;
    if (is_smoothed_) {
      rates = find_smooth();
    } else {
      rates.edge.assign(static_cast<size_t>(limit_.parameterization().GetFaceSize()), 1);
    }
    if (const SourceHeights* heights = heights_.of(face_)) add_heights(*heights, rates);
    return rates;
  }

 private:
  /// Edges are cut as often as the inside: heights vary along them no less.
  void add_heights(const SourceHeights& heights, RatesOfFace& rates) const {
    const HeightDetail detail = detail_of(heights, limit_, limits_.detail);
    rates.inside =
        rates_of_heights(heights, limit_, detail, heights_.scale(face_), kShareOfCurve * limits_.error, rates.inside);
    for (size_t i = 0; i < rates.edge.size(); ++i) rates.edge[i] = std::max(rates.edge[i], rates.inside[i % 2]);
  }

  /// Also of edges that are straight: inside the strip along an edge, whose other rim has the rates inside, faces reach
  /// as far along the edge as its parts do. So the edge has the rate of the strip's other rim at least, and enough for
  /// the strip's twist.
  RatesOfFace find_smooth() const {
    const Parameterization parameters = limit_.parameterization();
    RatesOfFace rates;
    if (is_triangle()) {
      rates.inside = inside_triangle();
    } else {
      rates.inside = inside_quad(rates.cells);
    }
    for (int i = 0; i < parameters.GetFaceSize(); ++i) {
      const double rows = rates.inside[!is_triangle() && i % 2 == 0];
      const int own = along_edge(i, 0), inner = rows > 1 ? along_edge(i, 1 / rows) : 1;
      rates.edge.push_back(std::max({own, inner, rate_of(rates.cells / rows)}));
    }
    return rates;
  }

  bool is_triangle() const { return limit_.is_triangle(); }

  /// Of the curve beside an edge, `inset` of the way across the face.
  int along_edge(int edge, double inset) const {
    const auto curve = [&](double t) { return limit_.position(beside_edge(edge, t, inset)); };
    return find_rate(curve, limits_, is_triangle() ? kShareOfTriangle : kShareOfCurve);
  }

  dvec2 beside_edge(int edge, double t, double inset) const {
    const Parameterization parameters = limit_.parameterization();
    dvec2 at;
    parameters.GetEdgeCoord(edge, t, &at.x);
    if (is_triangle()) {
      constexpr std::array kOpposite = {dvec2(0, 1), dvec2(0, 0), dvec2(1, 0)};
      return at + inset * (kOpposite[static_cast<size_t>(edge)] - at);
    }
    constexpr std::array kInwards = {dvec2(0, 1), dvec2(-1, 0), dvec2(0, -1), dvec2(1, 0)};
    return at + inset * kInwards[static_cast<size_t>(edge)];
  }

  /// Along lines half way between each edge and the corner opposite.
  std::array<int, 2> inside_triangle() const {
    int half = 1;
    for (int edge = 0; edge < 3; ++edge) half = std::max(half, along_edge(edge, 0.5));
    const int rate = std::min(2 * half, kMostRate);
    return {rate, rate};
  }

  std::array<int, 2> inside_quad(double& cells) const {
    std::array<int, 2> rates{1, 1};
    for (const double across : {0.25, 0.5, 0.75}) {
      rates[0] = std::max(rates[0], along_edge(0, across));
      rates[1] = std::max(rates[1], along_edge(3, across));
    }
    cells = cells_for_twist();
    const double needed = cells / (static_cast<double>(rates[0]) * rates[1]);
    if (needed > 1) {
      for (int& rate : rates) rate = rate_of(rate * std::sqrt(needed));
    }
    return rates;
  }

  /// How many cells the twist asks for: a quad whose corner lies a height above the plane of the others is off its two
  /// triangles by a quarter of that in the middle.
  double cells_for_twist() const {
    constexpr int kSide = 4;
    dvec3 p[kSide + 1][kSide + 1];
    for (int y = 0; y <= kSide; ++y) {
      for (int x = 0; x <= kSide; ++x) p[y][x] = limit_.position(dvec2(x, y) / double{kSide});
    }
    double most = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const dvec3 a = p[y][x], b = p[y][x + 1], c = p[y + 1][x + 1], d = p[y + 1][x];
        const dvec3 n = glm::cross(c - a, d - b);
        const double length = glm::length(n);
        if (length > 0) most = std::max(most, std::abs(glm::dot(n, a - b + c - d)) / length);
      }
    }
    return kSide * kSide * most / (4 * kShareOfTwist * limits_.error);
  }

  bool is_smoothed_;
  int face_ = 0;
  FaceLimit limit_;
  const FaceHeights& heights_;
  const TessellationLimits& limits_;
};

}  // namespace

TessellationRates find_rates(const LimitSurface& surface, const FaceHeights& heights, const TessellationLimits& limits,
                             const Job& job) {
  const auto topology = surface.topology();
  TessellationRates rates;
  rates.edge.assign(static_cast<size_t>(topology.GetNumEdges()), 1);
  rates.inside.assign(static_cast<size_t>(topology.GetNumFaces()), {1, 1});
  std::vector<std::vector<int>> edge_of_face(rates.inside.size());
  constexpr size_t kGrain = 16;
  parallel_for(rates.inside.size(), kGrain, [&](size_t begin, size_t end) {
    FaceRates face_rates(surface, heights, limits);
    for (size_t face = begin; face < end && !job.is_cancelled(); ++face) {
      if (!face_rates.move_to(static_cast<int>(face))) continue;
      RatesOfFace found = face_rates.find();
      rates.inside[face] = found.inside;
      edge_of_face[face] = std::move(found.edge);
    }
  });
  for (size_t face = 0; face < edge_of_face.size(); ++face) {
    const auto edges = topology.GetFaceEdges(static_cast<int>(face));
    for (size_t i = 0; i < edge_of_face[face].size(); ++i) {
      int& rate = rates.edge[static_cast<size_t>(edges[static_cast<int>(i)])];
      rate = std::max(rate, edge_of_face[face][i]);
    }
  }
  return rates;
}

}  // namespace farfield
