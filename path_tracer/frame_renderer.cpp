// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/frame_renderer.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <optional>

#include "base/embree.h"
#include "base/file_io.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "base/process_memory.h"
#include "base/result.h"
#include "cache/manifest.h"
#include "import/read_scene.h"
#include "import/read_volume.h"
#include "path_tracer/asset_library.h"
#include "path_tracer/budget_notice.h"
#include "path_tracer/film.h"
#include "path_tracer/render_session.h"
#include "path_tracer/scene_setup.h"
#include "path_tracer/warm_up.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

constexpr int kLargestSide = 1 << 15;
constexpr uint64_t kMostManifestBytes = 16 << 20;

// Goes up when the same scene, assets and options come to give other pictures, so that a shot that was begun before
// does not go on with frames that look otherwise.
constexpr int kLooksVersion = 6;

// A file's name, size and time of change: enough to see that it is another one.
std::string identity(const fs::path& path) {
  if (path.empty()) return "none";
  std::error_code ignored;
  return fmt::format("{}:{}:{}", path.filename().string(), fs::file_size(path, ignored),
                     fs::last_write_time(path, ignored).time_since_epoch().count());
}

// A manifest tells every byte of its asset apart, by hash.
uint64_t manifest_hash(const fs::path& folder) {
  const auto text = read_small_file(folder / "manifest.json", kMostManifestBytes);
  return text ? hash_values(std::span<const char>(*text)) : 0;
}

std::string make_fingerprint(const RenderOptions& options, std::span<const fs::path> asset_folders) {
  const TraceOptions& trace = options.trace;
  std::string text = fmt::format(
      "farfield {} looks {} size {}x{} spp {} seed {} depth {} roulette {} clamp {} strategy {} transparent {} budget "
      "{} pixel error {} blend {} "
      "full {} exposure {} cryptomatte {} camera {} fps {} scene {} environment {} sky {} assets",
      FARFIELD_VERSION, kLooksVersion, options.width, options.height, trace.samples_per_pixel, trace.seed,
      trace.max_depth, trace.roulette_depth, trace.clamp_indirect, static_cast<int>(trace.strategy), trace.transparent,
      options.budget_bytes, options.pixel_error, static_cast<int>(options.blend), options.full_detail,
      options.exposure_stops, options.cryptomatte, options.camera, options.frames_per_second, identity(options.scene),
      identity(options.environment), options.sky);
  // Said only where they differ: shots from before know no others.
  if (options.turn_sun) text += " sun turned";
  if (options.blend_window != 1.0f) text += fmt::format(" blend window {}", options.blend_window);
  if (options.shutter > 0) text += fmt::format(" shutter {}", options.shutter);
  if (options.off_screen_scale != 1.0f) text += fmt::format(" off screen {}", options.off_screen_scale);
  for (const fs::path& folder : asset_folders)
    if (!folder.empty()) text += fmt::format(" {}:{}", folder.filename().string(), to_hex(manifest_hash(folder)));
  return text;
}

Metadata frame_metadata(const RenderOptions& options, const GltfScene& scene, const Camera& camera, int frame) {
  const TessellationCamera pixel = camera.tessellation();
  return {
      {"camera.forward", camera.forward()},
      {"camera.pixel_spread", pixel.pixel_spread},
      {"camera.pixel_width", pixel.pixel_width},
      {"camera.position", vec3(dvec3(camera.position()) + scene.origin_world)},
      {"camera.up", camera.up()},
      {"farfield.budget", fmt::format("{}", options.budget_bytes)},
      {"farfield.frame", frame},
      {"farfield.full_detail", options.full_detail ? 1 : 0},
      {"farfield.pixel_error", options.pixel_error},
      {"farfield.scene", options.scene.filename().string()},
      {"farfield.seed", fmt::format("{}", options.trace.seed)},
      {"farfield.spp", options.trace.samples_per_pixel},
  };
}

// With ids: whose they are.
Metadata frame_metadata(const RenderOptions& options, const GltfScene& scene, const Camera& camera, int frame,
                        std::span<const GltfInstance> instances, const MaterialNames& names) {
  Metadata metadata = frame_metadata(options, scene, camera, frame);
  if (!options.cryptomatte) return metadata;
  metadata.merge(cryptomatte_metadata(id_layer_name(IdLayer::Object), names_of_objects(instances)));
  metadata.merge(cryptomatte_metadata(id_layer_name(IdLayer::Material), names_of_materials(instances, names)));
  return metadata;
}

/// When the shutter is open: evenly spaced times, the frame's own in the middle, in seconds. Between two of them what
/// moves goes straight.
std::vector<double> shutter_times(const GltfScene& scene, double shutter, int frame) {
  constexpr int kSegments = 4;
  if (!(shutter > 0)) return {scene.seconds_of_frame(frame)};
  std::vector<double> times;
  for (int i = 0; i <= kSegments; ++i) {
    times.push_back(scene.seconds_of_frame(frame + shutter * (static_cast<double>(i) / kSegments - 0.5)));
  }
  return times;
}

