// SPDX-License-Identifier: Apache-2.0
// A surface taken apart into connected parts, which are simplified on their own, and put together again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "prefilter/simplify.h"
#include "prefilter/surface.h"

namespace farfield {

/// The connected parts of a surface, connected through shared vertices; faces and vertices of each are ascending.
struct SurfaceParts {
  std::vector<uint32_t> first_face, faces;       ///< part i has faces[first_face[i]] to faces[first_face[i + 1]]
  std::vector<uint32_t> first_vertex, vertices;  ///< likewise
  std::vector<uint32_t> local_vertex;            ///< per vertex of the surface: its number within its part, or kNoIndex

  size_t size() const { return first_face.size() - 1; }
  std::span<const uint32_t> faces_of(size_t part) const {
    return std::span(faces).subspan(first_face[part], first_face[part + 1] - first_face[part]);
  }
  std::span<const uint32_t> vertices_of(size_t part) const {
    return std::span(vertices).subspan(first_vertex[part], first_vertex[part + 1] - first_vertex[part]);
  }
};

SurfaceParts find_parts(const Surface& surface);

/// The surface while its parts are being simplified, in the numbering of the input.
struct WorkingSurface {
  Surface surface;
  std::vector<uint32_t> merged_into;  ///< per vertex; itself if it lives or is unused
  std::vector<uint8_t> is_face_alive;
};

/// Nothing has collapsed yet.
WorkingSurface begin_work(const Surface& surface);

/// Leaves out what collapsed and what no face uses.
SimplifyResult finish_work(const WorkingSurface& working, const SurfaceParts& parts);

}  // namespace farfield
