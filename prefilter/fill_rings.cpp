// SPDX-License-Identifier: Apache-2.0
#include "prefilter/fill_rings.h"

#include <GL/glu.h>

#include <algorithm>
#include <array>
#include <memory>

namespace farfield {
namespace {

using glm::dvec2;

// GLU hands pointers through: these stand for indices.
void* to_pointer(Index i) { return reinterpret_cast<void*>(static_cast<uintptr_t>(i)); }
Index to_index(const void* pointer) { return static_cast<Index>(reinterpret_cast<uintptr_t>(pointer)); }

/// What GLU's callbacks work on.
struct Sweep {
  Filling filling;
  size_t given = 0;  ///< points that are not crossings
  std::vector<Index> corners;
  bool has_failed = false;
};

void on_vertex(void* vertex, void* sweep) { static_cast<Sweep*>(sweep)->corners.push_back(to_index(vertex)); }

/// That there is such a callback makes GLU give single triangles instead of strips and fans.
void on_edge_flag(GLboolean, void*) {}

void on_error(GLenum, void* sweep) { static_cast<Sweep*>(sweep)->has_failed = true; }

/// A point where edges cross, or where points coincide, from up to four others (the rest is null and weighs 0).
void on_crossing(GLdouble at[3], void* from[4], GLfloat weight[4], void** out, void* data) {
  Sweep& sweep = *static_cast<Sweep*>(data);
  const auto heaviest = std::max_element(weight, weight + 4) - weight;
  const Index source = to_index(from[heaviest]);
  Filling& filling = sweep.filling;
  filling.nearest.push_back(source < sweep.given ? source : filling.nearest[source - sweep.given]);
  *out = to_pointer(static_cast<Index>(filling.points.size()));
  filling.points.emplace_back(at[0], at[1]);
}

template <typename Function>
void set_callback(GLUtesselator* tesselator, GLenum which, Function* function) {
  gluTessCallback(tesselator, which, reinterpret_cast<_GLUfuncptr>(function));
}

}  // namespace

double twice_area(std::span<const dvec2> points, std::span<const Index> ring) {
  double sum = 0;
  for (size_t i = 0; i < ring.size(); ++i) {
    const dvec2 &a = points[ring[i]], &b = points[ring[(i + 1) % ring.size()]];
    sum += a.x * b.y - a.y * b.x;
  }
  return sum;
}

Filling fill_rings(std::vector<dvec2> points, std::span<const Ring> rings, Winding winding) {
  Sweep sweep;
  sweep.given = points.size();
  sweep.filling.points = std::move(points);
  const std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> tesselator(gluNewTess(), gluDeleteTess);
  if (!tesselator) return std::move(sweep.filling);
  set_callback(tesselator.get(), GLU_TESS_VERTEX_DATA, on_vertex);
  set_callback(tesselator.get(), GLU_TESS_EDGE_FLAG_DATA, on_edge_flag);
  set_callback(tesselator.get(), GLU_TESS_COMBINE_DATA, on_crossing);
  set_callback(tesselator.get(), GLU_TESS_ERROR_DATA, on_error);
  gluTessProperty(tesselator.get(), GLU_TESS_WINDING_RULE,
                  winding == Winding::Positive ? GLU_TESS_WINDING_POSITIVE : GLU_TESS_WINDING_NONZERO);
  gluTessNormal(tesselator.get(), 0, 0, 1);

  gluTessBeginPolygon(tesselator.get(), &sweep);
  for (const Ring& ring : rings) {
    if (ring.size() < 3) continue;
    gluTessBeginContour(tesselator.get());
    for (const Index i : ring) {
      std::array<GLdouble, 3> at = {sweep.filling.points[i].x, sweep.filling.points[i].y, 0};  // GLU copies it
      gluTessVertex(tesselator.get(), at.data(), to_pointer(i));
    }
    gluTessEndContour(tesselator.get());
  }
  gluTessEndPolygon(tesselator.get());

  const auto& corners = sweep.corners;
  if (sweep.has_failed) return std::move(sweep.filling);
  for (size_t i = 0; i + 2 < corners.size(); i += 3) {
    sweep.filling.triangles.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
  }
  return std::move(sweep.filling);
}

}  // namespace farfield
