// SPDX-License-Identifier: Apache-2.0
#include "prefilter/limit_surface.h"

#include <utility>

namespace farfield {
namespace {

namespace osd = OpenSubdiv;
using osd::Bfr::Parameterization;
using PointDescriptor = osd::Bfr::Surface<double>::PointDescriptor;

static_assert(sizeof(dvec3) == 3 * sizeof(double) && sizeof(glm::dvec2) == 2 * sizeof(double),
              "read as rows of numbers");

// Levels of refinement before what is irregular is approximated (by Gregory patches, which meet the limit at the cage's
// points). With OpenSubdiv's own 2, points next to poles of 3 to 16 faces move by 0.7 to 8 % of a face; beyond 6
// nothing changes any more.
constexpr int kSmoothLevel = 6, kSharpLevel = 8;

template <int N>
const CageChannel<N>& channel_of(const Cage& cage) {
  if constexpr (N == 2) {
    return cage.uv;
  } else {
    return cage.color;
  }
}

}  // namespace

LimitSurface::LimitSurface(const Cage& cage, const LimitRules& rules)
    : cage_(cage), refiner_(make_refiner(cage, rules)) {
  if (rules.scheme == SubdivisionScheme::None) {
    size_t corners = 0;
    for (const int size : cage.face_size)
      first_corner_.push_back(std::exchange(corners, corners + static_cast<size_t>(size)));
    return;
  }
  Factory::Options options;
  options.SetApproxLevelSmooth(kSmoothLevel).SetApproxLevelSharp(kSharpLevel);
  factory_ = std::make_unique<const Factory>(*refiner_, options);
}

int LimitSurface::first_there(const osd::Far::ConstIndexArray& faces) const {
  for (int i = 0; i < faces.size(); ++i) {
    if (!topology().IsFaceHole(faces[i])) return faces[i];
  }
  return -1;
}

Parameterization LimitSurface::parameterization(int corner_count) const {
  if (is_smoothed()) return Parameterization(refiner_->GetSchemeType(), corner_count);
  // Without a scheme any two will do that have triangles and quads without parts.
  return Parameterization(corner_count == 3 ? osd::Sdc::SCHEME_LOOP : osd::Sdc::SCHEME_CATMARK, corner_count);
}

Parameterization FaceLimit::parameterization() const { return surface_.parameterization(corner_count_); }

bool FaceLimit::move_to(int face) {
  const Cage& cage = surface_.cage_;
  face_ = face;
  corner_count_ = cage.face_size[static_cast<size_t>(face)];
  if (!surface_.is_smoothed()) {
    channel_count_ = !cage.uv.corner_value.empty() + !cage.color.corner_value.empty();
    return true;
  }
  channel_count_ = !cage.uv.corner_value.empty() + !cage.color.corner_value.empty();
  Surface* const channels = channel_count_ > 0 ? channel_ : nullptr;
  if (!surface_.factory_->InitSurfaces(face, &vertex_, channels, nullptr, channel_count_)) return false;
  points_.resize(3 * static_cast<size_t>(vertex_.GetNumPatchPoints()));
  vertex_.PreparePatchPoints(&cage.points[0].x, PointDescriptor(3), points_.data(), PointDescriptor(3));
  channel_count_ = 0;
  prepare(cage.uv);
  prepare(cage.color);
  return true;
}

template <int N>
void FaceLimit::prepare(const CageChannel<N>& channel) {
  if (channel.corner_value.empty()) return;
  const Surface& surface = channel_[channel_count_];
  std::vector<double>& points = channel_points_[channel_count_++];
  points.resize(N * static_cast<size_t>(surface.GetNumPatchPoints()));
  surface.PreparePatchPoints(&channel.values[0].x, PointDescriptor(N), points.data(), PointDescriptor(N));
}

/// The linear mean of what the corners have.
template <typename OfCorner>
auto FaceLimit::mix(const glm::dvec2& at, const OfCorner& of_corner) const {
  const size_t c = surface_.first_corner_[static_cast<size_t>(face_)];
  if (corner_count_ == 3) return (1 - at.x - at.y) * of_corner(c) + at.x * of_corner(c + 1) + at.y * of_corner(c + 2);
  return (1 - at.y) * ((1 - at.x) * of_corner(c) + at.x * of_corner(c + 1)) +
         at.y * (at.x * of_corner(c + 2) + (1 - at.x) * of_corner(c + 3));
}

dvec3 FaceLimit::position(const glm::dvec2& at) const {
  const Cage& cage = surface_.cage_;
  if (!surface_.is_smoothed()) {
    return mix(at, [&](size_t corner) { return cage.points[static_cast<size_t>(cage.corner_point[corner])]; });
  }
  dvec3 p;
  vertex_.Evaluate(&at.x, points_.data(), PointDescriptor(3), &p.x);
  return p;
}

dvec3 FaceLimit::mean_normal(const glm::dvec2& at) const {
  const dvec3 n = mix(at, [&](size_t corner) { return surface_.cage_.corner_normal[corner]; });
  const double length = glm::length(n);
  return length > 0 ? n / length : dvec3(0.0);
}

dvec3 FaceLimit::normal(const glm::dvec2& at) const {
  constexpr double kFlat = 1e-9;  // sine of the angle between the two derivatives below which they say nothing
  dvec3 p, du, dv;
  vertex_.Evaluate(&at.x, points_.data(), PointDescriptor(3), &p.x, &du.x, &dv.x);
  const dvec3 n = glm::cross(du, dv);
  const double length = glm::length(n);
  return length > kFlat * glm::length(du) * glm::length(dv) ? n / length : dvec3(0.0);
}

LimitPoint FaceLimit::point(const glm::dvec2& at) const {
  if (!surface_.is_smoothed()) return {position(at), mean_normal(at)};
  LimitPoint out{position(at), normal(at)};
  // At a tip, say, where edges of infinite sharpness meet in line: what the face has next to it.
  if (out.normal == dvec3(0.0)) out.normal = normal(next_to(at));
  return out;
}

/// A thousandth of the way to the middle of the face.
glm::dvec2 FaceLimit::next_to(const glm::dvec2& at) const {
  constexpr double kNudge = 1e-3;
  glm::dvec2 center;
  parameterization().GetCenterCoord(&center.x);
  return at + kNudge * (center - at);
}

template <typename Value>
Value FaceLimit::value(int channel, const glm::dvec2& at) const {
  if (!surface_.is_smoothed()) {
    const CageChannel<Value::length()>& all = channel_of<Value::length()>(surface_.cage_);
    return mix(at, [&](size_t corner) { return all.values[static_cast<size_t>(all.corner_value[corner])]; });
  }
  Value out;
  channel_[channel].Evaluate(&at.x, channel_points_[channel].data(), PointDescriptor(Value::length()), &out.x);
  return out;
}
template glm::dvec2 FaceLimit::value<glm::dvec2>(int, const glm::dvec2&) const;
template glm::dvec4 FaceLimit::value<glm::dvec4>(int, const glm::dvec2&) const;

}  // namespace farfield
