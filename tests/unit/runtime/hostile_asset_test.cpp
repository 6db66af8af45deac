// SPDX-License-Identifier: Apache-2.0
// Assets of which any byte may have changed, seen by rays: a refusal or a level that is left out, said in one line, or
// a picture; never a crash, and never more memory than the budget. Half of the damage has its checksums made right, as
// somebody would who means harm.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "base/hash.h"
#include "base/random.h"
#include "cache/level_format.h"
#include "cache/manifest.h"
#include "farfield/runtime.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

using test::Host;

constexpr uint64_t kBudget = 24 << 20;

using Files = std::map<std::string, std::vector<std::byte>>;

Files read_files(const std::filesystem::path& folder) {
  Files files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = test::read_bytes(entry.path());
  }
  return files;
}

/// A few bytes become others, or the file ends early.
void damage(std::vector<std::byte>& bytes, Rng& rng) {
  if (rng.next_uint() % 16 == 0) bytes.resize(rng.next_uint() % bytes.size());
  const bool in_head = rng.next_uint() % 2 == 0;  // headers and tables are small: they get half of it
  const size_t range = std::min<size_t>(bytes.size(), in_head ? 1200 : bytes.size());
  for (uint32_t change = 0; range > 0 && change <= rng.next_uint() % 4; ++change) {
    const std::byte values[] = {std::byte{0}, std::byte{1}, std::byte{0x7f}, std::byte{0xff},
                                static_cast<std::byte>(rng.next_uint())};
    bytes[rng.next_uint() % range] = values[rng.next_uint() % 5];
  }
}

/// A digit of the manifest becomes another one.
void damage_number(std::vector<std::byte>& bytes, Rng& rng) {
  std::vector<size_t> digits;
  for (size_t i = 0; i < bytes.size(); ++i) {
    if (std::isdigit(static_cast<unsigned char>(bytes[i]))) digits.push_back(i);
  }
  for (uint32_t change = 0; change <= rng.next_uint() % 3; ++change) {
    const char other[] = "0123456789-.eE";
    bytes[digits[rng.next_uint() % digits.size()]] = static_cast<std::byte>(other[rng.next_uint() % 14]);
  }
}

/// Checksums and sizes that agree with what the files are now.
void make_right(Files& files) {
  std::vector<std::byte>& text = files["manifest.json"];
  // Without its own, so that it is not looked at.
  std::string json(reinterpret_cast<const char*>(text.data()), text.size());
  if (const size_t at = json.rfind(",\n  \"checksum\""); at != std::string::npos) json = json.substr(0, at) + "\n}\n";
  auto manifest = manifest_from_json(json, "damaged");
  if (manifest) {
    for (LevelEntry& level : manifest->levels) {
      const auto file = files.find(level.file);
      if (file == files.end()) continue;
      seal_head(file->second);
      level.file_hash = hash_bytes(file->second);
      level.file_bytes = file->second.size();
    }
    json = manifest_to_json(*manifest);
  }
  const auto bytes = std::as_bytes(std::span(json));
  text.assign(bytes.begin(), bytes.end());
}

/// What a host does with an asset. Returns whether it opened.
bool look_at(const std::filesystem::path& folder, Rng& rng) {
  RuntimeOptions options;
  options.budget_bytes = kBudget;
  if (rng.next_uint() % 2 == 0) options.blend = Blend::Morph;
  if (rng.next_uint() % 2 == 0) options.forced_lambda = 5.0f * rng.next();
  Host host(options);
  const auto asset = host.runtime().open_asset(folder.string());
  if (!asset) {
    EXPECT_EQ(asset.error().message.find('\n'), std::string::npos) << asset.error().message;
    return false;
  }
  EXPECT_TRUE(host.runtime().add_instance(*asset, mat4x3(1.0f)));
  host.runtime().set_cameras({{vec3(0, 0, 3 + 50 * rng.next()), 0.0f, 1e-3f}});
  if (!host.runtime().plan_frame()) return true;
  host.commit();
  for (int i = 0; i < 100; ++i) {
    RayContext context;
    context.ray_seed = rng.next_uint();
    context.path_seed = rng.next_uint();
    context.cone_spread = 0.02f * rng.next();
    const vec3 origin = 4.0f * test::random_unit(rng);
    EmbreeRayHit hit;
    if (!host.trace(origin, glm::normalize(test::random_unit(rng) - origin), context, hit)) continue;
    const Interaction interaction = host.interaction(hit, context);
    const ScatterSample sample = interaction.sample(rng);
    (void)interaction.eval(-interaction.wo, rng);
    (void)interaction.ray_origin(sample.wi);
  }
  EXPECT_LE(host.runtime().stats().peak_accounted_bytes, kBudget);
  EXPECT_LE(host.messages.size(), 12u);
  return true;
}

void expect_no_damage_reaches_rays(const std::vector<LevelData>& levels, int trials) {
  const test::TemporaryFolder folder;
  const auto sound = folder.path() / "sound.farfield", damaged = folder.path() / "damaged.farfield";
  test::write_asset(sound, levels);
  const Files whole = read_files(sound);
  std::filesystem::create_directories(damaged);
  std::vector<std::string> names;
  for (const auto& [name, bytes] : whole) names.push_back(name);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  trials = std::min(trials, 300);
#endif
  int opened = 0;
  for (int trial = 0; trial < trials; ++trial) {
    SCOPED_TRACE(trial);
    Rng rng(static_cast<uint64_t>(trial));
    Files files = whole;
    const std::string& name = names[rng.next_uint() % names.size()];
    const bool is_manifest = name == "manifest.json";
    if (is_manifest) {
      damage_number(files[name], rng);
    } else {
      damage(files[name], rng);
    }
    if (trial % 2 == 0) make_right(files);
    for (const auto& [file, bytes] : files) test::write_bytes(damaged / file, bytes);
    opened += look_at(damaged, rng);
  }
  EXPECT_GT(opened, trials / 8);
  EXPECT_LT(opened, trials * 7 / 8);
  ::testing::Test::RecordProperty("opened", opened);
}

TEST(HostileAsset, NoDamageReachesRays) { expect_no_damage_reaches_rays(test::white_sphere(16), 4000); }

/// Half of the file of level 0 is where its part stands.
TEST(HostileAsset, NoDamageOfPlacesReachesRays) {
  std::vector<LevelData> levels = test::white_sphere(6);
  LevelData& level = levels[0];
  level.part_first_quad = {static_cast<uint32_t>(level.quads.size()) / 2};
  Rng rng(1);
  for (int i = 0; i < 100; ++i) {
    PartPlacement placement;
    placement.level_to_part[3] = 0.5f * test::random_unit(rng);
    level.placements.push_back(placement);
  }
  level.header.bounds = {vec3(-1.5f), vec3(1.5f)};
  expect_no_damage_reaches_rays(levels, 1000);
}

}  // namespace
}  // namespace farfield
