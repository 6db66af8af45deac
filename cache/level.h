// SPDX-License-Identifier: Apache-2.0
// One level of a baked asset: the arrays that the bake writes, that lie in the file, and that rays read in place.
//
// A level is a surface (quads with one or two faces each, a material per face) and a brick volume. Every array is
// a *section*. A level has only the sections that its asset needs: an absent section means the default written
// beside it. Arrays of one group (faces, voxels) have the same length.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "cache/octants.h"
#include "scattering/sggx_codec.h"
#include "scattering/sheet.h"

namespace farfield {

/// Vertices of one Embree quad. Embree splits it along v1-v3: face 0 is (v0, v1, v3), face 1 is (v2, v3, v1).
/// A lone triangle (a, b, c) is stored as (a, b, c, c): face 0 is the triangle, face 1 is degenerate and absent.
struct Quad {
  uint32_t v0, v1, v2, v3;
  bool is_pair() const { return v2 != v3; }
  /// The corners of face 0 or 1.
  uvec3 face(uint32_t number) const { return number == 0 ? uvec3(v0, v1, v3) : uvec3(v2, v3, v1); }
};
static_assert(sizeof(Quad) == 16);

/// Linear RGB in [0, 1], each channel stored as round(255 sqrt(c)): finer where the eye is.
struct PackedColor {
  std::array<uint8_t, 3> sqrt_rgb;
  friend bool operator==(const PackedColor&, const PackedColor&) = default;
};
PackedColor pack_color(const vec3& linear_rgb);
vec3 unpack_color(PackedColor color);

/// Linear RGB in [0, 1] as PackedColor has it, and alpha as round(255 sqrt(a)).
struct PackedVertexColor {
  std::array<uint8_t, 4> sqrt_rgba;
  friend bool operator==(const PackedVertexColor&, const PackedVertexColor&) = default;
};
PackedVertexColor pack_vertex_color(const vec4& linear_rgba);
vec4 unpack_vertex_color(PackedVertexColor color);

/// A SheetShape (scattering/sheet.h), each number as unorm8. No sheet: order 0.
struct PackedSheetShape {
  uint8_t edge = 0, order = 0, caught = 0;
  friend bool operator==(const PackedSheetShape&, const PackedSheetShape&) = default;
};
PackedSheetShape pack_sheet_shape(const SheetShape& shape);
SheetShape unpack_sheet_shape(PackedSheetShape shape);

/// Radiance from 1e-30 to 1e30, linear RGB: three mantissas and an exponent that they share, 0.4 % of the largest
/// channel [Ward 1991].
struct PackedRadiance {
  std::array<uint8_t, 4> rgbe;
  friend bool operator==(const PackedRadiance&, const PackedRadiance&) = default;
};
PackedRadiance pack_radiance(const vec3& radiance);
vec3 unpack_radiance(PackedRadiance radiance);

/// Single-scattering albedos, linear RGB in [0, 1], each channel stored as round(255 (2 / pi) asin(sqrt(c))): fine
/// where nearly all is absorbed and, more so, where nearly nothing is. 0 and 1 are exact, 0.999 is off by 5e-5.
struct PackedAlbedo {
  std::array<uint8_t, 3> angle_rgb;
  friend bool operator==(const PackedAlbedo&, const PackedAlbedo&) = default;
};
PackedAlbedo pack_albedo(const vec3& albedo);
vec3 unpack_albedo(PackedAlbedo albedo);

/// A mean cosine of scattering, within kMostFogAnisotropy, as round(127 g).
int8_t pack_anisotropy(float g);
inline float unpack_anisotropy(int8_t packed) { return static_cast<float>(packed) * (1.0f / 127.0f); }

/// A unit vector on the octahedron, 7e-5 rad [Cigolle et al. 2014].
struct PackedNormal {
  std::array<int16_t, 2> octahedral;
  friend bool operator==(const PackedNormal&, const PackedNormal&) = default;
};
PackedNormal pack_normal(const vec3& unit_normal);
vec3 unpack_normal(PackedNormal normal);

/// A scalar in [0, 1] as round(255 x).
uint8_t pack_unorm8(float x);
inline float unpack_unorm8(uint8_t x) { return static_cast<float>(x) * (1.0f / 255.0f); }

inline constexpr int kBrickSide = 8;                                       ///< voxels along a brick's edge
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;  ///< 512
inline constexpr uint32_t kNoBrick = 0xffffffffu;                          ///< brick table entry of an empty brick

/// One stored brick. The density of voxel i (x fastest, then y, then z) is density[i] / 255 * density_scale, in 1 /
/// scene unit: the attenuation coefficient rho of docs/theory.md, section 1 (lambda_max(S) = 1), so that sigma_t(w) =
/// rho sqrt(w^T S w) and density_scale bounds sigma_t in the brick. Non-zero densities never round to 0. The payload of
/// voxel i, when its density is not 0, is at payload_base + (number of non-zero densities before i) = payload_base +
/// rank(i).
struct alignas(64) Brick {
  std::array<uint64_t, 8> mask;      ///< bit i % 64 of word i / 64: density of voxel i is not 0
  std::array<uint16_t, 8> prefix;    ///< non-zero voxels in the words before this one
  float density_scale;               ///< > 0
  uint32_t payload_base;             ///< index into the voxel sections
  std::array<uint8_t, 40> reserved;  ///< 0
  std::array<uint8_t, kBrickVoxels> density;

