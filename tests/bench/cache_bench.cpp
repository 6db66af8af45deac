// SPDX-License-Identifier: Apache-2.0
// What does it cost to trust a level file, by structure and in full, against reading its bytes into memory? And what
// does a ray pay to borrow a level that is resident? Files are warm (in the page cache). Run with
//   --benchmark_repetitions=9 --benchmark_enable_random_interleaving --benchmark_report_aggregates_only
#include <benchmark/benchmark.h>

#include "base/file_io.h"
#include "cache/level_file.h"
#include "cache/residency.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

/// A level of about 60 MB, half surface, half volume.
const std::filesystem::path& level_path() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    const auto file = folder.path() / "level.ffl";
    if (!write_level(file, test::random_level(1, 600000, 40000))) std::abort();
    return file;
  }();
  return path;
}

void open_level(benchmark::State& state, LevelCheck check) {
  uint64_t bytes = 0;
  for (auto _ : state) {
    const auto file = LevelFile::open(level_path(), check);
    if (!file) return state.SkipWithError("the level does not open");
    bytes += (*file)->file_bytes();
  }
  state.SetBytesProcessed(static_cast<int64_t>(bytes));
}

/// The baseline: reading the file into memory.
void read_into_memory(benchmark::State& state) {
  uint64_t bytes = 0;
  for (auto _ : state) {
    const Result<std::string> file = read_small_file(level_path(), uint64_t{1} << 30);
    if (!file) return state.SkipWithError("the level cannot be read");
    benchmark::DoNotOptimize(file->data());
    bytes += file->size();
  }
  state.SetBytesProcessed(static_cast<int64_t>(bytes));
}

void acquire_ready(benchmark::State& state) {
  ResidentSet set(1000);
  const size_t item = set.add({1, 0, [](const LoadTerms&) { return LoadedItem{std::make_unique<Resident>(), 1, 0}; }});
  if (set.acquire(item) == nullptr) return state.SkipWithError("the item does not load");
  for (auto _ : state) benchmark::DoNotOptimize(set.acquire(item));
}

BENCHMARK(read_into_memory)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(open_level, structure, LevelCheck::Structure)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(open_level, full, LevelCheck::Full)->Unit(benchmark::kMillisecond);
BENCHMARK(acquire_ready);

}  // namespace
}  // namespace farfield

BENCHMARK_MAIN();
