// SPDX-License-Identifier: Apache-2.0
// One baked asset alone, at a level of choice, seen by an orthographic camera: what `farfield evaluate` compares.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "farfield/runtime.h"
#include "path_tracer/image.h"
#include "path_tracer/integrator.h"

namespace farfield {

/// An orthographic view in the asset's space.
struct ViewOptions {
  vec3 center{0.0f};                  ///< seen at the image's centre
  vec3 direction{0.0f, 0.0f, -1.0f};  ///< of view: from the camera to the asset
  vec3 up{0.0f, 1.0f, 0.0f};          ///< not parallel to direction
  float width_world = 1;              ///< of the image
  int width = 64;                     ///< pixels; square ones, so one is width_world / width wide
  int height = 64;
  TraceOptions trace;  ///< `transparent` is taken as true
};

/// A view: R, G, B (premultiplied), A.
struct ViewImages {
  Image mean;
  /// Means of the even and of the odd samples. Their difference gives the noise, rather too high than too low, because
  /// a pixel's samples are spread evenly.
  Image half[2];
};

/// A ray in the asset's space; direction: unit.
struct ProbeRay {
  vec3 origin{0.0f};
  vec3 direction{0.0f};
};

/// A baked asset with all rays at one lambda. One thread at a time; render() itself uses all threads.
class AssetView {
 public:
  /// folder: a baked asset. lambda: forced for every ray, 0 is the source; values between two levels blend them.
  /// Errors: those of Runtime::create, open_asset and plan_frame.
  static Result<std::unique_ptr<AssetView>> open(const std::filesystem::path& folder, float lambda,
                                                 uint64_t budget_bytes = uint64_t{1} << 36,
                                                 Blend blend = Blend::Dissolve);
  ~AssetView();
  AssetView(const AssetView&) = delete;
  AssetView& operator=(const AssetView&) = delete;

  Box3 bounds() const;
  const std::vector<LevelInfo>& levels() const;
  Stats stats() const;
  /// Errors: those of path_trace.
  Result<ViewImages> render(const ViewOptions& options, const Lights& lights, const Job& job = {}) const;
  /// How far each ray goes until it meets the asset; infinity where it does not. Depends on the arguments alone.
  std::vector<float> first_hits(std::span<const ProbeRay> rays, uint64_t seed) const;

 private:
  AssetView();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace farfield
