// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/warm_up.h"

#include <fmt/format.h>
#include <malloc.h>

#include <filesystem>

#include "base/file_io.h"
#include "base/result.h"
#include "base/temporary_file.h"
#include "base/texture_module.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "path_tracer/integrator.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

constexpr int kSheetQuads = 48;  ///< along a side of the sheet that stands for the surface
constexpr int kBricks = 3;       ///< along a side of the cube that stands for the volume
constexpr float kSize = 1.0f;    ///< of both
constexpr uint64_t kBudget = 64 << 20;

// A wavy sheet with every channel that a surface can have.
void add_sheet(LevelData& level) {
  const auto row = static_cast<uint32_t>(kSheetQuads + 1);
  for (uint32_t y = 0; y < row; ++y) {
    for (uint32_t x = 0; x < row; ++x) {
      const float u = static_cast<float>(x) / kSheetQuads, v = static_cast<float>(y) / kSheetQuads;
      level.positions.push_back(kSize * vec3(u, 0.5f + 0.2f * std::sin(9 * u) * std::sin(7 * v), v));
    }
  }
  for (uint32_t y = 0; y < kSheetQuads; ++y) {
    for (uint32_t x = 0; x < kSheetQuads; ++x) {
      const uint32_t corner = y * row + x;
      level.quads.push_back({corner, corner + 1, corner + row + 1, corner + row});
      level.quad_first_face.push_back(2 * static_cast<uint32_t>(level.quads.size() - 1));
    }
  }
  const size_t faces = 2 * level.quads.size();
  level.face_diffuse.assign(faces, pack_color(vec3(0.5f)));
  level.face_specular.assign(faces, pack_color(vec3(0.04f)));
  level.face_roughness2.assign(faces, pack_unorm8(0.3f));
  level.face_transmission.assign(faces, pack_color(vec3(0.2f)));
}

// A cube of haze with every channel that a volume can have.
void add_haze(LevelData& level) {
  level.header.brick_dims = ivec3(kBricks);
  uint32_t payloads = 0;
  for (uint32_t i = 0; i < kBricks * kBricks * kBricks; ++i) {
    Brick brick{};
    brick.mask.fill(~uint64_t{0});
    for (size_t word = 0; word < 8; ++word) brick.prefix[word] = static_cast<uint16_t>(64 * word);
    brick.density.fill(128);
    brick.density_scale = 4.0f;
    brick.payload_base = payloads;
    payloads += kBrickVoxels;
    level.brick_table.push_back(i);
    level.bricks.push_back(brick);
  }
  level.voxel_sggx.assign(payloads, pack_flake_sggx(SymMat3::identity()));
  level.voxel_diffuse.assign(payloads, pack_color(vec3(0.5f)));
  level.voxel_specular.assign(payloads, pack_color(vec3(0.04f)));
  level.voxel_roughness2.assign(payloads, pack_unorm8(0.3f));
  level.voxel_self_shadowing.assign(payloads, pack_unorm8(0.8f));
}

// A texture over all of the sheet, and the material that has it.
Result<void> add_texture(const fs::path& folder, Manifest& manifest) {
  AssetTexture texture;
  texture.file = "texture_0.tif";
  texture.width = texture.height = 64;
  texture.channels = 3;
  texture.cache_bytes = 64 * 64 * 6;
  FARFIELD_TRY_LET(const TextureModule* module, texture_module());
  const MipLevel level{64, 64, std::vector<uint16_t>(64 * 64 * 3, 0x8000)};
  FARFIELD_TRY(module->write_mip_map((folder / texture.file).string(), {&level, 1}, 3, false));
  manifest.textures.push_back(texture);
  manifest.materials.emplace_back().base_color_map.texture = 0;
  return {};
}

void add_coordinates(LevelData& level) {
  for (const Quad& quad : level.quads) {
    level.corner_vertex.push_back(quad.face(0));
    level.corner_vertex.push_back(quad.face(1));
  }
  for (const vec3& position : level.positions) level.shading_uv.emplace_back(position.x, position.z);
}

