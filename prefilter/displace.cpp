// SPDX-License-Identifier: Apache-2.0
#include "prefilter/displace.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel.h"
#include "prefilter/vertex_stars.h"

namespace farfield {
namespace {

constexpr size_t kGrain = 1024;  // vertices at once
// Eigenvalues of the mean of n n^T below which its directions are not asked for a place: normals that nearly agree say
// nothing across themselves. Of two faces it is (1 - cos) / 2 and (1 + cos) / 2: 37 and 143 degrees.
constexpr double kLeastEigenvalue = 0.1;
constexpr double kSameNormal = 1 - 1e-9;  // cosine, up to rounding
constexpr double kSmoothCosine = 0.999;   // 2.6 degrees: normals of files that are smooth there

/// Corners by their vertex.
VertexStars corners_by_vertex(const SourceMesh& mesh) {
  return VertexStars(mesh.positions.size(), mesh.corner_count(),
                     [&](uint32_t corner, const auto& visit) { visit(mesh.corner_position[corner]); });
}

/// Faces by their corner.
std::vector<uint32_t> faces_by_corner(const SourceMesh& mesh) {
  std::vector<uint32_t> face(mesh.corner_count());
  for (uint32_t f = 0; f < mesh.face_count(); ++f) {
    std::fill(face.begin() + mesh.face_begin[f], face.begin() + mesh.face_begin[f + 1], f);
  }
  return face;
}

/// Turns m into a diagonal matrix by Jacobi's rotations; columns of the result are its eigenvectors.
glm::dmat3 diagonalise(glm::dmat3& m) {
  constexpr int kSweeps = 8;  // errors square with each
  glm::dmat3 axes(1.0);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (const auto& [p, q] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
      if (m[p][q] == 0) continue;
      const double theta = 0.5 * std::atan2(2 * m[p][q], m[q][q] - m[p][p]);
      glm::dmat3 turn(1.0);
      turn[p][p] = turn[q][q] = std::cos(theta);
      turn[q][p] = std::sin(theta);
      turn[p][q] = -turn[q][p];
      m = glm::transpose(turn) * m * turn;
      axes = axes * turn;
    }
  }
  return axes;
}

/// The shortest d with dot(n, d) = h for all n and h, in the sense of least squares.
dvec3 place_above(const glm::dmat3& mean_nn, const dvec3& mean_hn) {
  glm::dmat3 values = mean_nn;
  const glm::dmat3 axes = diagonalise(values);
  dvec3 d(0.0);
  for (int i = 0; i < 3; ++i) {
    const double value = values[i][i];
    const double inverse = value >= kLeastEigenvalue ? 1 / value : value / (kLeastEigenvalue * kLeastEigenvalue);
    d += inverse * glm::dot(axes[i], mean_hn) * axes[i];
  }
  return d;
}

class Displacer {
 public:
  Displacer(SourceMesh& mesh, const std::vector<float>& height)
      : mesh_(mesh),
        height_(height),
        corners_(corners_by_vertex(mesh)),
        face_(faces_by_corner(mesh)),
        before_(mesh.positions) {}

  void run() {
    parallel_for(before_.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t v = begin; v < end; ++v) mesh_.positions[v] = before_[v] + offset_of(v);
    });
    std::vector<vec3> normal = mesh_.corner_normal;
    parallel_for(before_.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t v = begin; v < end; ++v) {
        if (is_touched(v)) turn_normals(v, normal);
      }
    });
    mesh_.corner_normal = std::move(normal);
  }

 private:
  std::span<const uint32_t> around(size_t vertex) const { return corners_.of(static_cast<uint32_t>(vertex)); }

  dvec3 offset_of(size_t vertex) const {
    glm::dmat3 nn(0.0);
    dvec3 hn(0.0), first(0.0);
    double height = 0;
    int count = 0;
    bool is_smooth = true;
    for (const uint32_t corner : around(vertex)) {
      const dvec3 n(mesh_.corner_normal[corner]);
      if (n == dvec3(0.0)) continue;
      if (count++ == 0) first = n;
      is_smooth &= glm::dot(n, first) > kSameNormal;
      nn += glm::outerProduct(n, n);
      hn += double{height_[corner]} * n;
      height += height_[corner];
    }
    if (count == 0 || hn == dvec3(0.0)) return dvec3(0.0);
    return is_smooth ? height / count * first
                     : place_above(nn / static_cast<double>(count), hn / static_cast<double>(count));
  }

  /// Whether a face at the vertex has changed.
  bool is_touched(size_t vertex) const {
    return std::ranges::any_of(around(vertex), [&](uint32_t corner) {
      const uint32_t face = face_[corner];
      for (uint32_t i = mesh_.face_begin[face]; i < mesh_.face_begin[face + 1]; ++i) {
        if (const uint32_t v = mesh_.corner_position[i]; before_[v] != mesh_.positions[v]) return true;
      }
      return false;
    });
  }

  /// By as much as the faces around have turned: what the given normals know beyond the faces stays.
  void turn_normals(size_t vertex, std::vector<vec3>& out) const {
    for (const uint32_t corner : around(vertex)) {
      const dvec3 n(mesh_.corner_normal[corner]);
      dvec3 from(0.0), to(0.0);
      for (const uint32_t other : around(vertex)) {
        if (glm::dot(dvec3(mesh_.corner_normal[other]), n) < kSmoothCosine) continue;
        from += wedge(before_, other);
        to += wedge(mesh_.positions, other);
      }
      const double length_from = glm::length(from), length_to = glm::length(to);
      if (!(length_from > 0 && length_to > 0)) continue;
      const dvec3 turned = n + side_of(from, n) * (to / length_to - from / length_from);
      const double length = glm::length(turned);
      if (length > 0) out[corner] = vec3(turned / length);
    }
  }

  /// Files may wind faces against their normals.
  static double side_of(const dvec3& face_normal, const dvec3& normal) {
    return glm::dot(face_normal, normal) < 0 ? -1.0 : 1.0;
  }

  /// The normal of a face at a corner, as long as the angle there.
  dvec3 wedge(const std::vector<dvec3>& positions, uint32_t corner) const {
    const uint32_t face = face_[corner], begin = mesh_.face_begin[face], end = mesh_.face_begin[face + 1];
    const auto position = [&](uint32_t i) { return positions[mesh_.corner_position[i]]; };
    const dvec3 at = position(corner);
    const dvec3 next = position(corner + 1 == end ? begin : corner + 1) - at;
    const dvec3 last = position(corner == begin ? end - 1 : corner - 1) - at;
    const dvec3 n = glm::cross(next, last);
    const double sine = glm::length(n);
    return sine > 0 ? std::atan2(sine, glm::dot(next, last)) / sine * n : dvec3(0.0);
  }

  SourceMesh& mesh_;
  const std::vector<float>& height_;
  const VertexStars corners_;
  const std::vector<uint32_t> face_;  ///< per corner
  const std::vector<dvec3> before_;
};

}  // namespace

void displace(SourceMesh& mesh, const std::vector<float>& corner_height) { Displacer(mesh, corner_height).run(); }

}  // namespace farfield
