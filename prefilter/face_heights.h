// SPDX-License-Identifier: Apache-2.0
// How high a displacement map lifts the faces of a cage (thesis 6.1.5).
#pragma once

#include <span>
#include <vector>

#include "base/vec.h"
#include "import/source_mesh.h"
#include "prefilter/limit_surface.h"

namespace farfield {

/// Which map each face of a cage has. Immutable once made, any thread; mesh and cage must outlive it.
class FaceHeights {
 public:
  FaceHeights(const Cage& cage, const SourceMesh& mesh);

  /// Null: the face is not displaced, for lack of a map or of texture coordinates.
  const SourceHeights* of(int face) const { return of_face_.empty() ? nullptr : of_face_[static_cast<size_t>(face)]; }
  /// Multiplies the heights of a face.
  double scale(int face) const { return scale_.empty() ? 1.0 : scale_[static_cast<size_t>(face)]; }
  bool empty() const { return of_face_.empty(); }

 private:
  std::vector<const SourceHeights*> of_face_;  ///< empty: no face has one
  std::vector<float> scale_;                   ///< empty: 1
};

/// A face against its map.
struct HeightDetail {
  double detail = 0;       ///< a length: what heights are means over
  glm::dvec2 length{0.0};  ///< along u and v, at most; of triangles the longest side, twice
  glm::dvec2 texels{0.0};  ///< the same in texels of the map
  float footprint = 1;     ///< the detail in texels
  glm::dvec2 most{1.0};    ///< cutting into more parts than this shows nothing more
};

/// `detail` is a length: heights are means over it.
HeightDetail detail_of(const SourceHeights& heights, const FaceLimit& limit, double detail);

/// The height at texture coordinates, in the mesh's units; 0 where they are not finite.
double height_at(const SourceHeights& heights, const glm::dvec2& uv, float footprint);

}  // namespace farfield
