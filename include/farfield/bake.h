// SPDX-License-Identifier: Apache-2.0
// The bake as a call: meshes or fog in the host's memory become a folder of levels, which Runtime::open_asset() opens.
//
//   farfield::BakeMesh mesh;
//   mesh.points = points;    // std::vector<glm::vec3>, or a pointer with a count and a stride
//   mesh.corners = corners;  // std::vector<uint32_t>: three per triangle
//   farfield::BakeInput input;
//   input.meshes = {mesh};
//   farfield::BakeSummary baked = farfield::bake_meshes(input, "oak.farfield").value();
//
// Link farfield::bake. Hosts that only render need neither it nor this header. docs/bake_api.md tells more.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "farfield/export.h"
#include "farfield/material.h"
#include "farfield/result.h"

namespace farfield {

/// `count` rows of N numbers that belong to the caller. Nothing is copied: they must stay as they are until the call
/// that reads them returns. The numbers may be of any arithmetic type (float and double for geometry, int32_t,
/// uint32_t, int64_t for indices) and need not be aligned.
template <int N>
class BakeRows {
 public:
  BakeRows() = default;
  /// The rows start `stride_bytes` apart; 0 is one row for all.
  template <typename T>
  BakeRows(const T* first, size_t count, size_t stride_bytes = N * sizeof(T))
      : first_(reinterpret_cast<const unsigned char*>(first)),
        count_(count),
        stride_bytes_(stride_bytes),
        read_(&read_number<T>) {}
  /// One row per element: of numbers where N is 1, else of glm's vectors.
  template <typename T>
  BakeRows(const std::vector<T>& numbers) : BakeRows(numbers.data(), numbers.size()) {
    static_assert(N == 1, "rows of several numbers: std::vector<glm::vec3>, or a pointer and a count of rows");
  }
  template <typename T>
  BakeRows(const std::vector<glm::vec<N, T>>& rows) : BakeRows(reinterpret_cast<const T*>(rows.data()), rows.size()) {}

  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  /// Number `column` of row `row`; both must be there.
  double at(size_t row, int column = 0) const { return read_(first_ + row * stride_bytes_, column); }

 private:
  template <typename T>
  static double read_number(const unsigned char* row, int column) {
    T value;
    std::memcpy(&value, row + static_cast<size_t>(column) * sizeof(T), sizeof(T));
    return static_cast<double>(value);
  }

  const unsigned char* first_ = nullptr;
  size_t count_ = 0;
  size_t stride_bytes_ = 0;
  double (*read_)(const unsigned char* row, int column) = nullptr;
};

/// What the rows of an attribute belong to.
enum class BakePer : uint8_t {
  Corner,  ///< one row for each entry of BakeMesh::corners
  Point,   ///< one row for each of BakeMesh::points
};

/// Something that varies over a mesh. No rows: the mesh does not have it.
template <int N>
struct BakeAttribute {
  BakeRows<N> values;
  BakePer per = BakePer::Corner;
};

/// Takes meshes for cages of subdivision surfaces: level 0 is their limit surface, with its own normals. Texture
/// coordinates and colours are smoothed with it; the cage's normals are ignored. Faces keep the cage's numbers.
/// [Catmull and Clark 1978] [Loop 1987], as OpenSubdiv has them. `error` and `detail` are for displaced faces, too
/// (BakeMaterial::height_texture), with or without a scheme.
struct BakeSubdivision {
  enum class Scheme : uint8_t {
    None,          ///< the polygons are the surface
    CatmullClark,  ///< any polygons; made for quads
    Loop,          ///< triangles only
  };
  enum class Boundary : uint8_t {
    EdgeAndCorner,  ///< rims follow their edges; points of one face stay where they are
    EdgeOnly,       ///< corners of rims are rounded, too
  };
  enum class Uv : uint8_t { None, CornersOnly, CornersPlus1, CornersPlus2, Boundaries, All };

