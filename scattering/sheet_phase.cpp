// SPDX-License-Identifier: Apache-2.0
#include "scattering/sheet_phase.h"

#include <algorithm>

#include "scattering/albedo.h"

namespace farfield {
namespace {

constexpr float kLeastCover = 1e-3f, kLeastEscape = 1e-3f;

/// What S is of pieces whose normals lie in the plane: S without what lies along n.
SymMat3 in_plane(const SymMat3& s, const vec3& n) {
  const mat3 away = mat3(1.0f) - glm::outerProduct(n, n);
  return congruence(away, s);
}

/// At most a million fronts: along the sheet there are sides alone.
float sides_towards(const SymMat3& s, const vec3& n, const vec3& w) {
  constexpr float kMost = 1e6f;
  const float sides = sheet_areas(s, n, w).sides;
  return sides < kMost ? sides : kMost;  // of broken files, too
}

}  // namespace

SheetPhase::SheetPhase(const FlakeParams& flakes, const SheetShape& shape, float gap, const vec3& n, const vec3& wo)
    : flakes_(flakes), n_(n), wo_(wo), sides_(sides_towards(flakes.sggx, n, wo)), caught_(shape.caught) {
  const float cover = std::max(1 - gap, kLeastCover);
  gap_to_front_ = gap / cover;
  // Where more is shown than there is room for, sides are hidden, never fronts.
  const float shown = SheetAreas{sides_}.all(shape.edge);
  const float hidden = std::max(shown - 1 / (shape.order * cover), 0.0f);
  const float round = (1 - shape.edge) * SheetAreas{sides_}.round();
  const float sides = std::max(shape.edge * sides_ - hidden, 0.0f);
  const float all = shape.edge + sides + round;
  share_ = {shape.edge / all, sides / all, round / all};

  const vec3 albedo = clamp_albedo(layered_albedo(flakes.specular, flakes.diffuse + flakes.transmission));
  returned_ = cluster_albedo(albedo, std::max(1 - caught_, kLeastEscape));
}

SheetPhase::Part SheetPhase::choose(Rng& rng) const {
  const float u = rng.next();
  if (u < share_[kFront]) return kFront;
  return u < share_[kFront] + share_[kSides] ? kSides : kRound;
}

FlakePhase SheetPhase::part(Part part) const {
  FlakeParams params = flakes_;
  if (part == kFront) params.sggx = SymMat3::outer(n_);
  if (part == kSides) params.sggx = in_plane(flakes_.sggx, n_);
  return FlakePhase(params, wo_);
}

/// Of a gap's depth, as a share.
float SheetPhase::depth_seen(float sides) const { return sides > gap_to_front_ ? gap_to_front_ / sides : 1.0f; }

vec3 SheetPhase::gain(Part part, const vec3& wi) const {
  if (part == kFront) return vec3(1.0f);
  if (part == kRound) return (vec3(1.0f) + sides_ * with_returned(1 - caught_)) / (1 + sides_);
  const float seen = depth_seen(sides_), lit = depth_seen(sides_towards(flakes_.sggx, n_, wi));
  const bool is_same_side = glm::dot(wi, n_) * glm::dot(wo_, n_) > 0;
  const float both = is_same_side ? std::min(lit, seen) : std::max(lit + seen - 1, 0.0f);
  return with_returned(seen > 0 ? both / seen : 1.0f);
}

vec3 SheetPhase::with_returned(float open) const { return vec3(open) + (1 - open) * returned_; }

vec3 SheetPhase::eval(const vec3& wi, Rng& rng) const {
  const Part chosen = choose(rng);
  return part(chosen).eval(wi, rng) * gain(chosen, wi);
}

float SheetPhase::pdf(const vec3& wi) const {
  float density = 0;
  for (const Part p : {kFront, kSides, kRound}) {
    if (share_[p] > 0) density += share_[p] * part(p).pdf(wi);
  }
  return density;
}

ScatterSample SheetPhase::sample(Rng& rng) const {
  const Part chosen = choose(rng);
  ScatterSample result = part(chosen).sample(rng);
  if (!(result.pdf > 0)) return result;
  result.weight *= gain(chosen, result.wi);
  result.pdf = pdf(result.wi);
  return result;
}

}  // namespace farfield
