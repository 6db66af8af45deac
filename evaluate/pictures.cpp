// SPDX-License-Identifier: Apache-2.0
#include "evaluate/pictures.h"

#include <fmt/format.h>

#include "base/hash.h"
#include "base/result.h"
#include "evaluate/view_sums.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

Metadata picture_metadata(const LevelPlan& plan, const OrthoView& view, Light light) {
  Metadata metadata = light_metadata(light, view);
  metadata["farfield:level"] = static_cast<int>(plan.entry.level);
  metadata["farfield:resolution"] = static_cast<float>(plan.entry.resolution);
  metadata["farfield:samples_per_pixel"] = plan.samples_per_pixel;
  metadata["farfield:camera_direction"] = view.direction;
  metadata["farfield:camera_up"] = view.up;
  metadata["farfield:camera_center"] = view.center;
  metadata["farfield:orthographic_width"] = view.width();
  return metadata;
}

}  // namespace

Result<std::vector<Image>> render_parts(const AssetView& asset, const OrthoView& view, int samples_per_pixel,
                                        uint64_t seed, const Lights& lights, const Job& job) {
  ViewOptions options;
  options.center = view.center;
  options.direction = view.direction;
  options.up = view.up;
  options.width_world = view.width();
  options.width = view.width_px;
  options.height = view.height_px;
  options.trace.samples_per_pixel = samples_per_pixel / static_cast<int>(kParts);
  std::vector<Image> parts;
  for (uint64_t part = 0; part < kParts; ++part) {
    options.trace.seed = mix64(seed, part);
    FARFIELD_TRY_LET(auto images, asset.render(options, lights, job));
    parts.push_back(std::move(images.mean));
  }
  return parts;
}

Result<void> prepare_images(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return make_error(ErrorCode::Io, fmt::format("{}: cannot make this folder: {}", folder.string(), error.message()));
  const Environment daylight = lights_for(Light::Daylight, {}).environment;
  return write_exr(folder / "environment.exr", daylight.to_image(1024), light_metadata(Light::Daylight, {}));
}

Result<void> write_images(const fs::path& folder, const LevelPlan& plan, size_t view, Light light, const Image& source,
                          const Image& level) {
  const Metadata metadata = picture_metadata(plan, plan.views[view], light);
  const std::string suffix = light == Light::Daylight ? "" : fmt::format("{}_", name_of(light));
  const std::string name = fmt::format("level_{:02}_view_{:02}_{}", plan.entry.level, view, suffix);
  FARFIELD_TRY(write_exr(folder / (name + "source.exr"), source, metadata));
  return write_exr(folder / (name + "level.exr"), level, metadata);
}

}  // namespace farfield