  Scheme scheme = Scheme::None;  ///< of meshes that do not say their own
  Boundary boundary = Boundary::EdgeAndCorner;
  Uv uv = Uv::CornersPlus1;  ///< where texture coordinates stay linear: OpenSubdiv's and USD's rules
  double error = 0.125;      ///< how far faces may lie from the surface, > 0, in voxels of level 0 (half of
                             ///< level 1's)
  double edge = 0;           ///< the longest that sides of faces may be, in such voxels; 0: what `error` gives
  double detail = 1;         ///< in such voxels: heights of displacement are means over this much; > 0
};

/// Polygons. All numbers must be finite. Winding does not matter: surfaces are two-sided.
struct BakeMesh {
  std::string name;       ///< for messages; may be empty
  BakeRows<3> points;     ///< any unit; kept in double precision until they are relative to the asset's own origin
  BakeRows<1> corners;    ///< face after face: the point of each corner, < points.size()
  BakeRows<1> counts;     ///< corners of each face, >= 3; they add up to corners.size(). None: all faces are triangles
  BakeRows<1> materials;  ///< each face's material id, below 2^16. None: 0. What ids mean: BakeInput
  BakeAttribute<2> uv;    ///< texture coordinates; v points down the image: (0, 0) is its upper left corner
  BakeAttribute<3> normals;                       ///< for shading, any length; a normal of length 0 is the face's own
  BakeAttribute<4> colors;                        ///< linear RGBA; multiply the material's base colour and alpha
  std::optional<BakeSubdivision::Scheme> scheme;  ///< of this mesh; none: BakeSettings::subdivision has it
  // Of a cage (BakeSubdivision) only:
  BakeRows<2> creases;           ///< the two points of each edge that is to stay sharp; a face must have that edge
  BakeRows<1> crease_sharpness;  ///< one for each: >= 0, 0 is smooth, 10 and more (also infinite) sharp for ever
  BakeRows<1> sharp_points;      ///< points that are to stay sharp
  BakeRows<1> point_sharpness;   ///< one for each, as of creases
};

/// A place of a mesh in the asset. The asset holds all of them as one thing.
struct BakeInstance {
  uint32_t mesh = 0;           ///< index into BakeInput::meshes
  glm::dmat4x3 to_asset{1.0};  ///< as Runtime::add_instance has it; finite, invertible. Of a glm::dmat4: dmat4x3(m)
};

/// An image: a file, or pixels in memory. Neither: there is no image.
struct BakeTexture {
  enum class Wrap : uint8_t { Repeat, Clamp, Mirror };

  std::string file;    ///< in any format that OpenImageIO reads; 8-bit colours are sRGB
  BakeRows<4> pixels;  ///< width * height rows from the upper left corner on: linear RGBA in [0, 1], straight alpha
  int width = 0, height = 0;                          ///< of `pixels`, up to 2^15 each
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;  ///< how it continues outside [0, 1]^2

  explicit operator bool() const { return !file.empty() || !pixels.empty(); }
};

/// A material of glTF's metallic-roughness model. Colours are linear RGB in [0, 1], factors in [0, 1], where nothing
/// else is said.
struct BakeMaterial {
  enum class Alpha : uint8_t {
    Opaque,  ///< alpha is ignored
    Mask,    ///< there where alpha >= alpha_cutoff, not there elsewhere
    Blend,   ///< alpha is the share of the light that meets the surface
  };