  /// Index of voxel i's payload. Only for voxels with density[i] != 0.
  uint32_t payload_index(int i) const {
    const uint64_t below = mask[static_cast<size_t>(i >> 6)] & ((uint64_t{1} << (i & 63)) - 1);
    return payload_base + prefix[static_cast<size_t>(i >> 6)] + static_cast<uint32_t>(__builtin_popcountll(below));
  }
};
static_assert(sizeof(Brick) == 640);

/// The box of the brick's voxels that are not empty, in voxels from its corner.
Box3 active_box(const Brick& brick);

/// Where a part of a level's surface stands. Parts are what a source shows many times (the leaves of a tree): a level 0
/// may have the quads of each once, in a space of their own, and any number of places for it.
struct PartPlacement {
  mat4x3 level_to_part{1.0f};  ///< from the level's space to the part's; invertible
  uint32_t part = 0;
  uint32_t source_face_offset = 0;  ///< added to the numbers that source_face has, which are those of the first place
};
static_assert(sizeof(PartPlacement) == 56);

/// Where a morph map sends things of level k-1 (thesis 8.1.2, 10.1.2).
inline constexpr uint32_t kMorphVoxelized = 0xffffffffu;  ///< it became part of the volume of level k: fades out
inline constexpr uint32_t kMorphCollapsed = 0xfffffffeu;  ///< (faces) its area shrinks to 0 while vertices move

/// source_face holds the number of a face of the source, shifted by this, and which of the triangle's corners the face
/// starts with: corner k of the face is corner (turn + k) % 3 of the source's triangle.
inline constexpr int kSourceTurnBits = 2;

/// What the voxels of a volume are.
enum class Medium : uint32_t {
  Flakes = 0,  ///< pieces of surfaces that are too small to see (scattering/flake_phase.h)
  Fog = 1,     ///< a medium that scatters by itself (scattering/fog_phase.h)
};

/// What every level has besides arrays. Lengths are in the asset's local units, positions relative to its origin.
struct LevelHeader {
  uint32_t level = 0;        ///< k
  float resolution = 0;      ///< r_k > 0
  Box3 bounds;               ///< of surface and active voxels
  ivec3 brick_dims{0};       ///< bricks along x, y, z; 0 without volume
  vec3 volume_origin{0.0f};  ///< lower corner of brick (0,0,0); voxel size is `resolution`
  float hot_spot = 0;        ///< of the volume's flakes, in [0, kStrongestHotSpot] (scattering/hot_spot.h)
  float highlight_lean = 0;  ///< of the same, at most kMostHighlightLean (scattering/highlight_lean.h)
  vec3 open_side{0.0f};      ///< of the same, at most kMostOpenSide long (scattering/open_side.h)
  Medium medium = Medium::Flakes;
  vec3 fog_albedo{
      0.0f};  ///< single scattering, of fog alone: linear RGB in [0, 1]; where voxels have none of their own
  float fog_anisotropy = 0;  ///< g of Henyey and Greenstein, of fog alone: within kMostFogAnisotropy
};

/// Coordinates, in bricks, of an entry of the brick table.
inline ivec3 brick_coordinates(const LevelHeader& header, uint64_t table_index) {
  const auto x = static_cast<uint64_t>(header.brick_dims.x);
  const auto y = static_cast<uint64_t>(header.brick_dims.y);
  return {static_cast<int>(table_index % x), static_cast<int>(table_index / x % y),
          static_cast<int>(table_index / (x * y))};
}

/// The entry of the brick table for a brick's coordinates, in a table of these dimensions.
inline size_t brick_table_index(const ivec3& dims, const ivec3& brick) {
  return static_cast<size_t>(brick.x) +
         static_cast<size_t>(dims.x) *
             (static_cast<size_t>(brick.y) + static_cast<size_t>(dims.y) * static_cast<size_t>(brick.z));
}

/// Every array of a level, once, in the order in which they lie in the file: ARRAY(id in files, Name, field, element,
/// group). Ids never change their meaning. The first two arrays are read by BVH builds, and where faces have texture
/// coordinates at hits; morph maps only by morphs: parts of the file that can be given back. Arrays of one group have
/// the same length; those of faces, voxels and shading vertices may be absent, and then mean the default written beside
/// them.
// clang-format off
#define FARFIELD_LEVEL_ARRAYS(ARRAY)                                                                                 \
  /* surface */                                                                                                      \
  ARRAY( 1, Positions,          positions,            vec3,              Vertices)      /* vertices */               \
  ARRAY( 2, Quads,              quads,                Quad,              Quads)         /* in Morton order */        \
  ARRAY( 3, QuadFirstFace,      quad_first_face,      uint32_t,          Quads)         /* face 0; face 1 follows */ \
  ARRAY( 4, FaceSggx,           face_sggx,            PackedSurfaceSggx, Faces)         /* normals; n n^T */         \
  ARRAY( 5, FaceDiffuse,        face_diffuse,         PackedColor,       Faces)         /* albedo; 0 */              \
  ARRAY( 6, FaceSpecular,       face_specular,        PackedColor,       Faces)         /* F0; 0 */                  \
  ARRAY( 7, FaceRoughness2,     face_roughness2,      uint8_t,           Faces)         /* unorm8 of alpha^2, with specular */ \
  ARRAY( 8, FaceTransmission,   face_transmission,    PackedColor,       Faces)         /* diffuse; 0 */             \
  /* volume */                                                                                                       \
  ARRAY( 9, BrickTable,         brick_table,          uint32_t,          BrickTable)    /* x fastest; or kNoBrick */ \
  ARRAY(10, Bricks,             bricks,               Brick,             Bricks)        /* in the table's order */   \
  ARRAY(11, VoxelSggx,          voxel_sggx,           PackedFlakeSggx,   Voxels)        /* flakes; identity */       \
  ARRAY(12, VoxelDiffuse,       voxel_diffuse,        PackedColor,       Voxels)        /* as for faces */           \
  ARRAY(13, VoxelSpecular,      voxel_specular,       PackedColor,       Voxels)                                     \
  ARRAY(14, VoxelRoughness2,    voxel_roughness2,     uint8_t,           Voxels)                                     \
  ARRAY(15, VoxelTransmission,  voxel_transmission,   PackedColor,       Voxels)                                     \
  ARRAY(16, VoxelSelfShadowing, voxel_self_shadowing, uint8_t,           Voxels)        /* unorm8 of A in (0, 1]; 1 */ \
  /* from the next finer stored level: where its vertices and faces are in this one, or kMorph... */                \
  ARRAY(17, MorphVertex,        morph_vertex,         uint32_t,          MorphVertices)                              \
  ARRAY(18, MorphFace,          morph_face,           uint32_t,          MorphFaces)                                 \
  /* what stops and emits light */                                                                                   \
  ARRAY(19, FaceOpacity,        face_opacity,         uint8_t,           Faces)         /* unorm8; 1 */              \
  ARRAY(20, FaceEmission,       face_emission,        PackedRadiance,    Faces)         /* both sides; 0 */          \
  ARRAY(21, VoxelEmission,      voxel_emission,       PackedRadiance,    Voxels)        /* of its flakes; 0 */       \
  /* level 0, for close-ups and hosts' materials */                                                                  \
  ARRAY(22, FaceMaterialId,     face_material,        uint16_t,          Faces)         /* of the manifest's; 0 */   \
  ARRAY(23, SourceFace,         source_face,          uint32_t,          Faces)         /* number, turn; unknown */   \
  ARRAY(24, CornerVertex,       corner_vertex,        uvec3,             Faces)         /* shading vertices */       \
  ARRAY(25, ShadingNormal,      shading_normal,       PackedNormal,      ShadingVertices) /* the face's own */       \
  ARRAY(26, ShadingUv,          shading_uv,           vec2,              ShadingVertices) /* v down; none */         \
  ARRAY(27, ShadingColor,       shading_color,        PackedVertexColor, ShadingVertices) /* white */                 \
  /* walls made of pieces */                                                                                          \
  ARRAY(28, FaceGap,            face_gap,             uint8_t,           Faces)         /* unorm8; 0 */               \
  /* shapes inside voxels */                                                                                          \
  ARRAY(29, VoxelOctants,       voxel_octants,        PackedOctants,     Voxels)        /* shares of density; full */ \
  /* media that scatter by themselves */                                                                              \
  ARRAY(30, VoxelAlbedo,        voxel_albedo,         PackedAlbedo,      Voxels)        /* of fog; the header's */   \
  ARRAY(31, VoxelAnisotropy,    voxel_anisotropy,     int8_t,            Voxels)        /* of all that a voxel of fog scatters; the header's, of what is scattered once */ \
  /* sheets with gaps */                                                                                              \
  ARRAY(32, FaceSheetShape,     face_sheet_shape,     PackedSheetShape,  Faces)         /* no sheet */ \
  /* level 0: what stands in many places. Quads before the first part's stand in the level's own space */              \
  ARRAY(33, PartFirstQuad,      part_first_quad,      uint32_t,          Parts)         /* each part ends at the next */ \
  ARRAY(34, Placements,         placements,           PartPlacement,         Placements)
// clang-format on

/// The arrays, owned (Array = std::vector<T>) while baking, or as spans into a file in memory at run time.
template <template <typename> class Array>
struct LevelArrays {
#define FARFIELD_FIELD(id, Name, field, Element, Group) Array<Element> field;
  FARFIELD_LEVEL_ARRAYS(FARFIELD_FIELD)
#undef FARFIELD_FIELD

