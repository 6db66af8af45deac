// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/render_job.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/result.h"
#include "path_tracer/frame_renderer.h"
#include "path_tracer/image.h"

namespace farfield {

Result<RenderReport> render_frame(const RenderOptions& options, int frame, const std::filesystem::path& out) {
  FARFIELD_TRY_LET(const auto renderer, FrameRenderer::prepare(options));
  const auto write = [&](const Image& image, const Metadata& metadata, const RenderReport&) {
    return write_frame(out, image, metadata, options.exposure_stops);
  };
  FARFIELD_TRY_LET(auto report, renderer->render({&frame, 1}, write));
  FARFIELD_TRY(check_frames(report));
  return report;
}

Result<void> check_frames(const RenderReport& report) {
  std::vector<int> degraded;
  for (const FrameReport& frame : report.frames)
    if (frame.is_degraded()) degraded.push_back(frame.frame);
  if (degraded.empty()) return {};
  constexpr size_t kMostNamed = 10;
  const size_t named = std::min(degraded.size(), kMostNamed);
  const std::string numbers = fmt::format("{}", fmt::join(degraded.begin(), degraded.begin() + named, ", "));
  return make_error(
      ErrorCode::BadFile,
      fmt::format("{} of {} frames show coarser levels than planned (frame {}{}): the warnings say why; "
                  "the same command renders them again",
                  degraded.size(), report.frames.size(), numbers, named < degraded.size() ? ", ..." : ""));
}

Result<void> write_frame(const std::filesystem::path& exr, const Image& image, const Metadata& metadata,
                         float exposure_stops) {
  FARFIELD_TRY(write_exr(exr, image, metadata));
  std::filesystem::path png = exr;
  return write_png(png.replace_extension(".png"), image, {exposure_stops});
}

}  // namespace farfield