  std::string name;  ///< for messages; may be empty
  glm::vec3 base_color{0.8f};
  float alpha = 1;
  Alpha alpha_mode = Alpha::Opaque;
  float alpha_cutoff = 0.5f;
  float metallic = 0;
  float roughness = 1;
  glm::vec3 specular_f0{0.0f};     ///< reflectance at normal incidence of what is not metal; glTF's default is 0.04
  float diffuse_transmission = 0;  ///< share of the diffuse light that goes through, as in leaves
  glm::vec3 diffuse_transmission_color{1.0f};
  float thin_transmission = 0;     ///< share of the light that goes straight through, as in panes
  glm::vec3 emission{0.0f};        ///< radiance, >= 0, may exceed 1
  float normal_scale = 1;          ///< multiplies x and y of the normals of normal_texture; any finite number
  BakeTexture base_color_texture;  ///< RGB multiplies base_color, A alpha
  BakeTexture roughness_texture;   ///< glTF's metallic-roughness: G multiplies roughness, B metallic
  BakeTexture alpha_texture;       ///< its alpha, or its first channel if it has none, multiplies alpha
  BakeTexture normal_texture;      ///< tangent space, +y up the image: (r, g, b) stands for 2 (r, g, b) - 1
  BakeTexture emission_texture;    ///< RGB multiplies emission
  /// Displacement: the surface lies (height_base + height_gain * R) above the mesh, along its normals, in the mesh's
  /// units (instances scale it). Files as stored, no sRGB; pixels of any finite value. Faces need uv.
  BakeTexture height_texture;
  float height_gain = 1, height_base = 0;  ///< finite
};

/// All that becomes one asset.
struct BakeInput {
  std::string name = "memory";  ///< what the asset says of its source
  std::vector<BakeMesh> meshes;
  std::vector<BakeInstance> instances;  ///< none: every mesh once, where its points are
  /// By material id. Without a material_function all ids that faces carry must be here; no materials at all: faces are
  /// grey.
  std::vector<BakeMaterial> materials;
  /// The host's own materials: if set, `materials` give names only, and need not be complete. Called from many threads
  /// at once. Faces are numbered on from mesh to mesh, in the order of the instances. The same function goes to
  /// Runtime::open_asset(), unless the host shades level 0 by itself (docs/materials.md).
  MaterialFunction material_function;
  /// In place of material_function: asked for many places at once, up to some ten thousand.
  MaterialBatchFunction material_batch_function;
  /// Stands for the answers of material_function: a bake of the same input under the same key is taken as the same.
  /// Empty: whether there is something to do cannot be told, so every call bakes.
  std::string material_key;
};

/// Fog in the host's memory: a box of voxels. It becomes an asset of its own.
struct BakeVolume {
  std::string name = "memory";  ///< what the asset says of its source
  uint32_t width = 0, height = 0, depth = 0;
  BakeRows<1> density;  ///< width * height * depth, x fastest, then y, then z: finite, >= 0; at least one above 0
  BakeRows<3> albedo;   ///< the same of linear RGB in [0, 1], single scattering. None: BakeFog::albedo
  /// The same of matrices S of SGGX, xx, yy, zz, xy, xz, yz along the asset's axes: sigma_t(w) = density sqrt(w^T S w).
  /// All 0: alike from all sides. None, or:
  BakeRows<6> sggx;
  /// The same of directions of fibres along the asset's axes, of any length: the density is what is stopped across them
  /// (BakeFog::fibre_roughness). 0: alike from all sides. One of these two at most.
  BakeRows<3> fibre;
  BakeRows<1> anisotropy;      ///< g of each voxel, from -0.98 to 0.98. None: BakeFog::anisotropy
  BakeRows<1> self_shadowing;  ///< share, in [0, 1] (below 1/255 it is that), of scattered light that leaves a voxel
                               ///< at once; not together with `anisotropy`. None: 1
  /// Voxel (i, j, k) is where this puts the cube [i, i + 1] x [j, j + 1] x [k, k + 1]: any affine map. Where
  /// that is no cube, the fog is resampled onto cubes of the shortest edge, and a warning says so.
  glm::dmat4x3 to_asset{1.0};
};

/// What a volume does not say itself.
struct BakeFog {
  std::string density_grid;         ///< of an OpenVDB file: the grid's name; empty: "density", or its only fog volume
  double density_scale = 1;         ///< density 1 is this attenuation coefficient, in 1 / unit of the asset; > 0
  std::optional<glm::vec3> albedo;  ///< single scattering, linear RGB in [0, 1]; none: the volume's own, or 0.99
  double anisotropy = 0;            ///< mean cosine of scattering, -0.98 to 0.98 (Henyey-Greenstein)
  bool level_set = false;           ///< of an OpenVDB file: take a level set for the fog inside it; else it is refused
  double fibre_roughness = 0.1;     ///< what a fibre stops along itself by what it stops across; in [0, 1]
};

/// How levels of a volume are made (docs/decisions/0026).
enum class BakeDownsampling : uint8_t { Linear, Transp, Iso, Aniso, Matched };

/// What collapses on coarser levels of meshes (docs/decisions/0034): face loops in connected parts of well-structured
/// quads and edges elsewhere; loops wherever there are quads; edges alone.
enum class BakeSimplify : uint8_t { Auto, Loops, Edges };

struct BakeSettings {
  uint32_t finest_grid = 512;     ///< voxels along the longest side of level 1: a power of two, up to 4096
  uint32_t coarsest_grid = 8;     ///< the same of the last level, the root; <= finest_grid
  uint32_t rays_per_voxel = 200;  ///< that measure each voxel's occlusion, >= 1
  bool source_only = false;       ///< level 0 only: the source, ready to render
  BakeSubdivision subdivision;
  BakeSimplify simplify = BakeSimplify::Auto;
  BakeFog fog;  ///< of volumes alone; their grids are their own: finest_grid is not looked at
  BakeDownsampling downsampling = BakeDownsampling::Matched;
  int threads = 0;                  ///< 0: as many as the machine has
  uint64_t memory_limit_bytes = 0;  ///< what the process may grow by meanwhile, as `ps` shows it; 0: no limit
  /// How far the bake is, in [0, 1], and what it does. Called now and then, from any thread, one call at a time. Must
  /// not throw.
  std::function<void(double done, const std::string& stage)> progress;
  const std::atomic<bool>* cancel = nullptr;  ///< once true, the bake ends with ErrorCode::Cancelled
};

/// One stored level of a baked asset, finest first.
struct BakedLevel {
  uint32_t level = 0;     ///< k; 0 is the source
  uint32_t grid = 0;      ///< voxels along the longest side
  double resolution = 0;  ///< size of a voxel, in the input's units
  uint64_t triangles = 0, voxels = 0;
  uint64_t file_bytes = 0;
  uint64_t resident_bytes = 0;  ///< once loaded for rays
};

struct BakeSummary {
  std::vector<BakedLevel> levels;
  std::vector<std::string> warnings;  ///< one line each: what was ignored, dropped or degraded
  double seconds = 0;
  bool is_up_to_date = false;  ///< the folder already held exactly this bake; nothing was done
};

/// Bakes `input` into `folder` (made; conventionally NAME.farfield). The same input and settings give the same bytes
/// for any number of threads. An asset that is there is replaced in one step at the end; a bake that was interrupted
/// goes on where it stopped. `memory_limit_bytes` is looked at a hundred times a second: it ends a bake that needs
/// more, and does not make one need less. Errors: InvalidArgument (the input: counts, indices, numbers, names mesh and
/// element; the settings; a folder that holds other things), NotFound, BadFile, Unsupported (a texture; an extent
/// outside [1e-6, 1e9]; a cage with more than 2048 faces around a point or corners of a face), OutOfBudget (the memory
/// limit), Io, Cancelled. Any thread, one call at a time in a process.
FARFIELD_API Result<BakeSummary> bake_meshes(const BakeInput& input, const std::string& folder,
                                             const BakeSettings& settings = {});

/// The same for a volume. Its densities are copied, 2 KiB for each 8^3 voxels that hold any. Errors: those that are not
/// of meshes and textures; InvalidArgument names the voxel.
FARFIELD_API Result<BakeSummary> bake_volume(const BakeVolume& volume, const std::string& folder,
                                             const BakeSettings& settings = {});

/// The same for a file: OBJ with MTL, PLY, glTF or glb, gzipped or not; or an OpenVDB volume (.vdb), of which
/// `settings.fog` says the rest. mesh: of glTF this one alone, in its own space; -1: all nodes of the scene. Errors:
/// also those of reading it.
FARFIELD_API Result<BakeSummary> bake_file(const std::string& source, const std::string& folder,
                                           const BakeSettings& settings = {}, int mesh = -1);

}  // namespace farfield
