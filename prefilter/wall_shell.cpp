// SPDX-License-Identifier: Apache-2.0
// The boundary of the voxels that the wall touches, shrunk onto it. Voxels close gaps that are narrower than they are.
#include "prefilter/wall_shell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/split_mix.h"
#include "prefilter/material_filter.h"
#include "prefilter/random_lobe.h"
#include "prefilter/ray_scene.h"
#include "prefilter/triangle_pieces.h"
#include "prefilter/voxel_marks.h"
#include "prefilter/wall_pieces.h"

namespace farfield {
namespace {

constexpr double kCell = 0.25;  ///< of the resolution: voxels, and the widest gap that is closed for sure
constexpr uint32_t kRaysPerFace = 4;
constexpr float kLeastCosine = 0.15f;  ///< rays that are flatter are cast at this angle
constexpr float kLeastGap = 0.03f;     ///< share of rays through the wall below which it counts as tight

/// Which voxels a set holds.
class VoxelLookup {
 public:
  explicit VoxelLookup(const VoxelSet& set) {
    for (size_t i = 0; i < set.coordinates.size(); ++i) mask_of_[cell_key(set.coordinates[i])] = &set.masks[i];
  }
  bool contains(const ivec3& v) const {
    const auto found = mask_of_.find(cell_key({v.x >> 3, v.y >> 3, v.z >> 3}));
    return found != mask_of_.end() && is_set(*found->second, (v.x & 7) + 8 * (v.y & 7) + 64 * (v.z & 7));
  }

 private:
  std::unordered_map<uint64_t, const VoxelMask*> mask_of_;
};

/// The faces between voxels of a set and others, wound so that normals point out of the set.
class Boundary {
 public:
  explicit Boundary(const VoxelSet& set) {
    const VoxelLookup lookup(set);
    for (size_t b = 0; b < set.coordinates.size(); ++b) {
      for (int i = 0; i < kBrickVoxels; ++i) {
        if (!is_set(set.masks[b], i)) continue;
        const ivec3 voxel = voxel_of_brick(set.coordinates[b], i);
        for (int axis = 0; axis < 3; ++axis) {
          for (const int side : {0, 1}) {
            ivec3 neighbour = voxel;
            neighbour[axis] += side ? 1 : -1;
            if (!lookup.contains(neighbour)) add_quad(voxel, axis, side);
          }
        }
      }
    }
  }

  std::vector<ivec3> corners;  ///< of voxels
  std::vector<uvec3> triangles;

 private:
  void add_quad(const ivec3& voxel, int axis, int side) {
    ivec3 u(0), v(0), at = voxel;
    u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
    at[axis] += side;
    if (!side) std::swap(u, v);
    const uint32_t a = vertex(at), b = vertex(at + u), c = vertex(at + u + v), d = vertex(at + v);
    triangles.emplace_back(a, b, c);
    triangles.emplace_back(a, c, d);
  }
  uint32_t vertex(const ivec3& corner) {
    const auto [place, is_new] = vertex_of_.try_emplace(cell_key(corner), static_cast<uint32_t>(corners.size()));
    if (is_new) corners.push_back(corner);
    return place->second;
  }
  std::unordered_map<uint64_t, uint32_t> vertex_of_;
};

/// What rays from outside see of the wall.
struct Seen {
  FaceMaterial sum;
  float rays = 0, hits = 0, escaped = 0;
};

/// The same spread of normals, but around this one. Steps of a tight wall that rise towards one side are many and their
/// edges few, but all together they catch as much light as the plane through them: their main direction would be too
/// bright. (Of a loose wall they do not: light falls in between.)
SymMat3 around(const vec3& normal, const SymMat3& sggx) {
  const float along = sggx.quadratic(normal), aside = 0.5f * (sggx.trace() - along);
  return SymMat3::outer(normal) * (along - aside) + SymMat3::identity() * aside;
}

void turn_normals_to(const vec3& normal, FaceMaterial& m) {
  m.sggx = around(normal, m.sggx);
  if (m.shading_sggx.trace() > 0) m.shading_sggx = around(normal, m.shading_sggx);
}

/// The mean of what was seen, without the light that stays between the pieces.
FaceMaterial mean_of(const Seen& seen, float usual_escape) {
  FaceMaterial m = mix(seen.sum, 1 / seen.hits, seen.sum, 0.0f);
  m.opacity = 1;
  const vec3 kept = kept_light(m, 1 - seen.escaped / seen.hits, usual_escape);
  m.diffuse *= kept;
  m.specular *= kept;
  m.transmission *= kept;
  return m;
}

/// Looks at the wall from faces around it.
class WallViewer {
 public:
  WallViewer(const OpacityScene& wall, double resolution)
      : pieces_(wall, resolution), resolution_(static_cast<float>(resolution)) {}

  Seen look_at(const TrianglePiece& face, const vec3& outwards, uint64_t seed) const {
    Seen seen;
    seen.sum = no_material();
    SplitMix random(seed);
    for (uint32_t i = 0; i < kRaysPerFace; ++i) look(face, outwards, random, seen);
    return seen;
  }

