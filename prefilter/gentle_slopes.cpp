// SPDX-License-Identifier: Apache-2.0
#include "prefilter/gentle_slopes.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "prefilter/surface_patches.h"

namespace farfield {
namespace {

/// One look around serves the faces around a point within this fraction of the resolution. Larger patches are fewer,
/// but must be smooth farther out.
constexpr double kPatchRadius = 0.5;

/// Cosine of the angle between a normal and the axis: slopes are below 1 at 45 degrees.
constexpr double kLeastCosine = 0.75;

/// Faces that one look around may visit.
constexpr size_t kMostFaces = size_t{1} << 18;

std::vector<vec3> face_normals(const Surface& surface) {
  std::vector<vec3> normals(surface.triangles.size());
  for (uint32_t face = 0; face < normals.size(); ++face) {
    const dvec3 a = corner_position(surface, face, 0);
    normals[face] = vec3(glm::cross(corner_position(surface, face, 1) - a, corner_position(surface, face, 2) - a));
  }
  return normals;
}

/// Looks around faces. Keeps its scratch memory between calls; one thread at a time.
class SlopeExplorer {
 public:
  SlopeExplorer(const Surface& surface, const EdgeTable& edges, const std::vector<vec3>& normals, double radius)
      : surface_(surface), edges_(edges), normals_(normals), radius2_(radius * radius), visits_(normals.size()) {}

  /// Whether all that is connected to the face within the radius around it is gentle.
  bool is_gentle_around(uint32_t seed) {
    center_ = evaluation_point(surface_, seed);
    ++round_;
    reached_.clear();
    reach(seed, false);
    dvec3 sum(0.0);
    for (size_t i = 0; i < reached_.size(); ++i) {
      const dvec3 normal = turned_normal(reached_[i]);
      if (!(glm::dot(normal, dvec3(normals_[seed])) > 0)) return false;  // no axis is near to both
      sum += normal;
      if (reached_.size() > kMostFaces || !reach_neighbours(reached_[i])) return false;
    }
    const dvec3 axis = glm::normalize(sum);
    return std::ranges::all_of(reached_, [&](uint32_t face) {
      const dvec3 normal = turned_normal(face);
      return glm::dot(normal, axis) >= kLeastCosine * glm::length(normal);
    });
  }

 private:
  struct Visit {
    uint32_t round = 0;      ///< in which the face was last reached
    bool is_turned = false;  ///< against the seed, as winding goes
  };

  dvec3 turned_normal(uint32_t face) const {
    return visits_[face].is_turned ? -dvec3(normals_[face]) : dvec3(normals_[face]);
  }

  /// False if it has been reached from its other side.
  bool reach(uint32_t face, bool is_turned) {
    Visit& visit = visits_[face];
    if (visit.round == round_) return visit.is_turned == is_turned;
    visit = {round_, is_turned};
    reached_.push_back(face);
    return true;
  }

  /// Through edges that touch the ball. False at borders and where more than two faces meet.
  bool reach_neighbours(uint32_t face) {
    std::array<dvec3, 3> from_center;
    for (int c = 0; c < 3; ++c) from_center[static_cast<size_t>(c)] = corner_position(surface_, face, c) - center_;
    for (int c = 0; c < 3; ++c) {
      if (!touches_ball(from_center[static_cast<size_t>(c)], from_center[static_cast<size_t>(next_corner(c))]))
        continue;
      const uint32_t edge = edges_.face_edges[face][c];
      const auto faces = edges_.faces_of(edge);
      if (faces.size() != 2) return false;
      const uint32_t other = faces[0] == face ? faces[1] : faces[0];
      const bool turns = runs_forward(face, edge) == runs_forward(other, edge);
      if (!reach(other, visits_[face].is_turned != turns)) return false;
    }
    return true;
  }

  bool runs_forward(uint32_t face, uint32_t edge) const {
    const uvec3& of_face = edges_.face_edges[face];
    const int corner = of_face.x == edge ? 0 : of_face.y == edge ? 1 : 2;
    return surface_.triangles[face][corner] == edges_.smaller_vertex[edge];
  }

  /// Whether some of the edge from a to b, both from the centre, lies inside.
  bool touches_ball(const dvec3& a, const dvec3& b) const {
    const double a2 = glm::dot(a, a);
    if (a2 <= radius2_ || glm::dot(b, b) <= radius2_) return true;
    const dvec3 edge = b - a;
    const double along = -glm::dot(a, edge), length2 = glm::dot(edge, edge);
    return along > 0 && along < length2 && (a2 - radius2_) * length2 <= along * along;
  }

  const Surface& surface_;
  const EdgeTable& edges_;
  const std::vector<vec3>& normals_;
  const double radius2_;
  dvec3 center_{0.0};
  uint32_t round_ = 0;         ///< counts calls
  std::vector<Visit> visits_;  ///< per face
  std::vector<uint32_t> reached_;
};

}  // namespace

std::vector<uint8_t> find_gentle_faces(const Surface& surface, const EdgeTable& edges, double resolution,
                                       const Job& job) {
  const Patches patches = make_patches(surface, edges, kPatchRadius * resolution);
  const std::vector<vec3> normals = face_normals(surface);
  std::vector<uint8_t> is_gentle(patches.seeds.size());
  const size_t grain = std::max<size_t>(256, patches.seeds.size() / 64);  // an explorer has room for each face
  parallel_for(patches.seeds.size(), grain, [&](size_t begin, size_t end) {
    SlopeExplorer explorer(surface, edges, normals, (1 + kPatchRadius) * resolution);
    for (size_t i = begin; i < end && !job.is_cancelled(); ++i) {
      is_gentle[i] = explorer.is_gentle_around(patches.seeds[i]);
    }
  });
  std::vector<uint8_t> result(surface.triangles.size());
  for (size_t face = 0; face < result.size(); ++face) result[face] = is_gentle[patches.patch_of_face[face]];
  return result;
}

}  // namespace farfield
