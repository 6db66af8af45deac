// SPDX-License-Identifier: Apache-2.0
#include "scattering/highlight.h"

#include <array>
#include <cmath>

#include "scattering/albedo.h"
#include "scattering/fresnel.h"
#include "scattering/microfacet.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

constexpr float kSmallestAlpha = 1e-3f;  // smoother highlights are shown as this one

constexpr int kCosSteps = 64;
constexpr int kAlphaSteps = 32;
/// Midpoint samples per table entry: heights on the cap, most where it is nearly on edge and little is seen; azimuths
/// on the half that the plane of incidence leaves.
constexpr int kHeightSamples = 24;
constexpr int kAzimuthSamples = 12;

struct Row {
  std::array<HighlightShare, kCosSteps + 1> at;  ///< cos = (i / kCosSteps)^2: they change most at grazing angles
  HighlightShare mean;                           ///< over cosine-weighted directions
};
using Table = std::array<Row, kAlphaSteps + 1>;  ///< alpha = (i / kAlphaSteps)^2

HighlightShare mix(const HighlightShare& a, const HighlightShare& b, float t) {
  return {a.all + (b.all - a.all) * t, a.grazing + (b.grazing - a.grazing) * t};
}

HighlightShare integrate(double cos, double alpha) {
  cos = std::max(cos, 1e-5);
  const auto alpha2 = static_cast<float>(alpha * alpha);
  const BasicMicrofacets<double> facets(SymMat3{alpha2, alpha2, 1, 0, 0, 0}, dvec3(0, 0, 1));
  const dvec3 wo(std::sqrt(1 - cos * cos), 0, cos);
  double all = 0, grazing = 0;
  for (int i = 0; i < kHeightSamples; ++i) {
    for (int j = 0; j < kAzimuthSamples; ++j) {
      const double rest = (i + 0.5) / kHeightSamples, share = 3 * rest * rest;
      const dvec3 m = facets.sample_visible(wo, 1 - rest * rest * rest, 0.5 * (j + 0.5) / kAzimuthSamples);
      const dvec3 wi = reflect_about(wo, m);
      if (!(wi.z > 0)) continue;
      const double weight = share * masking_weight<Masking::HeightCorrelated>(cos, facets.projected_area(wo), wi.z,
                                                                              facets.projected_area(wi));
      all += weight;
      grazing += weight * std::pow(1 - std::min(1.0, glm::dot(wo, m)), 5);
    }
  }
  constexpr double kCount = kHeightSamples * kAzimuthSamples;
  return {static_cast<float>(all / kCount), static_cast<float>(grazing / kCount)};
}

/// Integral of 2 cos share(cos) dcos with share linear in x = sqrt(cos) between nodes: 4 x^3 share(x) dx, exact by
/// three Gauss points.
HighlightShare mean_of(const Row& row) {
  constexpr double kPoints[] = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr double kWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  double all = 0, grazing = 0;
  for (int i = 0; i < kCosSteps; ++i) {
    const auto node = static_cast<size_t>(i);
    for (int k = 0; k < 3; ++k) {
      const double x = (i + kPoints[k]) / kCosSteps, weight = kWeights[k] / kCosSteps * 4 * x * x * x;
      const HighlightShare share = mix(row.at[node], row.at[node + 1], static_cast<float>(kPoints[k]));
      all += weight * static_cast<double>(share.all);
      grazing += weight * static_cast<double>(share.grazing);
    }
  }
  return {static_cast<float>(all), static_cast<float>(grazing)};
}

Table make_table() {
  Table table;
  for (int a = 0; a <= kAlphaSteps; ++a) {
    Row& row = table[static_cast<size_t>(a)];
    for (int c = 0; c <= kCosSteps; ++c) {
      const double x = static_cast<double>(c) / kCosSteps, y = static_cast<double>(a) / kAlphaSteps;
      row.at[static_cast<size_t>(c)] =
          a == 0 ? HighlightShare{1, static_cast<float>(std::pow(1 - x * x, 5))} : integrate(x * x, y * y);
    }
    row.mean = mean_of(row);
  }
  return table;
}

const Table& table() {
  static const Table instance = make_table();
  return instance;
}

/// Clamped to [0, 1]; NaN gives 1, so that no index is ever out of range.
float unit_range(float x) { return std::max(0.0f, std::min(1.0f, x)); }

/// A place between the nodes of an axis that is as fine as the square root.
struct Place {
  size_t index;
  float t;
  Place(float value, int steps) {
    const float x = std::sqrt(unit_range(value)) * static_cast<float>(steps);
    index = static_cast<size_t>(std::min(static_cast<int>(x), steps - 1));
    t = x - static_cast<float>(index);
  }
};

}  // namespace

Highlight::Highlight(const vec3& f0, float roughness2) : f0_(clamp_albedo(f0)) {
  f90_ = grazing_reflectance(f0_);
  if (!exists()) return;
  alpha_ = std::max(std::sqrt(unit_range(roughness2)), kSmallestAlpha);
  const Place place(alpha_, kAlphaSteps);
  mean_ = mix(table()[place.index].mean, table()[place.index + 1].mean, place.t);
  // A path over n more facets is masked n times and reflects n + 1 times.
  const vec3 mean_fresnel = f0_ + (vec3(f90_) - f0_) * (1.0f / 21);
  multiple_ = mean_fresnel * mean_fresnel * mean_.all / (vec3(1.0f) - mean_fresnel * (1 - mean_.all));
}

vec3 Highlight::fresnel(float cos) const { return schlick(f0_, f90_, cos); }

HighlightShare Highlight::share(float cos) const {
  const Place alpha(alpha_, kAlphaSteps), at(cos, kCosSteps);
  const Row &low = table()[alpha.index], &high = table()[alpha.index + 1];
  return mix(mix(low.at[at.index], low.at[at.index + 1], at.t), mix(high.at[at.index], high.at[at.index + 1], at.t),
             alpha.t);
}

vec3 Highlight::multiple_lobe() const { return multiple_ / std::max(1 - mean_.all, 1e-5f); }

}  // namespace farfield
