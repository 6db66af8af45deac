// SPDX-License-Identifier: Apache-2.0
// Face loops: strips of quads, each joined to the next at opposite edges (thesis 8.4.2; the poly-chords of [Daniels et
// al. 2008]).
#pragma once

#include <cstdint>
#include <vector>

#include "prefilter/quad_mesh.h"

namespace farfield {

/// An edge across which a loop runs, seen in the loop's direction.
struct Rung {
  uint32_t left, right;
};

/// ```
///   left   l0 --- l1 --- l2 --- l3      quads[i] lies between rungs[i] and rungs[i + 1],
///          |  q0  |  q1  |  q2  |       of a closed loop the last one between the last rung and the first
///   right  r0 --- r1 --- r2 --- r3
/// ```
/// A loop that crosses itself passes through a quad twice, each time across the other two of its edges: that quad is
/// there twice. Vertices are there twice where it lies beside itself.
struct FaceLoop {
  std::vector<Rung> rungs;
  std::vector<uint32_t> quads;
  bool is_closed = false;
  bool is_twisted = false;  ///< closed, but left is right after one turn, as on a Moebius strip
  /// Of an open loop, beyond its first and last rung: a triangle, kNoIndex (a border) or QuadMesh::kNotManifold.
  uint32_t before = kNoIndex, after = kNoIndex;
};

/// The loop through a living quad that crosses the edge from its corner `corner` to the next, and the opposite one.
FaceLoop trace_loop(const QuadMesh& mesh, uint32_t quad, int corner);

/// All loops, each once, in the order of their first quads. Each quad is on two of them, or twice on one.
std::vector<FaceLoop> find_face_loops(const QuadMesh& mesh);

}  // namespace farfield
