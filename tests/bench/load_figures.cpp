// SPDX-License-Identifier: Apache-2.0
// What does a load of a level spend its CPU time on: reading, hashing, checking, the hull, the BVH? For
// docs/results/scale.md. One thread, warm files, medians of interleaved repeats; a table of sums over the levels.
//
//   build/release/bin/load_figures REPEATS ASSETS     every folder below ASSETS that has a manifest
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/result.h"
#include "bvh/bvh_device.h"
#include "bvh/traced_asset.h"
#include "cache/hull_check.h"
#include "cache/level_check.h"
#include "cache/level_file.h"
#include "cache/manifest.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

enum Part { kOpen, kHash, kStructure, kValues, kHull, kBvh, kRelease, kPartCount };
using Times = std::array<double, kPartCount>;

double thread_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class Stopwatch {
 public:
  double lap() {
    const double now = thread_seconds();
    return now - std::exchange(last_, now);
  }

 private:
  double last_ = thread_seconds();
};

/// What of open_known() is not reading is done once more, to be told apart.
Result<Times> time_load(const fs::path& path, const LevelEntry& entry, const Manifest& manifest, BvhDevice& device) {
  Times times{};
  Stopwatch watch;
  FARFIELD_TRY_LET(auto file, LevelFile::open_known(path, entry.file_bytes, entry.file_hash));
  times[kOpen] = watch.lap();
  if (hash_bytes(file->bytes()) != entry.file_hash) std::abort();
  times[kHash] = watch.lap();
  if (find_structure_problem(file->view())) std::abort();
  times[kStructure] = watch.lap();
  if (find_value_problem(file->view())) std::abort();
  times[kValues] = watch.lap();
  const std::vector<vec3> hull(manifest.hull.begin(), manifest.hull.end());
  if (reach_out_of_hull(file->view(), hull) > hull_slack(manifest.bounds)) std::abort();
  times[kHull] = watch.lap();
  FARFIELD_TRY_LET(auto traced, TracedLevel::build(device, file->view(), 0, nullptr));
  times[kBvh] = watch.lap();
  file->release_build_pages();
  traced.reset();
  file.reset();
  times[kRelease] = watch.lap();
  return times;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

Result<void> run(int repeats, const fs::path& assets) {
  FARFIELD_TRY_LET(const auto device, BvhDevice::create());
  std::array<std::vector<double>, kPartCount> sums;
  uint64_t bytes = 0, quads = 0;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    Times sum{};
    bytes = quads = 0;
    for (const fs::directory_entry& found : fs::recursive_directory_iterator(assets)) {
      if (found.path().filename() != kManifestName) continue;
      const fs::path folder = found.path().parent_path();
      FARFIELD_TRY_LET(const auto manifest, read_manifest(folder));
      for (const LevelEntry& entry : manifest.levels) {
        FARFIELD_TRY_LET(const auto times, time_load(folder / entry.file, entry, manifest, *device));
        for (size_t part = 0; part < kPartCount; ++part) sum[part] += times[part];
        bytes += entry.file_bytes;
        quads += entry.triangles / 2;
      }
    }
    for (size_t part = 0; part < kPartCount; ++part) sums[part].push_back(sum[part]);
  }
  std::array<double, kPartCount> ms;
  for (size_t part = 0; part < kPartCount; ++part) ms[part] = 1e3 * median(sums[part]);
  const double read = ms[kOpen] - ms[kHash] - ms[kStructure] - ms[kValues];
  fmt::print(
      "{:.1f} MB, {:.2f} M pairs of triangles; ms: read {:.0f}, hash {:.0f}, structure {:.0f}, values {:.0f}, "
      "hull {:.0f}, BVH {:.0f}, give back {:.0f}\n",
      1e-6 * static_cast<double>(bytes), 1e-6 * static_cast<double>(quads), read, ms[kHash], ms[kStructure],
      ms[kValues], ms[kHull], ms[kBvh], ms[kRelease]);
  return {};
}

}  // namespace
}  // namespace farfield

int main(int count, char** arguments) {
  if (count != 3) return fmt::print(stderr, "load_figures REPEATS ASSETS\n"), EXIT_FAILURE;
  const auto done = farfield::run(std::max(1, std::atoi(arguments[1])), arguments[2]);
  if (!done) fmt::print(stderr, "load_figures: {}\n", done.error().message);
  return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
