// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_loops.h"

#include <algorithm>
#include <optional>

namespace farfield {
namespace {

/// On the way through a quad: the corners at which it was entered.
struct Step {
  uint32_t quad;
  int corner;    ///< the edge is from here to the next corner
  bool is_left;  ///< `corner` is on the left
};

Rung rung_of(const QuadMesh& mesh, const Step& step) {
  const PolygonCorners& c = mesh.face(step.quad);
  const uint32_t first = c[step.corner], second = c[(step.corner + 1) % 4];
  return step.is_left ? Rung{first, second} : Rung{second, first};
}

/// Of the opposite edge of the step's quad.
Rung far_rung(const QuadMesh& mesh, const Step& step) {
  const PolygonCorners& c = mesh.face(step.quad);
  const uint32_t beside_first = c[(step.corner + 3) % 4], beside_second = c[(step.corner + 2) % 4];
  return step.is_left ? Rung{beside_first, beside_second} : Rung{beside_second, beside_first};
}

/// Into the quad beyond the far rung; nothing where the loop ends, `end` says at what.
std::optional<Step> next(const QuadMesh& mesh, const Step& step, uint32_t& end) {
  const Rung rung = far_rung(mesh, step);
  end = mesh.beyond(step.quad, rung.left, rung.right);
  if (end == kNoIndex || end == QuadMesh::kNotManifold || !mesh.is_quad(end)) return std::nullopt;
  const int corner = mesh.edge_corner(end, rung.left, rung.right);
  return Step{end, corner, mesh.face(end)[corner] == rung.left};
}

}  // namespace

FaceLoop trace_loop(const QuadMesh& mesh, uint32_t quad, int corner) {
  FaceLoop loop;
  const Step start{quad, corner, true};
  loop.rungs.push_back(rung_of(mesh, start));
  for (Step step = start;;) {
    loop.quads.push_back(step.quad);
    const auto entered = next(mesh, step, loop.after);
    if (entered && entered->quad == start.quad && entered->corner == start.corner) {
      loop.is_closed = true;
      loop.is_twisted = !entered->is_left;
      loop.after = kNoIndex;
      return loop;
    }
    loop.rungs.push_back(far_rung(mesh, step));
    if (!entered) break;
    step = *entered;
  }

  // Open: the rest lies the other way, entered across the opposite edge, where left is right.
  std::vector<Rung> rungs;
  std::vector<uint32_t> quads;
  Step step{quad, (corner + 2) % 4, true};
  while (const auto entered = next(mesh, step, loop.before)) {
    step = *entered;
    quads.push_back(step.quad);
    const Rung rung = far_rung(mesh, step);
    rungs.push_back({rung.right, rung.left});
  }
  std::reverse(rungs.begin(), rungs.end());
  std::reverse(quads.begin(), quads.end());
  loop.rungs.insert(loop.rungs.begin(), rungs.begin(), rungs.end());
  loop.quads.insert(loop.quads.begin(), quads.begin(), quads.end());
  return loop;
}

std::vector<FaceLoop> find_face_loops(const QuadMesh& mesh) {
  std::vector<FaceLoop> loops;
  std::vector<std::array<uint8_t, 2>> is_passed(mesh.face_count(), {0, 0});  // per quad: across corners 0 and 1
  for (uint32_t quad = 0; quad < mesh.face_count(); ++quad) {
    if (!mesh.is_alive(quad) || !mesh.is_quad(quad)) continue;
    for (int corner = 0; corner < 2; ++corner) {
      if (is_passed[quad][static_cast<size_t>(corner)]) continue;
      loops.push_back(trace_loop(mesh, quad, corner));
      const FaceLoop& loop = loops.back();
      for (size_t i = 0; i < loop.quads.size(); ++i) {
        const int across = mesh.edge_corner(loop.quads[i], loop.rungs[i].left, loop.rungs[i].right);
        is_passed[loop.quads[i]][static_cast<size_t>(across % 2)] = 1;
      }
    }
  }
  return loops;
}

}  // namespace farfield
