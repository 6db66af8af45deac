// SPDX-License-Identifier: Apache-2.0
#include "scattering/carlson.h"

#include <algorithm>
#include <cmath>

namespace farfield {
namespace {

/// spread: how close the three arguments get before the series takes over; its truncation error is about spread^6.
template <typename T>
T duplicate(T x, T y, T z, T spread) {
  // z becomes the middle value: then (x - z)(y - z) <= 0 and nothing cancels in the last line.
  if (x > y) std::swap(x, y);
  if (y > z) std::swap(y, z);
  if (x > y) std::swap(x, y);
  if (!(z > 0)) return 0;
  if (!(y > 0)) return std::sqrt(z) / 2;
  std::swap(y, z);

  // R_F and R_D share their duplication; d_sum collects R_D's terms.
  T xn = x, yn = y, zn = z, power = 1, d_sum = 0;
  T mean = (x + y + z) / 3;
  while (std::max({std::abs(mean - xn), std::abs(mean - yn), std::abs(mean - zn)}) > spread * mean) {
    const T sx = std::sqrt(xn), sy = std::sqrt(yn), sz = std::sqrt(zn);
    const T lambda = sx * sy + sy * sz + sz * sx;
    d_sum += power / (sz * (zn + lambda));
    power *= T(0.25);
    xn = (xn + lambda) / 4, yn = (yn + lambda) / 4, zn = (zn + lambda) / 4;
    mean = (xn + yn + zn) / 3;
  }

  T dx = 1 - xn / mean, dy = 1 - yn / mean, dz = -dx - dy;
  T e2 = dx * dy - dz * dz, e3 = dx * dy * dz;
  const T rf = (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / std::sqrt(mean);

  const T mean_d = (xn + yn + 3 * zn) / 5;
  dx = 1 - xn / mean_d, dy = 1 - yn / mean_d, dz = -(dx + dy) / 3;
  const T xy = dx * dy, z2 = dz * dz;
  e2 = xy - 6 * z2, e3 = (3 * xy - 8 * z2) * dz;
  const T e4 = 3 * (xy - z2) * z2, e5 = xy * z2 * dz;
  const T series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26;
  const T rd = power * series / (mean_d * std::sqrt(mean_d)) + 3 * d_sum;

  return T(0.5) * (z * rf - (x - z) * (y - z) / 3 * rd + std::sqrt(x * y / z));
}

}  // namespace

double carlson_rg(double x, double y, double z) { return duplicate(x, y, z, 1e-3); }
float carlson_rg(float x, float y, float z) { return duplicate(x, y, z, 0.05f); }

}  // namespace farfield
