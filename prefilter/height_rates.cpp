// SPDX-License-Identifier: Apache-2.0
// A face's heights are sampled twice as densely as it may be cut at most; each row and column of these samples is then
// held against its own chords.
#include "prefilter/height_rates.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "prefilter/tessellation_rates.h"

namespace farfield {
namespace {

// Parts shorter than so many details may be off by so much less: a bow of the whole error within one detail is a slope,
// which shading shows, though no outline does. At the usual error and detail slopes then differ by less than 5 degrees.
constexpr double kDetailsOfFullError = 2;
constexpr int kFewestSamples = 4, kMostSamples = 4096;  // along a side

/// Heights on lines of samples, of one direction.
struct HeightLines {
  int side = 0;  ///< samples along the whole face, less one
  std::vector<std::vector<float>> lines;
};

/// How far samples lie from the chords of parts that are `part` samples long.
double farthest_from_chords(const std::vector<float>& line, double part) {
  const double last = static_cast<double>(line.size() - 1);
  const auto value = [&](double x) {
    const auto i = static_cast<size_t>(std::min(x, last));
    const double share = std::min(x, last) - static_cast<double>(i);
    return share > 0 ? (1 - share) * line[i] + share * line[i + 1] : double{line[i]};
  };
  double most = 0, begin = 0, end = 0, at_begin = line[0], at_end = line[0];
  for (size_t i = 0; i < line.size(); ++i) {
    const auto x = static_cast<double>(i);
    if (x > end) {
      begin = part * std::floor(x / part);
      end = std::min(begin + part, last);
      at_begin = value(begin);
      at_end = value(end);
    }
    if (end > begin)
      most = std::max(most, std::abs(line[i] - (at_begin + (x - begin) / (end - begin) * (at_end - at_begin))));
  }
  return most;
}

int find_rate(const HeightLines& all, double length, double most, double detail, double error, int least) {
  const int limit = std::max(least, static_cast<int>(std::min<double>(most, kMostRate)));
  int rate = least;
  while (rate < limit) {
    const double allowed = error * std::min(1.0, length / rate / (kDetailsOfFullError * detail));
    double off = 0;
    for (const auto& line : all.lines)
      off = std::max(off, farthest_from_chords(line, static_cast<double>(all.side) / rate));
    off /= allowed;
    if (!(off > 1)) break;
    const double wanted = std::min(std::ceil(rate * std::sqrt(off)), static_cast<double>(limit));
    rate = std::max(static_cast<int>(wanted), rate + 1);
  }
  return rate;
}

int side_of(double most) {
  return static_cast<int>(std::clamp(2 * most, double{kFewestSamples}, double{kMostSamples}));
}

}  // namespace

std::array<int, 2> rates_of_heights(const SourceHeights& heights, const FaceLimit& limit, const HeightDetail& detail,
                                    double scale, double error, std::array<int, 2> least) {
  if (detail.most.x <= least[0] && detail.most.y <= least[1]) return least;
  const auto height = [&](double u, double v) {
    return static_cast<float>(scale * height_at(heights, limit.uv({u, v}), detail.footprint));
  };
  HeightLines along[2] = {{side_of(detail.most.x), {}}, {side_of(detail.most.y), {}}};
  if (limit.is_triangle()) {  // lines along its three sides, all with the same samples
    const int side = along[0].side;
    std::vector<float> all(static_cast<size_t>(side + 1) * static_cast<size_t>(side + 1));
    const auto at = [&](int i, int j) -> float& { return all[static_cast<size_t>(j * (side + 1) + i)]; };
    for (int j = 0; j <= side; ++j) {
      for (int i = 0; i + j <= side; ++i)
        at(i, j) = height(static_cast<double>(i) / side, static_cast<double>(j) / side);
    }
    for (int j = 0; j < side; ++j) {
      std::vector<float> u, v, across;
      for (int i = 0; i + j <= side; ++i) {
        u.push_back(at(i, j));
        v.push_back(at(j, i));
        across.push_back(at(i, side - j - i));
      }
      for (auto* line : {&u, &v, &across}) along[0].lines.push_back(std::move(*line));
    }
    const int rate = find_rate(along[0], detail.length.x, detail.most.x, detail.detail, error, least[0]);
    return {rate, rate};
  }
  const int columns = along[0].side, rows = along[1].side;
  along[0].lines.assign(static_cast<size_t>(rows + 1), {});
  along[1].lines.assign(static_cast<size_t>(columns + 1), {});
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      const float value = height(static_cast<double>(x) / columns, static_cast<double>(y) / rows);
      along[0].lines[static_cast<size_t>(y)].push_back(value);
      along[1].lines[static_cast<size_t>(x)].push_back(value);
    }
  }
  return {find_rate(along[0], detail.length.x, detail.most.x, detail.detail, error, least[0]),
          find_rate(along[1], detail.length.y, detail.most.y, detail.detail, error, least[1])};
}

}  // namespace farfield