  bool has_surface() const { return !quads.empty(); }
  bool has_volume() const { return !bricks.empty(); }
  bool has_parts() const { return !placements.empty(); }
  /// The quads that stand in the level's own space are those before this one.
  uint32_t own_quad_count() const {
    return static_cast<uint32_t>(part_first_quad.empty() ? quads.size() : part_first_quad.front());
  }
  /// The quad with the number prim_id among those of a part, or among those that stand in the level's own space
  /// (geom_id 0). Part p is geometry p + 1 of its scene (bvh/part_scenes.h).
  uint32_t quad_of(uint32_t geom_id, uint32_t prim_id) const {
    return geom_id == 0 ? prim_id : part_first_quad[geom_id - 1] + prim_id;
  }
  /// The quads of a part: from the first up to the second.
  std::array<uint32_t, 2> part_quads(uint32_t part) const {
    const bool is_last = part + 1 == part_first_quad.size();
    return {part_first_quad[part], is_last ? static_cast<uint32_t>(quads.size()) : part_first_quad[part + 1]};
  }
};

template <typename T>
using OwnedArray = std::vector<T>;
template <typename T>
using ArrayView = std::span<const T>;

/// Calls visit(brick, its coordinates in bricks) for the bricks of a level (LevelData or LevelView), in their order.
template <typename Level, typename Visit>
void for_each_brick(const Level& level, Visit&& visit) {
  for (size_t i = 0; i < level.brick_table.size(); ++i) {
    if (level.brick_table[i] != kNoBrick) {
      visit(level.bricks[level.brick_table[i]], brick_coordinates(level.header, i));
    }
  }
}

/// Number of faces of a level's surface.
template <template <typename> class Array>
uint32_t face_count(const LevelArrays<Array>& level) {
  if (level.quads.empty()) return 0;
  return level.quad_first_face.back() + (level.quads.back().is_pair() ? 2u : 1u);
}

/// Number of active voxels (stored payloads).
template <template <typename> class Array>
uint32_t voxel_count(const LevelArrays<Array>& level) {
  if (level.bricks.empty()) return 0;
  const Brick& last = level.bricks.back();
  return last.payload_base + last.prefix[7] + static_cast<uint32_t>(__builtin_popcountll(last.mask[7]));
}

/// A level in memory that owns its arrays: what the bake makes. A plain value.
struct LevelData : LevelArrays<OwnedArray> {
  LevelHeader header;
};

/// A level whose arrays lie elsewhere (a LevelFile, a LevelData): what rays read. Valid while its owner lives.
struct LevelView : LevelArrays<ArrayView> {
  LevelHeader header;
};
/// Level: owns its arrays, of whatever kind, and has a header.
template <typename Level>
LevelView view_of(const Level& level) {
  LevelView view;
  view.header = level.header;
#define FARFIELD_VIEW(id, Name, field, Element, Group) view.field = level.field;
  FARFIELD_LEVEL_ARRAYS(FARFIELD_VIEW)
#undef FARFIELD_VIEW
  return view;
}
LevelData copy_of(const LevelView& level);

/// What a level costs a host, as the manifest records it.
struct LevelCost {
  uint64_t resident_bytes = 0;    ///< file pages that stay, BVH, overheads
  uint64_t build_peak_bytes = 0;  ///< further bytes while it is loaded: pages that only the load reads, Embree's own
};

}  // namespace farfield
