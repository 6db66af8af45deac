// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/lat_long.h"

#include <algorithm>

#include "base/check.h"

namespace farfield {

namespace {

constexpr double kPiDouble = 3.14159265358979323846;

// Cumulative sums of `masses`, scaled to end at 1; all mass 0 gives 0 .. 0, 1: never drawn from.
void append_cdf(std::span<const double> masses, std::vector<float>& cdf) {
  double total = 0;
  for (const double mass : masses) total += mass;
  double sum = 0;
  cdf.push_back(0.0f);
  for (const double mass : masses) {
    sum += mass;
    cdf.push_back(total > 0 ? static_cast<float>(sum / total) : 0.0f);
  }
  cdf.back() = 1.0f;
}

// The bin that holds u in [0, 1). Bins without mass are never found.
size_t draw_bin(std::span<const float> cdf, float u) {
  const auto above = std::upper_bound(cdf.begin(), cdf.end() - 1, u);
  return static_cast<size_t>(above - cdf.begin()) - 1;
}

}  // namespace

vec3 LatLongGrid::direction(float x, float y) const {
  const float theta = kPi * y / static_cast<float>(height);
  const float phi = 2 * kPi * (x / static_cast<float>(width) - 0.5f);
  const float sin_theta = std::sin(theta);
  return {sin_theta * std::sin(phi), std::cos(theta), -sin_theta * std::cos(phi)};
}

size_t LatLongGrid::cell(const vec3& direction) const {
  const float theta = std::acos(std::clamp(direction.y, -1.0f, 1.0f));
  const float phi = std::atan2(direction.x, -direction.z);
  const auto row = static_cast<int>(theta / kPi * static_cast<float>(height));
  const auto column = static_cast<int>((phi / (2 * kPi) + 0.5f) * static_cast<float>(width));
  return static_cast<size_t>(std::clamp(row, 0, height - 1)) * static_cast<size_t>(width) +
         static_cast<size_t>(std::clamp(column, 0, width - 1));
}

double LatLongGrid::solid_angle(int row) const {
  return 2 * kPiDouble / width * (std::cos(kPiDouble * row / height) - std::cos(kPiDouble * (row + 1) / height));
}

LatLongDistribution::LatLongDistribution(const LatLongGrid& grid, std::span<const float> weights) : grid_(grid) {
  FARFIELD_CHECK(grid.width > 0 && grid.height > 0 && weights.size() == grid.cell_count());
  const auto width = static_cast<size_t>(grid.width);
  std::vector<double> row_masses, masses(width);
  column_cdf_.reserve((width + 1) * static_cast<size_t>(grid.height));
  for (int row = 0; row < grid.height; ++row) {
    const double solid_angle = grid.solid_angle(row);
    double row_mass = 0;
    for (size_t column = 0; column < width; ++column) {
      masses[column] = solid_angle * static_cast<double>(weights[static_cast<size_t>(row) * width + column]);
      row_mass += masses[column];
    }
    append_cdf(masses, column_cdf_);
    row_masses.push_back(row_mass);
    integral_ += row_mass;
  }
  append_cdf(row_masses, row_cdf_);
  cell_pdf_.resize(weights.size());
  if (!(integral_ > 0)) return;
  for (size_t i = 0; i < weights.size(); ++i)
    cell_pdf_[i] = static_cast<float>(static_cast<double>(weights[i]) / integral_);
}

vec3 LatLongDistribution::sample(Rng& rng) const {
  const auto stride = static_cast<size_t>(grid_.width) + 1;
  const size_t row = draw_bin(row_cdf_, rng.next());
  const size_t column = draw_bin(std::span(column_cdf_).subspan(row * stride, stride), rng.next());

  // Uniform over the cell's solid angle: uniform in longitude and in cos(theta).
  const double cos_upper = std::cos(kPiDouble * static_cast<double>(row) / grid_.height);
  const double cos_lower = std::cos(kPiDouble * static_cast<double>(row + 1) / grid_.height);
  const double cos_theta = cos_upper + (cos_lower - cos_upper) * static_cast<double>(rng.next());
  const double sin_theta = std::sqrt(std::max(0.0, (1 - cos_theta) * (1 + cos_theta)));
  const double phi =
      2 * kPiDouble * ((static_cast<double>(column) + static_cast<double>(rng.next())) / grid_.width - 0.5);
  return vec3(sin_theta * std::sin(phi), cos_theta, -sin_theta * std::cos(phi));
}

float LatLongDistribution::pdf(const vec3& direction) const { return cell_pdf_[grid_.cell(direction)]; }

}  // namespace farfield
