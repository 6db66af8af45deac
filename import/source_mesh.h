// SPDX-License-Identifier: Apache-2.0
// What the readers of OBJ, PLY and glTF hand to the import: polygons as the file has them, with corner attributes and
// materials, before any geometry is touched.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/hash.h"
#include "base/result.h"
#include "base/surface_material.h"
#include "base/vec.h"
#include "farfield/material.h"
#include "import/height_map.h"
#include "import/subdivision_options.h"
#include "import/texture.h"

namespace farfield {

/// An image and how it continues outside [0, 1]^2.
struct SourceTexture {
  std::shared_ptr<const Texture> image;  ///< null: no texture
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
  bool is_missing = false;  ///< the source names a texture, but it could not be read: a warning says why

  explicit operator bool() const { return image != nullptr; }
};

/// The other formats are mapped to glTF's model by their readers.
using SourceMaterial = SurfaceMaterial<SourceTexture>;

/// A displacement map: the surface lies (base + gain * value) above its faces, in the mesh's units.
struct SourceHeights {
  std::shared_ptr<const HeightMap> map;  ///< null: no displacement
  std::string name;                      ///< of the image, for messages
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
  float gain = 1, base = 0;  ///< finite

  explicit operator bool() const { return map != nullptr; }
};

/// Where a mesh of a file stands: so many faces, one after the other.
struct SourcePlacement {
  uint32_t mesh = 0;  ///< places of equal numbers show the same faces in the same order
  size_t first_face = 0, face_count = 0;
  glm::dmat4x3 to_asset{1.0};  ///< from the mesh's space to that of positions
};

struct SourceMesh {
  std::vector<dvec3> positions;
  std::vector<uint32_t> face_begin{0};    ///< face i has the corners face_begin[i] .. face_begin[i + 1] - 1
  std::vector<uint32_t> corner_position;  ///< index into positions; checked by the readers
  std::vector<vec2> corner_uv;            ///< empty, or one per corner; v points down the image
  std::vector<vec4> corner_color;         ///< empty, or one per corner; linear RGBA
  std::vector<vec3> corner_normal;        ///< empty, or one per corner: shading normal, any length; 0: the face's own
  std::vector<uint32_t> face_material;    ///< index into materials
  std::vector<uint32_t> face_number;      ///< empty, or of each face the number that the file's polygons give it
  std::vector<SourceMaterial> materials;
  std::vector<SourceHeights> heights;    ///< empty, or one per material
  std::vector<float> face_height_scale;  ///< empty: 1; or per face: multiplies its heights, > 0
  /// Empty, or per face: which cage it is part of; none: as the caller asks. Parts share no edges.
  std::vector<std::optional<SubdivisionScheme>> face_scheme;
  std::vector<SourcePlacement> placements;  ///< ascending; empty: nothing is known of what is repeated
  CageTags cage;                         ///< if the polygons are a subdivision cage: where it is sharp, and its rules
  bool is_split = false;                 ///< vertices are doubled where uv or normals differ, as glTF has them
  MaterialFunction material_function;    ///< a host's own; if set, `materials` give names and modes only
  MaterialBatchFunction material_batch;  ///< answers as material_function, many places at once; may be empty
  std::vector<std::string> warnings;     ///< one line each
  std::vector<HashedFile> source_files;  ///< that the main file refers to, relative to its folder, in order of use
  uint64_t source_hash = 0;              ///< see hash_source(); set by read_source()

  size_t face_count() const { return face_material.size(); }
  size_t corner_count() const { return corner_position.size(); }
};

}  // namespace farfield
