// SPDX-License-Identifier: Apache-2.0
// The smooth surface that a cage's subdivision tends to, evaluated anywhere on its faces: OpenSubdiv's Bfr.
#pragma once

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/bfr/surfaceFactoryCache.h>
#include <opensubdiv/far/topologyRefiner.h>

#include <memory>
#include <mutex>
#include <shared_mutex>
#include <vector>

#include "base/vec.h"
#include "prefilter/cage.h"
#include "prefilter/cage_topology.h"

namespace farfield {

/// Of a cage of quads or, by Loop's rules, of triangles. Without a scheme the faces (triangles and quads, these
/// bilinear) with the normals of their corners. Immutable once made, any number of threads may look at its faces. The
/// cage must outlive it.
class LimitSurface {
 public:
  LimitSurface(const Cage& cage, const LimitRules& rules);

  const Cage& cage() const { return cage_; }
  bool is_smoothed() const { return factory_ != nullptr; }
  /// Of a face with this many corners.
  OpenSubdiv::Bfr::Parameterization parameterization(int corner_count) const;
  /// The cage's faces, edges and points as neighbours of each other.
  OpenSubdiv::Far::TopologyLevel topology() const { return refiner_->GetLevel(0); }
  /// What several faces share is evaluated by the first of them that is there.
  bool owns_edge(int face, int edge) const { return face == first_there(topology().GetEdgeFaces(edge)); }
  bool owns_point(int face, int point) const { return face == first_there(topology().GetVertexFaces(point)); }

 private:
  friend class FaceLimit;
  using Cache = OpenSubdiv::Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex, std::shared_lock<std::shared_mutex>,
                                                             std::unique_lock<std::shared_mutex>>;
  using Factory = OpenSubdiv::Bfr::RefinerSurfaceFactory<Cache>;

  /// -1: all are holes.
  int first_there(const OpenSubdiv::Far::ConstIndexArray& faces) const;

  const Cage& cage_;
  std::unique_ptr<const OpenSubdiv::Far::TopologyRefiner> refiner_;
  std::unique_ptr<const Factory> factory_;  ///< null: without a scheme
  std::vector<size_t> first_corner_;        ///< per face, where there is no factory
};

struct LimitPoint {
  dvec3 position{0.0};
  dvec3 normal{0.0};  ///< unit, to the side from which the face winds counter-clockwise; 0 where there is none
};

/// One face of a limit surface at a time. Parameters are those of OpenSubdiv's Parameterization. One thread at a time.
class FaceLimit {
 public:
  /// The surface must outlive it.
  explicit FaceLimit(const LimitSurface& surface) : surface_(surface) {}

  /// False: the face is a hole, or OpenSubdiv gives it no surface.
  bool move_to(int face);
  OpenSubdiv::Bfr::Parameterization parameterization() const;
  bool is_triangle() const { return parameterization().GetType() == OpenSubdiv::Bfr::Parameterization::TRI; }

  dvec3 position(const glm::dvec2& at) const;
  LimitPoint point(const glm::dvec2& at) const;
  glm::dvec2 uv(const glm::dvec2& at) const { return value<glm::dvec2>(0, at); }
  glm::dvec4 color(const glm::dvec2& at) const { return value<glm::dvec4>(channel_count_ - 1, at); }

 private:
  using Surface = OpenSubdiv::Bfr::Surface<double>;

  dvec3 normal(const glm::dvec2& at) const;
  dvec3 mean_normal(const glm::dvec2& at) const;
  glm::dvec2 next_to(const glm::dvec2& at) const;
  template <typename Value>
  Value value(int channel, const glm::dvec2& at) const;
  template <typename OfCorner>
  auto mix(const glm::dvec2& at, const OfCorner& of_corner) const;
  template <int N>
  void prepare(const CageChannel<N>& channel);

  const LimitSurface& surface_;
  Surface vertex_;
  Surface channel_[2];
  int channel_count_ = 0;
  int face_ = 0, corner_count_ = 0;
  std::vector<double> points_, channel_points_[2];
};

}  // namespace farfield
