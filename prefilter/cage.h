// SPDX-License-Identifier: Apache-2.0
// A mesh as a subdivision cage: what OpenSubdiv can refine, with all that a file may get wrong taken out.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "base/vec.h"
#include "import/source_mesh.h"

namespace farfield {

/// Values that corners share where they are equal at the same point: texture coordinates or colours. Where they are
/// not there is a seam.
template <int N>
struct CageChannel {
  std::vector<glm::vec<N, double>> values;
  std::vector<int> corner_value;  ///< per corner; empty: the cage does not have it
};

/// Indices are int, as OpenSubdiv has them. Faces have at least three points, all different, finite, and are no one's
/// double; neighbours wind the same way round where that is possible. Every point has a face.
struct Cage {
  std::vector<dvec3> points;
  std::vector<int> face_size;
  std::vector<int> corner_point;   ///< face after face
  std::vector<uint32_t> face;      ///< per face: its number in the mesh
  std::vector<int> holes;          ///< faces that only shape their neighbours
  std::vector<int> crease_points;  ///< two per crease, the ends of an edge that exists
  std::vector<float> crease_sharpness;
  std::vector<int> sharp_points;
  std::vector<float> point_sharpness;
  CageChannel<2> uv;  ///< NaN where the mesh has none
  CageChannel<4> color;
  std::vector<dvec3> corner_normal;  ///< of polygons only: unit, per corner
  double side = 0;                   ///< longest of the bounds
};

/// What a mesh is to be.
enum class CageUse : uint8_t {
  Smoothed,  ///< a cage in the proper sense
  AsItIs,    ///< polygons, which are the surface: points at the same place are one, normals are kept
};

/// What is left out or mended is said in mesh.warnings, a line each. Errors: BadFile (nothing is left), Unsupported
/// (more corners or neighbours of a point than OpenSubdiv takes), Cancelled.
Result<Cage> make_cage(SourceMesh& mesh, CageUse use, const std::string& name, const Job& job = {});

}  // namespace farfield
