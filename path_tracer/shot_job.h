// SPDX-License-Identifier: Apache-2.0
// `farfield shot`: a range of frames with one budget.
#pragma once

#include "path_tracer/render_job.h"

namespace farfield {

/// Frames first, first + step, ... up to last, both included.
struct FrameRange {
  int first = 0;
  int last = 0;
  int step = 1;

  int count() const { return (last - first) / step + 1; }
  std::vector<int> numbers() const;
};
/// Reads "A-B", "A-B:STEP" or "A". Errors: InvalidArgument (not of that form, B < A, STEP < 1).
Result<FrameRange> parse_frame_range(const std::string& text);

/// Where a frame of the shot in `folder` lies.
std::filesystem::path frame_path(const std::filesystem::path& folder, int frame);

/// Renders the frames into folder `out` (created): frame_NNNN.exr and .png, shot.json rewritten whole after each frame,
/// contact_sheet.png at the end. Frames that earlier runs with the same options finished, of whatever range, are kept
/// and not rendered again unless they are degraded, or their EXR is lost or another than was written; a lost PNG is
/// made again. shot.json tells of all of them, with the memory figures of the run that took most; the sheet and the
/// report that is returned have the frames of this range only. On Cancelled what is finished stays, and shot.json tells
/// of it. Errors: those of render_frame; those of check_frames once all is written.
Result<RenderReport> render_shot(const RenderOptions& options, const FrameRange& frames,
                                 const std::filesystem::path& out);

}  // namespace farfield
