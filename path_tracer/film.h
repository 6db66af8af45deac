// SPDX-License-Identifier: Apache-2.0
// Where a render goes: the mean of each pixel's samples, as interleaved channels.
#pragma once

#include "path_tracer/image.h"

namespace farfield {

/// What one path adds to its pixel. The lod values describe the camera ray's hit and are 0 without one.
struct FilmSample {
  vec3 color{0.0f};      ///< linear RGB; the background only if it is visible (TraceOptions::transparent)
  float alpha = 0;       ///< 1: the camera ray met something
  float lod_level = 0;   ///< k that was hit
  float lod_blend = 0;   ///< fraction of lambda
  float footprint = 0;   ///< world units
  float lod_volume = 0;  ///< 1: hit a voxel, 0: a mesh
};

/// Sums over a pixel's samples, in double: a million samples are as exact as ten. A value.
class PixelSums {
 public:
  void add(const FilmSample& sample);

 private:
  friend class Film;
  struct Part {
    glm::dvec4 rgba{0.0};
    double count = 0;
  };
  Part halves_[2];  // samples with even and with odd index
  glm::dvec4 lod_{0.0};
  double hits_ = 0;
};

/// The film. set_pixel() may be called from several threads for different pixels. Memory is allocated and touched by
/// the constructor; nothing more is needed later.
class Film {
 public:
  /// Channels of image(): R, G, B, A, lod.level, lod.blend, lod.footprint, lod.volume. R, G, B are means over all
  /// samples (premultiplied by alpha when transparent); the lod channels are means over the samples that hit.
  /// half_buffers: also keep the means of the even and of the odd samples, for noise estimates.
  Film(int width, int height, bool half_buffers = false);

  int width() const { return image_.width; }
  int height() const { return image_.height; }
  bool has_half_buffers() const { return !halves_[0].values.empty(); }

  void set_pixel(int x, int y, const PixelSums& sums);

  const Image& image() const { return image_; }
  /// R, G, B, A means of the samples with even (0) or odd (1) index. Only with half_buffers.
  const Image& half(int i) const { return halves_[i]; }

 private:
  Image image_;
  Image halves_[2];
};

}  // namespace farfield