using Keys = std::vector<std::vector<GltfInstance>>;  // per time of the open shutter

bool same_instances(std::span<const GltfInstance> a, std::span<const GltfInstance> b) {
  return std::ranges::equal(a, b, {}, &GltfInstance::mesh, &GltfInstance::mesh);
}

bool same_places(std::span<const GltfInstance> a, std::span<const GltfInstance> b) {
  return std::ranges::equal(a, b, {}, &GltfInstance::to_world, &GltfInstance::to_world);
}

/// The instances of one frame after the other. Those of a scene where none moves are the scene's own: a copy of a
/// million takes as much as many an asset.
class PlacedInstances {
 public:
  explicit PlacedInstances(const GltfScene& scene) : scene_(scene), do_move_(scene.do_instances_move()) {}

  /// In the middle of the open shutter.
  std::span<const GltfInstance> get() const {
    return do_move_ ? std::span(keys_[keys_.size() / 2]) : std::span(scene_.instances);
  }
  /// At the times of the open shutter; none if nothing ever moves.
  const Keys& keys() const { return keys_; }
  enum class Change { None, Places, Instances };
  /// What is different from before: nothing, where they stand, or which there are. Where some come or go while the
  /// shutter is open, all stand as they do in the middle, and it is said.
  Change move_to(std::span<const double> times, const RenderOptions& options) {
    if (!do_move_) return Change::None;
    if (keys_.size() != times.size()) keys_.assign(times.size(), {});  // the first frame, or the one before had no blur
    std::vector<Change> changes;
    for (size_t i = 0; i < times.size(); ++i) {
      scene_.place_at(times[i], next_, of_nodes_);
      changes.push_back(!same_instances(next_, keys_[i]) ? Change::Instances
                        : !same_places(next_, keys_[i])  ? Change::Places
                                                         : Change::None);
      keys_[i].swap(next_);
    }
    if (next_.empty()) next_ = keys_.front();  // takes all memory for good, before assets do
    if (!std::ranges::all_of(keys_, [&](const auto& key) { return same_instances(key, keys_.front()); })) {
      const size_t middle = keys_.size() / 2;
      keys_ = {std::move(keys_[middle])};
      changes = {changes[middle]};
      options.warning("no motion blur of instances in frames in which some appear or vanish");
    }
    return *std::ranges::max_element(changes);
  }

 private:
  const GltfScene& scene_;
  bool do_move_;
  Keys keys_;
  std::vector<GltfInstance> next_;    // to work in
  std::vector<glm::dmat4> of_nodes_;  // too
};

void report_problems(const RenderOptions& options, const FrameReport& frame) {
  if (options.warning && frame.invalid_samples > 0)
    options.warning(
        fmt::format("frame {}: {} paths were not finite and are black", frame.frame, frame.invalid_samples));
}

bool any_has_textures(const std::vector<std::filesystem::path>& folders) {
  return std::ranges::any_of(folders, [](const std::filesystem::path& folder) {
    const auto manifest = read_manifest(folder);  // what is wrong with it the session says
    return manifest && !manifest->textures.empty();
  });
}

}  // namespace

Result<std::unique_ptr<FrameRenderer>> FrameRenderer::prepare(const RenderOptions& given) {
  if (given.width < 1 || given.height < 1 || given.width > kLargestSide || given.height > kLargestSide)
    return make_error(ErrorCode::InvalidArgument, fmt::format("images of {} x {} pixels: 1 to {} each way", given.width,
                                                              given.height, kLargestSide));
  std::unique_ptr<FrameRenderer> renderer(new FrameRenderer);
  renderer->warnings_ = std::make_shared<WarningLog>(given.warning);
  renderer->options_ = given;
  renderer->options_.warning = [log = renderer->warnings_](const std::string& line) { log->add(line); };
  const RenderOptions& options = renderer->options_;

  if (!is_volume_file(options.scene) && !canonical_text(options.fog).empty())
    options.warning("flags of volumes are for a volume alone; a scene's nodes say theirs (docs/scene_format.md)");
  FARFIELD_TRY_LET(auto scene, read_scene(options.scene, {options.assemblies, options.fog, options.tile_triangles}));
  for (const std::string& warning : scene.warnings) options.warning(warning);  // before an error may come
  FARFIELD_TRY_LET(const auto camera, find_camera(scene, options.camera));
  renderer->camera_ = camera;
  if (options.frames_per_second > 0) scene.frames_per_second = options.frames_per_second;
  std::vector<std::string> of_lights;
  FARFIELD_TRY_LET(auto lights, make_lights(scene, options, of_lights));
  for (const std::string& warning : of_lights) options.warning(warning);

  FARFIELD_TRY_LET(auto folders, find_or_bake_assets(scene, options));
  for (size_t mesh = 0; mesh < folders.size(); ++mesh)
    if (!folders[mesh].empty()) renderer->asset_names_.push_back(scene.meshes[mesh].asset_name);
  if (options.cryptomatte) {
    FARFIELD_TRY_LET(auto names, read_material_names(folders));
    renderer->material_names_ = std::move(names);
  }
  renderer->fingerprint_ = make_fingerprint(options, folders);
  renderer->scene_ = std::move(scene);
  renderer->lights_ = std::move(lights);
  renderer->asset_folders_ = std::move(folders);
  return renderer;
}

