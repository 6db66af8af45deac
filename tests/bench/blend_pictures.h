// SPDX-License-Identifier: Apache-2.0
// Pictures of an asset at one lambda, with what is measured of them: coverage, brightness, noise, time.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/process_time.h"
#include "evaluate/views.h"
#include "path_tracer/asset_view.h"

namespace farfield {

inline constexpr int kBlendSamplesPerPixel = 256;

struct Picture {
  double coverage = 0, brightness = 0;  ///< means
  double deviation = 0;                 ///< of a pixel's brightness, root mean square
};

class Renderer {
 public:
  /// shown: what fills the view; the asset's bounds, if it is empty.
  Renderer(const std::filesystem::path& folder, float lambda, Blend blend, double pixel_size, const Box3& shown = {})
      : asset_(AssetView::open(folder, lambda, uint64_t{1} << 36, blend)) {
    if (!asset_) return;
    const OrthoView view = frame_view(shown.is_empty() ? (*asset_)->bounds() : shown,
                                      glm::normalize(vec3(-1.0f, -0.3f, -0.6f)), static_cast<float>(pixel_size));
    options_.center = view.center, options_.direction = view.direction, options_.up = view.up;
    options_.width_world = view.width(), options_.width = view.width_px, options_.height = view.height_px;
    options_.trace.samples_per_pixel = kBlendSamplesPerPixel;
    lights_.environment = Environment::sun_sky(default_sun_sky());
  }

  Result<Picture> render() {
    if (!asset_) return tl::unexpected(asset_.error());
    options_.trace.seed++;
    const double start = process_cpu_seconds();
    auto images = (*asset_)->render(options_, lights_);
    seconds_.push_back(process_cpu_seconds() - start);
    if (!images) return tl::unexpected(images.error());
    Picture picture;
    const std::vector<float>&mean = images->mean.values, &a = images->half[0].values, &b = images->half[1].values;
    double squares = 0;
    for (size_t i = 0; i + 3 < mean.size(); i += 4) {
      picture.coverage += mean[i + 3];
      for (size_t c = 0; c < 3; ++c) {
        picture.brightness += mean[i + c];
        squares += (a[i + c] - b[i + c]) * (a[i + c] - b[i + c]) / 4;
      }
    }
    picture.deviation = std::sqrt(squares);
    return picture;
  }
  double median_seconds() const {
    std::vector<double> sorted(seconds_.begin() + 1, seconds_.end());  // the first loads
    std::ranges::sort(sorted);
    return sorted[sorted.size() / 2];
  }
  uint64_t bytes() const { return (*asset_)->stats().accounted_bytes; }

 private:
  Result<std::unique_ptr<AssetView>> asset_;
  ViewOptions options_;
  Lights lights_;
  std::vector<double> seconds_;
};

}  // namespace farfield
