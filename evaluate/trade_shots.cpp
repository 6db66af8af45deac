// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_shots.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <charconv>
#include <string_view>

#include "base/parallel.h"
#include "base/result.h"
#include "path_tracer/child_process.h"
#include "path_tracer/shot_record.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

std::string frames_text(const FrameRange& frames) {
  return fmt::format("{}-{}:{}", frames.first, frames.last, frames.step);
}

/// Hands "progress 0.42 frame 60 (3/7)" on.
void read_progress(std::string_view line, const Job& job) {
  constexpr std::string_view kWord = "progress ";
  if (!line.starts_with(kWord)) return;
  line.remove_prefix(kWord.size());
  double done = 0;
  const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), done);
  if (error != std::errc()) return;
  line.remove_prefix(static_cast<size_t>(rest - line.data()));
  if (!line.empty()) line.remove_prefix(1);
  job.report(done, std::string(line));
}

}  // namespace

std::vector<std::string> shot_command(const std::string& program, const RenderOptions& options,
                                      const FrameRange& frames, const fs::path& out) {
  std::vector<std::string> command = {program, "shot"};
  // With "=", so that no value is taken for a flag.
  const auto add = [&](std::string_view flag, const auto& value) {
    command.push_back(fmt::format("{}={}", flag, value));
  };
  add("--output", out.string());
  add("--frames", frames_text(frames));
  add("--size", fmt::format("{}x{}", options.width, options.height));
  add("--spp", options.trace.samples_per_pixel);
  add("--seed", options.trace.seed);
  add("--budget", options.budget_bytes);
  add("--pixel-error", options.pixel_error);
  add("--finest-grid", options.finest_grid);
  add("--rays-per-voxel", options.rays_per_voxel);
  add("--assemblies", name_of(options.assemblies));
  add("--tile-triangles", options.tile_triangles);
  add("--exposure", options.exposure_stops);
  add("--threads", thread_count());
  add("--parent", ::getpid());
  if (!options.assets.empty()) add("--assets", options.assets.string());
  if (!options.environment.empty()) add("--environment", options.environment.string());
  if (!options.camera.empty()) add("--camera", options.camera);
  if (options.frames_per_second > 0) add("--fps", options.frames_per_second);
  if (!options.sky) command.push_back("--no-sky");
  if (options.turn_sun) command.push_back("--turn-sun");
  if (options.full_detail) command.push_back("--full-detail");
  command.push_back("--");
  command.push_back(options.scene.string());
  return command;
}

Result<RenderReport> run_shot(const std::string& program, const RenderOptions& options, const FrameRange& frames,
                              const fs::path& out, const Job& job) {
  FARFIELD_TRY_LET(const int status, run_child(shot_command(program, options, frames, out), job,
                                               [&](std::string_view line) { read_progress(line, job); }));
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");  // by one Ctrl-C for both of us
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return make_error(ErrorCode::BadFile, fmt::format("rendering {} failed ({})", out.string(), how_it_ended(status)));
  const auto record = read_shot_record(out);
  if (!record) return make_error(ErrorCode::BadFile, fmt::format("{}: there is no shot.json", out.string()));
  return record->report;
}

}  // namespace farfield
