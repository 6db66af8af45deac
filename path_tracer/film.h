// SPDX-License-Identifier: Apache-2.0
// Where a render goes: the mean of each pixel's samples, as interleaved channels, with what denoisers and compositors
// want beside the colour.
//
//   R, G, B, A           colour, premultiplied; coverage
//   lod.level, lod.blend, lod.footprint, lod.volume     means over the samples that hit
//   albedo.R, .G, .B     of what the camera sees, premultiplied
//   N.X, .Y, .Z          its shading normal in world space, premultiplied, 0 in volumes
//   Z                    depth along the camera's axis of the nearest sample, kNoDepth where there is none
//   CryptoObject00.R .., CryptoMaterial00.R ..          with FilmOptions::ids, see cryptomatte.h
#pragma once

#include <array>

#include "path_tracer/cryptomatte.h"
#include "path_tracer/image.h"

namespace farfield {

/// Z where nothing is hit, as Blender has it: far behind everything, and yet a number that filters can work with.
inline constexpr float kNoDepth = 1e10f;

/// What ids there are.
enum class IdLayer : uint8_t { Object, Material };
inline constexpr std::array<const char*, 2> kIdLayerNames = {"CryptoObject", "CryptoMaterial"};
inline const char* id_layer_name(IdLayer layer) { return kIdLayerNames[static_cast<size_t>(layer)]; }

/// What one path adds to its pixel. All but the colour describe the camera ray's hit and count only with alpha 1.
struct FilmSample {
  vec3 color{0.0f};      ///< linear RGB; the background only if it is visible (TraceOptions::transparent)
  float alpha = 0;       ///< 1: the camera ray met something
  float lod_level = 0;   ///< k that was hit
  float lod_blend = 0;   ///< fraction of lambda
  float footprint = 0;   ///< world units
  float lod_volume = 0;  ///< 1: hit a voxel, 0: a mesh
  vec3 albedo{0.0f};
  vec3 normal{0.0f};                                 ///< world space; 0 in volumes
  float depth = kNoDepth;                            ///< along the camera's axis, world units
  std::array<uint32_t, kIdLayerNames.size()> ids{};  ///< per IdLayer: cryptomatte_id of what was hit, 0 for nothing
};

/// Sums over a pixel's samples, in double: a million samples are as exact as ten. A value.
class PixelSums {
 public:
  /// counts_ids: keep what Film::has_ids() needs.
  explicit PixelSums(bool counts_ids = false) : counts_ids_(counts_ids) {}
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
  dvec3 albedo_{0.0}, normal_{0.0};
  float depth_ = kNoDepth;
  bool counts_ids_;
  std::array<IdCounts, kIdLayerNames.size()> ids_;
};

struct FilmOptions {
  bool half_buffers = false;  ///< also keep the means of the even and of the odd samples, for noise estimates
  bool ids = false;           ///< also Cryptomatte's channels
};

/// The film. set_pixel() may be called from several threads for different pixels. Memory is allocated and touched by
/// the constructor; nothing more is needed later.
class Film {
 public:
  Film(int width, int height, const FilmOptions& options = {});

  int width() const { return image_.width; }
  int height() const { return image_.height; }
  bool has_half_buffers() const { return !halves_[0].values.empty(); }
  bool has_ids() const { return has_ids_; }

  void set_pixel(int x, int y, const PixelSums& sums);

  const Image& image() const { return image_; }
  /// R, G, B, A means of the samples with even (0) or odd (1) index. Only with half_buffers.
  const Image& half(int i) const { return halves_[i]; }

 private:
  bool has_ids_;
  Image image_;
  Image halves_[2];
};

}  // namespace farfield
