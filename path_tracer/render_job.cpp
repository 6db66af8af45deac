// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/render_job.h"

#include "base/result.h"
#include "path_tracer/frame_renderer.h"
#include "path_tracer/image.h"

namespace farfield {

Result<RenderReport> render_frame(const RenderOptions& options, int frame, const std::filesystem::path& out) {
  FARFIELD_TRY_LET(const auto renderer, FrameRenderer::prepare(options));
  return renderer->render({&frame, 1}, [&](const Image& image, const Metadata& metadata, const RenderReport&) {
    return write_frame(out, image, metadata, options.exposure_stops);
  });
}

Result<void> write_frame(const std::filesystem::path& exr, const Image& image, const Metadata& metadata,
                         float exposure_stops) {
  FARFIELD_TRY(write_exr(exr, image, metadata));
  std::filesystem::path png = exr;
  return write_png(png.replace_extension(".png"), image, {exposure_stops});
}

}  // namespace farfield
