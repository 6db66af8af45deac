// SPDX-License-Identifier: Apache-2.0
#include "scattering/fresnel.h"

#include <array>

#include "scattering/microfacet.h"

namespace farfield {

constexpr int kCosCount = 33;
constexpr int kAlphaCount = 17;

struct VisibleFresnelRow {
  std::array<float, kCosCount> share;  ///< at cos = i / (kCosCount - 1)
  float mean;
};

namespace {

/// Midpoint samples per table entry: heights on the cap, azimuths on the half that the plane of incidence leaves.
constexpr int kHeightSamples = 32;
constexpr int kAzimuthSamples = 16;

double integrate_share(double cos, double alpha) {
  const auto alpha2 = static_cast<float>(alpha * alpha);
  const BasicMicrofacets<double> facets(SymMat3{alpha2, alpha2, 1, 0, 0, 0}, dvec3(0, 0, 1));
  const dvec3 w(std::sqrt(1 - cos * cos), 0, cos);
  double sum = 0;
  for (int i = 0; i < kHeightSamples; ++i) {
    for (int j = 0; j < kAzimuthSamples; ++j) {
      const dvec3 m = facets.sample_visible(w, (i + 0.5) / kHeightSamples, 0.5 * (j + 0.5) / kAzimuthSamples);
      sum += std::pow(1 - std::min(1.0, glm::dot(w, m)), 5);
    }
  }
  return sum / (kHeightSamples * kAzimuthSamples);
}

/// Integral of 2 c share(c) dc with share linear between nodes: exact by Simpson's rule on each interval.
float mean_of(const std::array<float, kCosCount>& share) {
  constexpr double h = 1.0 / (kCosCount - 1);
  double mean = 0;
  for (int i = 0; i + 1 < kCosCount; ++i) {
    const double c = i * h;
    mean += h / 3 * (c * share[i] + (2 * c + h) * (share[i] + share[i + 1]) + (c + h) * share[i + 1]);
  }
  return static_cast<float>(mean);
}

std::array<VisibleFresnelRow, kAlphaCount> make_table() {
  std::array<VisibleFresnelRow, kAlphaCount> table;
  for (int a = 0; a < kAlphaCount; ++a) {
    for (int c = 0; c < kCosCount; ++c) {
      const double cos = static_cast<double>(c) / (kCosCount - 1), alpha = static_cast<double>(a) / (kAlphaCount - 1);
      table[a].share[c] = static_cast<float>(a == 0 ? std::pow(1 - cos, 5) : integrate_share(cos, alpha));
    }
    table[a].mean = mean_of(table[a].share);
  }
  return table;
}

/// Clamped to [0, 1]; NaN gives 1, so that no index is ever out of range.
float unit_range(float x) { return std::max(0.0f, std::min(1.0f, x)); }

}  // namespace

VisibleFresnel::VisibleFresnel(float alpha) {
  static const std::array<VisibleFresnelRow, kAlphaCount> table = make_table();
  const float x = unit_range(alpha) * (kAlphaCount - 1);
  const int index = std::min(static_cast<int>(x), kAlphaCount - 2);
  low_ = &table[index], high_ = &table[index + 1];
  blend_ = x - static_cast<float>(index);
}

float VisibleFresnel::grazing_share(float cos) const {
  const float x = unit_range(cos) * (kCosCount - 1);
  const int i = std::min(static_cast<int>(x), kCosCount - 2);
  const float t = x - static_cast<float>(i);
  const float low = low_->share[i] + (low_->share[i + 1] - low_->share[i]) * t;
  const float high = high_->share[i] + (high_->share[i + 1] - high_->share[i]) * t;
  return low + (high - low) * blend_;
}

float VisibleFresnel::mean_grazing_share() const { return low_->mean + (high_->mean - low_->mean) * blend_; }

}  // namespace farfield
