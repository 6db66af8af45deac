// SPDX-License-Identifier: Apache-2.0
// A glTF file as a scene: which mesh stands where, what looks at it, what lights it. No mesh data is read here;
// import_asset(path, {.mesh = i}) reads mesh i in its own space.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "farfield/instance_data.h"
#include "import/fog_options.h"
#include "import/mesh_tile.h"
#include "import/subdivision_options.h"

namespace farfield {

/// Which nodes are one asset together with all below them: docs/scene_format.md, "What becomes one asset".
enum class AssemblyRule : uint8_t {
  None,      ///< each mesh is an asset of its own
  Marked,    ///< those whose extras say "farfield_asset": true
  Repeated,  ///< those, and things of several meshes that the scene repeats
};
/// "none", "marked", "repeated".
const char* name_of(AssemblyRule rule);
/// Errors: InvalidArgument, with the names that there are.
Result<AssemblyRule> parse_assembly_rule(const std::string& name);

/// What is baked as one asset: a mesh, an assembly of several, or a file that a node names: a volume or a mesh.
struct GltfMesh {
  std::string name;        ///< as in the file, of an assembly its node's; may be empty or repeated
  std::string asset_name;  ///< unique in the file, fit for a file name: what its baked asset is called
  int32_t node = -1;       ///< of the file: an assembly of all that this node and those below show; -1: a mesh
  Box3 bounds;  ///< mesh space (the node's own), from the accessors' min and max (quantised ones decoded); may be empty
  uint64_t triangle_count = 0;              ///< as the accessors promise it; 0 means that there is no mesh to bake
  std::string volume;                       ///< OpenVDB file, relative to the scene's folder; empty: no volume
  FogOptions fog;                           ///< of that file
  std::string model;                        ///< OBJ or PLY file, relative to the scene's folder; empty: none
  std::optional<SubdivisionScheme> scheme;  ///< of that file; none: as the caller asks
  MeshTile tile;                            ///< which part of mesh number `whole` it is
  uint32_t whole = 0;                       ///< of a tile: index into GltfScene::meshes

  bool is_empty() const { return triangle_count == 0 && volume.empty(); }
};

/// One place where a node shows a mesh.
struct GltfInstance {
  uint32_t mesh = 0;   ///< index into GltfScene::meshes
  mat4x3 to_world{1};  ///< mesh space to world; may scale, mirror and shear; always finite and invertible
  std::string name;    ///< of the node
  uint32_t node = 0;   ///< index into GltfScene::nodes
  InstanceData data;   ///< what the file says of it for the host
};

/// A camera where it stands at some time. It looks along `forward`; right, up and forward are orthonormal (the node's
/// scale is ignored, as glTF asks).
struct GltfCamera {
  std::string name;
  vec3 position{0.0f};
  vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};
  bool is_orthographic = false;
  float yfov_rad = 0.8f;                  ///< full vertical angle of a perspective camera
  float aspect = 0;                       ///< width / height; 0: the file does not say, the image's shape decides
  float half_width = 1, half_height = 1;  ///< of an orthographic view, scene units
  float z_near = 0;                       ///< scene units along forward
  uint32_t node = 0;                      ///< index into GltfScene::nodes
};

/// A light of KHR_lights_punctual where it stands at time 0. `color * intensity` is the file's photometric value:
/// lux for directional lights, candela for point and spot lights.
struct GltfLight {
  enum class Type { Directional, Point, Spot };
  Type type = Type::Directional;
  std::string name;
  vec3 color{1.0f};  ///< linear
  float intensity = 1;
  vec3 position{0.0f};
  vec3 direction{0, 0, -1};  ///< unit, the way that the light travels
  float inner_cone_rad = 0, outer_cone_rad = kPi / 4;
  uint32_t node = 0;  ///< index into GltfScene::nodes
};

/// Keys of one animated property of one node.
struct GltfChannel {
  enum class Path { Translation, Rotation, Scale };
  enum class Interpolation { Linear, Step, CubicSpline };
  Path path;
  Interpolation interpolation;
  std::vector<float> times;  ///< seconds, increasing
  std::vector<vec4> values;  ///< one per key (xyz, or the quaternion xyzw); three for CubicSpline: in, value, out
};

/// A node's own transform: translation * rotation * scale, or the matrix when the file gives one.
struct GltfNode {
  int32_t parent = -1;  ///< always stands before its children in GltfScene::nodes, or -1
  dvec3 translation{0.0}, scale{1.0};
  glm::dvec4 rotation{0, 0, 0, 1};  ///< unit quaternion xyzw
  glm::dmat4 matrix{1.0};
  bool has_matrix = false;
  std::vector<uint32_t> channels;  ///< indices into GltfScene::channels
};

/// Immutable once read; thread-safe. "World" is the file's, less `origin_world`.
struct GltfScene {
  /// Subtracted from all that stands in the world, in double precision: map coordinates leave a float no digits. The
  /// middle of the scene if that lies far from 0 for its size, else 0.
  dvec3 origin_world{0.0};
  /// All meshes of the file under their numbers, instanced or not, then assemblies, then files of nodes, then tiles of
  /// any of these. Of equal ones only the first is instanced; what is cut into tiles is not.
  std::vector<GltfMesh> meshes;
  /// Of the default scene, in the order of a depth-first walk: all that are to be seen at some time, where they stand
  /// at time 0 or, if their transform is singular then (a plant that grows from nothing), as soon as it is not.
  std::vector<GltfInstance> instances;
  /// Per instance mesh space to the node's space: EXT_mesh_gpu_instancing shows a mesh many times in one node. Empty if
  /// no instance moves: a million of them take as much as many an asset.
  std::vector<mat4x3> in_node;
  std::vector<GltfCamera> cameras;  ///< of the default scene, at time 0
  std::vector<GltfLight> lights;    ///< of the default scene
  std::vector<GltfNode> nodes;      ///< of the default scene, flattened, parents first
  std::vector<GltfChannel> channels;
  double start_seconds = 0, end_seconds = 0;  ///< first and last key of all animation; both 0 when nothing moves
  double frames_per_second = 24;              ///< of the keys where they are evenly spaced at a usual rate, else 24
  std::vector<std::string> warnings;          ///< one line each

  /// Camera `index` (< cameras.size()) at a time; times outside the animation's range hold its first or last key.
  GltfCamera camera_at(size_t index, double seconds) const;
  /// Whether any instance is animated. If not, `instances` is what instances_at() gives for every time.
  bool do_instances_move() const;
  /// All instances at a time. An instance whose transform is singular then is left out.
  std::vector<GltfInstance> instances_at(double seconds) const;
  /// The same into `placed`. Takes no memory where both have room from an earlier time; `of_nodes`: to work in.
  void place_at(double seconds, std::vector<GltfInstance>& placed, std::vector<glm::dmat4>& of_nodes) const;
  /// Frame n shows the time n / frames_per_second; frame 0 is time 0, as Blender exports it.
  double seconds_of_frame(double frame) const { return frame / frames_per_second; }
  /// World bounds of the instances where `instances` has them, from GltfMesh::bounds. Empty when there are none.
  Box3 bounds_world() const;
};

/// Reads the default scene (the first, if none is marked) of a .glb or .gltf, gzipped or not.
/// Errors: NotFound, Io, BadFile (with node cycles, indices out of range), Unsupported (required extensions that this
/// version does not know, by name).
Result<GltfScene> read_gltf_scene(const std::filesystem::path& path, AssemblyRule assemblies = AssemblyRule::Repeated);

}  // namespace farfield
