// SPDX-License-Identifier: Apache-2.0
// What a caller says of a mesh that is a subdivision cage, and what files say of one themselves.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/vec.h"

namespace farfield {

enum class SubdivisionScheme : uint8_t {
  None,          ///< the polygons are the surface, but for what displacement maps make of it
  CatmullClark,  ///< any polygons; made for quads
  Loop,          ///< triangles only
};

/// What becomes of the rim of an open cage.
enum class CageBoundary : uint8_t {
  EdgeAndCorner,  ///< it follows the rim's edges; vertices of one face stay where they are
  EdgeOnly,       ///< corners are rounded, too
};

/// Where texture coordinates stay linear instead of following the surface's own smoothing: OpenSubdiv's rules.
enum class CageUv : uint8_t { None, CornersOnly, CornersPlus1, CornersPlus2, Boundaries, All };

/// How creases of different sharpness get blunt along their way.
enum class CageCreasing : uint8_t { Uniform, Chaikin };

/// Sharpness from which on a crease or vertex stays sharp for ever (OpenSubdiv's; larger ones mean the same).
inline constexpr float kInfiniteSharpness = 10;

/// What a mesh says of itself as a cage; it counts only where subdivision is asked for.
struct CageTags {
  std::vector<glm::uvec2> crease_edges;  ///< pairs of indices into the mesh's positions
  std::vector<float> crease_sharpness;   ///< one per edge: >= 0, infinite allowed; 0 is smooth
  std::vector<uint32_t> sharp_vertices;  ///< indices into the mesh's positions
  std::vector<float> vertex_sharpness;   ///< one per sharp vertex, as of edges
  std::vector<uint32_t> holes;           ///< faces that shape their neighbours and are not there themselves
  std::optional<CageBoundary> boundary;  ///< none: not said
  std::optional<CageUv> uv;              ///< none: not said
  CageCreasing creasing = CageCreasing::Uniform;

  bool empty() const { return crease_edges.empty() && sharp_vertices.empty() && holes.empty(); }
};

/// How cages and displaced faces are cut. Lengths are in voxels of level 0, r_0: the longest side of the cage over
/// `grid`.
struct SubdivisionOptions {
  SubdivisionScheme scheme = SubdivisionScheme::None;
  std::optional<CageBoundary> boundary{};  ///< none: the file's own, or EdgeAndCorner
  std::optional<CageUv> uv{};              ///< none: the file's own, or CornersPlus1
  double error = 0.125;  ///< how far faces may lie from the surface, > 0: a pixel, seen eight times nearer
  double edge = 0;       ///< the longest that the sides of faces may be (diagonals are longer); 0: what `error` gives
  bool displace = true;  ///< by the mesh's displacement maps
  double detail = 1;     ///< heights are means over this much, and sides are cut no shorter for their sake; > 0
  uint32_t grid = 1024;  ///< set by the bake: twice its finest grid
  uint64_t most_faces = 10'000'000;  ///< beyond it `error` and `edge` grow, with a warning
};

/// Errors: InvalidArgument, by the name of the flag.
Result<void> check_options(const SubdivisionOptions& options);

/// Equal texts mean equal faces from equal meshes. Empty where all is as usual and there is no scheme.
std::string canonical_text(const SubdivisionOptions& options);

/// A number for what the options mean of a file, whatever grid it is baked to; 0 where all is as usual.
uint64_t hash_of(const SubdivisionOptions& options);

/// Names as flags have them. Errors: InvalidArgument, with the names that there are.
const char* name_of(SubdivisionScheme scheme);
const char* name_of(CageBoundary boundary);
const char* name_of(CageUv uv);
Result<SubdivisionScheme> parse_subdivision_scheme(const std::string& name);
Result<std::optional<CageBoundary>> parse_cage_boundary(const std::string& name);
Result<std::optional<CageUv>> parse_cage_uv(const std::string& name);

}  // namespace farfield