Result<PixelReport> FrameRenderer::explain(int frame, int x, int y) {
  constexpr int kRays = 1024;
  FARFIELD_TRY_LET(auto device, make_embree_device(thread_count()));
  const double seconds = scene_.seconds_of_frame(frame);
  PlacedInstances instances(scene_);
  instances.move_to(std::span(&seconds, 1), options_);
  FARFIELD_TRY_LET(const auto session,
                   RenderSession::open(device.get(), options_, asset_folders_, instances.get(), material_names_));
  const Camera camera = make_camera(scene_, camera_, seconds, options_.width, options_.height);
  PixelReport report;
  report.frame = frame, report.x = x, report.y = y;
  report.width = options_.width, report.height = options_.height;
  report.rays = kRays;
  FARFIELD_TRY(session->explain(camera, options_, asset_names_, instances.get(), report));
  return report;
}

Result<RenderReport> FrameRenderer::render(std::span<const int> frames, const FrameSink& sink) {
  // Everything of ours first, assets last: see warm_up.h.
  Film film(options_.width, options_.height, {.ids = options_.cryptomatte});
  // As many threads as parallel_for uses: a default device would lift a limit on them.
  FARFIELD_TRY_LET(auto device, make_embree_device(thread_count()));
  FARFIELD_TRY(warm_up(device.get(), film.image(), any_has_textures(asset_folders_)));
  PlacedInstances instances(scene_);
  std::vector<double> times = shutter_times(scene_, options_.shutter, frames.front());
  PlacedInstances::Change change = instances.move_to(times, options_);

  RenderReport report;
  report.assets = asset_names_;
  report.budget_bytes = options_.budget_bytes;
  report.baseline_rss_bytes = resident_set_bytes();
  const PeakMemory memory;

  const auto cameras_at = [&](std::span<const double> at) {
    std::vector<Camera> cameras;
    for (const double seconds : at)
      cameras.push_back(make_camera(scene_, camera_, seconds, options_.width, options_.height));
    return cameras;
  };
  std::unique_ptr<RenderSession> session;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (i > 0) {
      malloc_trim(0);  // what writing the last frame left in the heap is not the assets'
      times = shutter_times(scene_, options_.shutter, frames[i]);
      change = instances.move_to(times, options_);
    }
    if (!session || change == PlacedInstances::Change::Instances) {
      session.reset();  // before the next one, so that two never share the budget
      FARFIELD_TRY_LET(auto opened,
                       RenderSession::open(device.get(), options_, asset_folders_, instances.get(), material_names_));
      session = std::move(opened);
      if (instances.keys().size() > 1) FARFIELD_TRY(session->move(instances.keys()));
    } else if (change == PlacedInstances::Change::Places) {
      FARFIELD_TRY(session->move(instances.keys()));
    }

    const std::vector<Camera> cameras = cameras_at(times);
    const bool is_last = i + 1 == frames.size();
    const std::vector<Camera> next =
        is_last ? std::vector<Camera>() : cameras_at(shutter_times(scene_, options_.shutter, frames[i + 1]));
    const auto done_after = [&](size_t count) {
      return static_cast<double>(count) / static_cast<double>(frames.size());
    };
    const Job job = options_.job.step(fmt::format("frame {} ({}/{})", frames[i], i + 1, frames.size()), done_after(i),
                                      done_after(i + 1));
    FARFIELD_TRY_LET(auto frame, session->render({cameras, next}, lights_, options_, film, job));
    frame.frame = frames[i];
    report_problems(options_, frame);
    report.frames.push_back(std::move(frame));
    report.peak_accounted_bytes = std::max(report.peak_accounted_bytes, session->stats().peak_accounted_bytes);
    report.peak_rss_bytes = memory.peak_bytes();
    report.warnings = warnings_->lines();
    const Camera& middle = cameras[cameras.size() / 2];
    const Metadata metadata = frame_metadata(options_, scene_, middle, frames[i], instances.get(), material_names_);
    if (auto taken = sink(film.image(), metadata, report); !taken) return tl::unexpected(taken.error());
  }
  report.peak_rss_bytes = memory.peak_bytes();
  for (const auto& notice : {budget_notice(report), morph_notice(report)})
    if (notice) options_.warning(*notice);
  report.warnings = warnings_->lines();
  return report;
}

}  // namespace farfield
