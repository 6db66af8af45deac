// SPDX-License-Identifier: Apache-2.0
// Do levels pay in a scene? CPU time of frames with levels against full detail at equal samples, both open in one
// process, each frame rendered once to load what it needs and then by turns: medians, so that a busy machine slows both
// alike. For docs/results/scale.md. Assets must have been baked with these options.
//
//   build/release/bin/frame_figures SCENE.gltf ASSETS FINEST_GRID WIDTHxHEIGHT SPP ROUNDS FRAME...
//
// Mean: of the picture with levels, less that of full detail, red, green, blue. Rms: of the pixels' luminance, noise
// included; noise: the same between two full-detail pictures of other seeds.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "base/embree.h"
#include "base/parallel.h"
#include "base/process_time.h"
#include "base/result.h"
#include "import/read_scene.h"
#include "path_tracer/asset_library.h"
#include "path_tracer/render_session.h"
#include "path_tracer/scene_setup.h"

namespace farfield {
namespace {

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

vec3 color_of(const Image& image, int x, int y) {
  const float* pixel = image.pixel(x, y);
  return {pixel[0], pixel[1], pixel[2]};
}

dvec3 mean_of(const Image& image) {
  dvec3 sum(0.0);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) sum += dvec3(color_of(image, x, y));
  return sum / (static_cast<double>(image.width) * image.height);
}

/// Root of the mean squared difference in luminance, as a share of the mean luminance of b.
double rms(const Image& a, const Image& b) {
  double sum = 0, all = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const double of_a = luminance(color_of(a, x, y)), of_b = luminance(color_of(b, x, y));
      sum += (of_a - of_b) * (of_a - of_b);
      all += of_b;
    }
  }
  const double pixels = static_cast<double>(a.width) * a.height;
  return std::sqrt(sum / pixels) / (all / pixels);
}

/// A scene rendered one way.
struct Way {
  RenderOptions options;
  std::unique_ptr<RenderSession> session;
  std::vector<double> cpu;  ///< of the frame at hand
  FrameReport last;

  Result<void> open(EmbreeDeviceRef device, const GltfScene& scene) {
    FARFIELD_TRY_LET(const auto folders, find_or_bake_assets(scene, options));
    const double before = process_cpu_seconds();
    FARFIELD_TRY_LET(session, RenderSession::open(device, options, folders, scene.instances, {}));
    fmt::print(stderr, "opened in {:.1f} CPU s\n", process_cpu_seconds() - before);
    return {};
  }
  Result<Image> render(const Camera& camera, const Lights& lights, uint64_t seed) {
    RenderOptions seeded = options;
    seeded.trace.seed = seed;
    Film film(options.width, options.height);
    const double before = process_cpu_seconds();
    FARFIELD_TRY_LET(last, session->render({{&camera, 1}, {}}, lights, seeded, film, {}));
    cpu.push_back(process_cpu_seconds() - before);
    return film.image();
  }
};

Result<void> measure_frame(Way& levels, Way& full, const Camera& camera, const Lights& lights, int frame, int rounds) {
  FARFIELD_TRY_LET(const Image with_levels, levels.render(camera, lights, 1));
  FARFIELD_TRY_LET(const Image with_all, full.render(camera, lights, 1));
  FARFIELD_TRY_LET(const Image again, full.render(camera, lights, 2));
  levels.cpu.clear(), full.cpu.clear();
  for (int round = 0; round < rounds; ++round) {
    FARFIELD_TRY(levels.render(camera, lights, 1));
    FARFIELD_TRY(full.render(camera, lights, 1));
  }
  const double of_levels = median(levels.cpu), of_full = median(full.cpu);
  const dvec3 bias = 100.0 * (mean_of(with_levels) / mean_of(with_all) - 1.0);
  const auto mib = [](uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); };
  fmt::print(
      "| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} / {:.2f} | {:.1f} | {:.0f} | {:+.1f} {:+.1f} {:+.1f} | {:.1f} | {:.1f} "
      "|\n",
      frame, of_levels, of_full, of_levels / of_full, static_cast<double>(levels.last.rays) / 1e6,
      static_cast<double>(full.last.rays) / 1e6, mib(levels.last.accounted_bytes), mib(full.last.accounted_bytes),
      bias.x, bias.y, bias.z, 100 * rms(with_levels, with_all), 100 * rms(again, with_all));
  std::fflush(stdout);
  return {};
}

Result<void> measure(const RenderOptions& options, int rounds, const std::vector<int>& frames) {
  FARFIELD_TRY_LET(const auto scene,
                   read_scene(options.scene, {options.assemblies, options.fog, options.tile_triangles}));
  std::vector<std::string> ignored;
  FARFIELD_TRY_LET(const auto lights, make_lights(scene, options, ignored));
  FARFIELD_TRY_LET(const auto device, make_embree_device(thread_count()));
  Way levels{options, nullptr, {}, {}}, full{options, nullptr, {}, {}};
  full.options.full_detail = true;
  FARFIELD_TRY(levels.open(device.get(), scene));
  FARFIELD_TRY(full.open(device.get(), scene));
  fmt::print(
      "| frame | levels, CPU s | full detail, CPU s | ratio | M rays | levels, MiB | full detail, MiB | mean, % | rms, "
      "% "
      "| noise, % |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int frame : frames) {
    const Camera camera = make_camera(scene, 0, scene.seconds_of_frame(frame), options.width, options.height);
    FARFIELD_TRY(measure_frame(levels, full, camera, lights, frame, rounds));
  }
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  farfield::RenderOptions options;
  if (argc < 8 || std::sscanf(argv[4], "%dx%d", &options.width, &options.height) != 2) {
    fmt::print(stderr, "usage: frame_figures SCENE.gltf ASSETS FINEST_GRID WIDTHxHEIGHT SPP ROUNDS FRAME...\n");
    return 2;
  }
  options.scene = argv[1];
  options.assets = argv[2];
  options.finest_grid = static_cast<uint32_t>(std::atoi(argv[3]));
  options.trace.samples_per_pixel = std::atoi(argv[5]);
  options.budget_bytes = uint64_t{64} << 30;
  options.baker = "/bin/false";  // nothing is baked here
  options.warning = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  std::vector<int> frames;
  for (int i = 7; i < argc; ++i) frames.push_back(std::atoi(argv[i]));
  const auto done = farfield::measure(options, std::max(1, std::atoi(argv[6])), frames);
  if (!done) fmt::print(stderr, "frame_figures: {}\n", done.error().message);
  return done ? 0 : 1;
}