Result<LevelEntry> write_warm_up_level(const fs::path& folder, uint32_t number, bool with_textures) {
  LevelData level;
  const float resolution = kSize / (kBricks * kBrickSide) * std::exp2(static_cast<float>(number) - 1.0f);
  level.header.level = number;
  level.header.resolution = resolution;
  level.header.bounds = {vec3(0.0f), vec3(kSize)};
  add_sheet(level);
  if (number == 0 && with_textures) add_coordinates(level);
  if (number == 1) add_haze(level);

  LevelEntry entry;
  entry.level = number;
  entry.resolution = static_cast<double>(resolution);
  entry.grid = static_cast<uint32_t>(std::lround(kSize / resolution));
  entry.file = fmt::format("level_{:02}.bin", number);
  FARFIELD_TRY_LET(const auto bytes, write_level(folder / entry.file, level));
  FARFIELD_TRY_LET(const auto hash, hash_file(folder / entry.file));
  entry.file_bytes = bytes;
  entry.file_hash = hash;
  entry.triangles = face_count(level);
  entry.voxels = voxel_count(level);
  entry.bricks = level.bricks.size();
  entry.resident_bytes = 4 * bytes;  // far below kBudget, and no less than it takes
  return entry;
}

Result<void> write_warm_up_asset(const fs::path& folder, bool with_textures) {
  Manifest manifest;
  manifest.generator = "warm-up";
  manifest.source = "none";
  manifest.bounds = {vec3(0.0f), vec3(kSize)};
  manifest.base_resolution = static_cast<double>(0.5f * kSize / (kBricks * kBrickSide));
  for (int corner = 0; corner < 8; ++corner)
    manifest.hull.push_back(kSize * vec3(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1));
  for (uint32_t number = 0; number < 2; ++number) {
    FARFIELD_TRY_LET(auto entry, write_warm_up_level(folder, number, with_textures));
    manifest.levels.push_back(entry);
  }
  if (with_textures) FARFIELD_TRY(add_texture(folder, manifest));
  return write_manifest(folder, manifest);
}

// From near and from far, which shows both levels.
Result<void> trace_twice(Runtime& runtime, EmbreeSceneRef scene, const Lights& lights, Film& film) {
  TraceOptions trace;
  trace.samples_per_pixel = 4;
  for (const float distance : {1.5f, 10.0f}) {
    const vec3 forward = glm::normalize(vec3(-1.0f));
    const Camera camera = Camera::perspective(vec3(0.5f * kSize) - kSize * distance * forward, forward,
                                              vec3(0.0f, 1.0f, 0.0f), 1.0f / distance, film.width(), film.height());
    runtime.set_cameras({camera.tessellation()});
    FARFIELD_TRY(runtime.plan_frame());
    runtime.prefetch();
    if (auto result = path_trace({scene, &runtime, &lights}, camera, trace, film); !result)
      return tl::unexpected(result.error());
  }
  return {};
}

// Under a light with a disc, in scenes of every kind that a session builds: Embree's code for each is some 500 KB.
Result<void> trace_warm_up_asset(EmbreeDeviceRef device, const fs::path& folder) {
  RuntimeOptions options;
  options.budget_bytes = kBudget;
  FARFIELD_TRY_LET(auto runtime, Runtime::create(device, options));
  FARFIELD_TRY_LET(const auto asset, runtime->open_asset(folder.string()));
  FARFIELD_TRY_LET(const auto instance, runtime->add_instance(asset, mat4x3(1.0f)));
  Lights lights;
  lights.environment = Environment::sun_sky({});
  Film film(64, 64), few_rays(8, 8);
  for (const bool moves : {false, true}) {
    if (moves) FARFIELD_TRY(runtime->move_instance(instance, {mat4x3(1.0f), mat4x3(1.01f)}));
    for (const bool is_small : {true, false}) {
      FARFIELD_TRY_LET(const auto scene, make_scene(device, *runtime, is_small));
      FARFIELD_TRY(trace_twice(*runtime, scene.get(), lights, moves || is_small ? few_rays : film));
    }
  }
  return {};
}

Result<void> write_images(const fs::path& folder, const Image& frame) {
  FARFIELD_TRY(write_exr(folder / "frame.exr", frame));
  return write_png(folder / "frame.png", frame);
}

}  // namespace

Result<void> warm_up(EmbreeDeviceRef device, const Image& frame, bool with_textures) {
  FARFIELD_TRY_LET(auto folder, TemporaryFolder::create());
  FARFIELD_TRY(write_warm_up_asset(folder.path(), with_textures));
  FARFIELD_TRY(trace_warm_up_asset(device, folder.path()));
  FARFIELD_TRY(write_images(folder.path(), frame));
  // Once more after the trim: what the writers need stays with the process, as it does between frames.
  malloc_trim(0);
  return write_images(folder.path(), frame);
}

}  // namespace farfield