 private:
  void look(const TrianglePiece& face, const vec3& outwards, SplitMix& random, Seen& seen) const {
    const auto u = static_cast<float>(random.next_unit()), v = static_cast<float>(random.next_unit());
    const vec3 at = point_on(face, u, v);
    const vec3 away = random_lobe(outwards, random);
    const float start = 0.5f * resolution_ / std::max(glm::dot(away, outwards), kLeastCosine);
    seen.rays += 1;
    const vec3 origin = at + start * away;
    const auto look = pieces_.look(origin, -away, 3 * start, random);
    if (!look) return;
    seen.hits += 1;
    seen.sum = mix(seen.sum, 1, *look->material, 1);
    if (look->escapes) seen.escaped += 1;
  }

  PieceViewer pieces_;
  float resolution_;
};

/// The boundary of the wall's voxels with its vertices on the wall. Faces of no area are left out, and the back where
/// it lies on the front: sheets without thickness stay single.
class Shell {
 public:
  Shell(const Surface& wall, const VoxelLattice& lattice) {
    const Boundary boundary(mark_voxels(wall, lattice));
    const NearestPoint nearest(wall, lattice.origin, lattice.voxel_size);
    std::vector<dvec3> on_wall(boundary.corners.size());
    parallel_for(on_wall.size(), 256, [&](size_t begin, size_t end) {
      for (size_t v = begin; v < end; ++v) on_wall[v] = nearest.to(dvec3(boundary.corners[v]));
    });
    surface.origin = wall.origin;
    std::vector<uint32_t> vertex_of;
    for (const dvec3& p : on_wall) vertex_of.push_back(vertex_at(p, lattice));
    for (const uvec3& t : boundary.triangles) {
      add_face({vertex_of[t.x], vertex_of[t.y], vertex_of[t.z]}, dvec3(boundary.corners[t.y] - boundary.corners[t.x]),
               dvec3(boundary.corners[t.z] - boundary.corners[t.x]));
    }
  }

  Surface surface;             ///< without materials
  std::vector<vec3> outwards;  ///< unit, per face

 private:
  /// Vertices closer than this part of a voxel are one. The odd shift keeps rounding from telling apart what lies in a
  /// plane of the lattice.
  static constexpr double kSame = 1e-3, kShift = 0.37;

  uint32_t vertex_at(const dvec3& in_voxels, const VoxelLattice& lattice) {
    const glm::i64vec3 cell(glm::floor(in_voxels / kSame + kShift));
    const auto number = static_cast<uint32_t>(surface.positions.size());
    const auto [place, is_new] = vertex_of_.try_emplace(std::array<int64_t, 3>{cell.x, cell.y, cell.z}, number);
    if (is_new) surface.positions.emplace_back(lattice.origin + in_voxels * lattice.voxel_size);
    return place->second;
  }

  void add_face(const uvec3& t, const dvec3& edge1, const dvec3& edge2) {
    std::array<uint32_t, 3> key = {t.x, t.y, t.z};
    std::ranges::sort(key);
    if (key[0] == key[1] || key[1] == key[2] || !faces_.insert(key).second) return;
    surface.triangles.push_back(t);
    const dvec3 before = glm::cross(edge1, edge2),
                normal = area_vector_of(corners_of(surface, surface.triangles.size() - 1));
    outwards.emplace_back(glm::normalize(glm::dot(normal, before) > 0 ? normal : before));
  }

  std::map<std::array<int64_t, 3>, uint32_t> vertex_of_;
  std::set<std::array<uint32_t, 3>> faces_;
};

}  // namespace

Result<Surface> wrap_wall(const Surface& wall, double resolution) {
  const Shell shell(wall, {dvec3(wall.bounds().lower), kCell * resolution});
  const Surface pieces = in_pieces(wall, resolution);
  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(pieces));
  const WallViewer viewer(scene, resolution);
  std::vector<Seen> seen(shell.surface.triangles.size());
  parallel_for(seen.size(), 256, [&](size_t begin, size_t end) {
    for (size_t f = begin; f < end; ++f) {
      seen[f] = viewer.look_at(corners_of(shell.surface, f), shell.outwards[f], mix64(f));
    }
  });

  Seen all;
  all.sum = no_material();
  for (const Seen& s : seen) {
    all.sum = mix(all.sum, 1, s.sum, 1);
    all.rays += s.rays, all.hits += s.hits, all.escaped += s.escaped;
  }
  if (!(all.hits > 0)) return Surface{};
  const bool is_tight = all.hits > (1 - kLeastGap) * all.rays;
  Surface result = shell.surface;
  for (size_t f = 0; f < seen.size(); ++f) {
    const Seen& own = seen[f].hits > 0 ? seen[f] : all;
    FaceMaterial m = mean_of(own, all.escaped / all.hits);
    if (is_tight) {
      turn_normals_to(shell.outwards[f], m);
    } else {
      m.gap = 1 - seen[f].hits / seen[f].rays;
    }
    result.materials.push_back(m);
  }
  return result;
}

}  // namespace farfield
