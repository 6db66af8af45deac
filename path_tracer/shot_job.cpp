// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/shot_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <system_error>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/result.h"
#include "path_tracer/frame_renderer.h"
#include "path_tracer/image.h"
#include "path_tracer/shot_record.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

constexpr int kSheetWidth = 1920;  ///< pixels, at most

Result<void> write_record(const fs::path& path, const ShotRecord& record) {
  const std::string text = to_json(record);
  const std::span<const std::byte> piece = std::as_bytes(std::span(text));
  return write_file_atomically(path, {&piece, 1});
}

bool in_range(const FrameRange& frames, int frame) {
  return frame >= frames.first && frame <= frames.last && (frame - frames.first) % frames.step == 0;
}

// The report with some of its frames. If none is left, its memory figures are of nothing and go, too.
RenderReport keep_frames(RenderReport report, const std::function<bool(int frame)>& is_kept) {
  std::erase_if(report.frames, [&](const FrameReport& frame) { return !is_kept(frame.frame); });
  return report.frames.empty() ? RenderReport() : report;
}

// What earlier runs of the same shot finished as planned, whatever frames they were asked for. Empty if it was another
// shot.
ShotRecord finished_before(const fs::path& folder, const std::string& fingerprint) {
  auto record = read_shot_record(folder);
  if (!record || record->fingerprint != fingerprint) return {fingerprint, {}, {}};
  std::erase_if(record->report.frames, [](const FrameReport& frame) { return frame.is_degraded(); });
  record->report = keep_frames(std::move(record->report), [&](int frame) {
    std::error_code ignored;
    return fs::exists(frame_path(folder, frame), ignored);
  });
  return *record;
}

std::vector<int> frames_to_render(const FrameRange& frames, const RenderReport& finished) {
  std::vector<int> missing;
  for (const int frame : frames.numbers()) {
    const bool is_there = std::any_of(finished.frames.begin(), finished.frames.end(),
                                      [&](const FrameReport& report) { return report.frame == frame; });
    if (!is_there) missing.push_back(frame);
  }
  return missing;
}

// As square as whole rows allow, frames scaled down by a whole factor so that a row fits.
ContactSheet make_sheet(const FrameRange& frames, int width, int height) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(frames.count()))));
  const int factor = std::max(1, (width * columns + kSheetWidth - 1) / kSheetWidth);
  return ContactSheet(frames.count(), columns, (width + factor - 1) / factor, (height + factor - 1) / factor);
}

int sheet_cell(const FrameRange& frames, int frame) { return (frame - frames.first) / frames.step; }

// Reads a frame that the record calls finished. Errors: BadFile (damaged, or not what the shot has written).
Result<Image> read_finished(const fs::path& frame, std::optional<uint64_t> hash) {
  FARFIELD_TRY_LET(const uint64_t found, hash_file(frame));
  if (hash && found != *hash)
    return make_error(ErrorCode::BadFile, fmt::format("{}: it is not what this shot has written", frame.string()));
  FARFIELD_TRY_LET(auto file, read_exr(frame));
  return std::move(file.image);
}

// The preview beside a frame, where it is lost.
Result<void> restore_preview(fs::path frame, const Image& image, float exposure_stops) {
  std::error_code ignored;
  if (fs::exists(frame.replace_extension(".png"), ignored)) return {};
  return write_png(frame, image, {exposure_stops});
}

// Takes what earlier runs have finished of the range onto the sheet, and out of the record what has to be done again.
Result<void> take_finished(ShotRecord& earlier, const FrameRange& frames, const fs::path& folder,
                           const RenderOptions& options, ContactSheet& sheet) {
  std::set<int> spoilt;
  for (const FrameReport& report : earlier.report.frames) {
    if (!in_range(frames, report.frame)) continue;
    const fs::path path = frame_path(folder, report.frame);
    const auto hash = earlier.exr_hashes.find(report.frame);
    const auto image =
        read_finished(path, hash == earlier.exr_hashes.end() ? std::nullopt : std::optional(hash->second));
    if (image) {
      FARFIELD_TRY(restore_preview(path, *image, options.exposure_stops));
      sheet.set(sheet_cell(frames, report.frame), *image);
    } else {
      spoilt.insert(report.frame);
      if (options.warning) options.warning(fmt::format("{}; it is rendered again", image.error().message));
    }
  }
  earlier.report = keep_frames(std::move(earlier.report), [&](int frame) { return !spoilt.contains(frame); });
  return {};
}

}  // namespace

std::vector<int> FrameRange::numbers() const {
  std::vector<int> numbers;
  for (int frame = first; frame <= last; frame += step) numbers.push_back(frame);
  return numbers;
}

fs::path frame_path(const fs::path& folder, int frame) { return folder / fmt::format("frame_{:04}.exr", frame); }

Result<FrameRange> parse_frame_range(const std::string& text) {
  FrameRange range;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  const auto number = [&](int& value) {
    const auto [next, error] = std::from_chars(at, end, value);
    at = next;
    return error == std::errc() && value >= 0;
  };
  const auto skip = [&](char c) { return at != end && *at == c && ++at; };

  bool good = number(range.first);
  range.last = range.first;
  if (good && skip('-')) good = number(range.last);
  if (good && skip(':')) good = number(range.step);
  if (!good || at != end || range.last < range.first || range.step < 1 || range.last > (1 << 24))
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("\"{}\" is not a range of frames like 0-120, 0-120:10 or 60", text));
  return range;
}

Result<RenderReport> render_shot(const RenderOptions& options, const FrameRange& frames, const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error) return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}", out.string(), error.message()));
  FARFIELD_TRY_LET(const auto renderer, FrameRenderer::prepare(options));

  // The sheet and the frames of an earlier run are read before memory is measured.
  ContactSheet sheet = make_sheet(frames, options.width, options.height);
  ShotRecord earlier = finished_before(out, renderer->fingerprint());
  FARFIELD_TRY(take_finished(earlier, frames, out, options, sheet));
  const std::vector<int> missing = frames_to_render(frames, earlier.report);
  const int finished_count = frames.count() - static_cast<int>(missing.size());
  if (options.message && finished_count > 0)
    options.message(fmt::format("{} of {} frames are finished already", finished_count, frames.count()));

  ShotRecord record = earlier;
  const auto take_frame = [&](const Image& image, const Metadata& metadata,
                              const RenderReport& so_far) -> Result<void> {
    const int frame = so_far.frames.back().frame;
    const fs::path path = frame_path(out, frame);
    FARFIELD_TRY(write_frame(path, image, metadata, options.exposure_stops));
    FARFIELD_TRY_LET(record.exr_hashes[frame], hash_file(path));
    sheet.set(sheet_cell(frames, frame), image);
    record.report = join_reports(earlier.report, so_far);
    return write_record(out / "shot.json", record);
  };
  if (!missing.empty()) {
    FARFIELD_TRY_LET(const auto rendered, renderer->render(missing, take_frame));
    record.report = join_reports(earlier.report, rendered);
    FARFIELD_TRY(write_record(out / "shot.json", record));  // writing the last frame may have been the peak
  }
  FARFIELD_TRY(write_png(out / "contact_sheet.png", sheet.image(), {options.exposure_stops}));
  RenderReport report = keep_frames(record.report, [&](int frame) { return in_range(frames, frame); });
  FARFIELD_TRY(check_frames(report));
  return report;
}

}  // namespace farfield
