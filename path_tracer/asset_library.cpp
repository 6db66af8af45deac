// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/asset_library.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "bake/bake.h"
#include "base/parallel.h"
#include "base/result.h"
#include "cache/manifest.h"
#include "path_tracer/child_process.h"
#include "path_tracer/scene_assets.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

constexpr int kBakeFailed = 1;  // exit code of `farfield bake` that says why on standard error

// "forest" for forest.glb, forest.gltf, forest.glb.gz.
std::string scene_name(const fs::path& scene) {
  fs::path name = scene.filename();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

SceneBakeOptions scene_bake_options(const RenderOptions& options) {
  SceneBakeOptions bake;
  bake.scene = options.scene;
  bake.library = asset_library_folder(options);
  bake.finest_grid = options.finest_grid;
  bake.rays_per_voxel = options.rays_per_voxel;
  bake.source_only = options.full_detail;
  bake.read = {options.assemblies, options.fog, options.tile_triangles};
  bake.downsampling = options.downsampling;
  bake.subdivision = options.subdivision;
  return bake;
}

// What `farfield bake` is told of a volume: the flags of tools/fog_flags.h.
void add_fog_flags(const FogOptions& fog, std::vector<std::string>& command) {
  const auto add = [&](const char* flag, const std::string& value) {
    command.push_back(fmt::format("{}={}", flag, value));  // a value may start with a minus
  };
  if (!fog.density_grid.empty()) add("--density-grid", fog.density_grid);
  if (fog.density_scale != 1) add("--density-scale", fmt::format("{}", fog.density_scale));
  if (fog.albedo) add("--albedo", fmt::format("{},{},{}", fog.albedo->x, fog.albedo->y, fog.albedo->z));
  if (fog.anisotropy != 0) add("--anisotropy", fmt::format("{}", fog.anisotropy));
  if (fog.fibre_roughness != kFibreRoughness) add("--fibre-roughness", fmt::format("{}", fog.fibre_roughness));
  if (fog.level_set) command.push_back("--level-set");
}

// The same of cages and displacement: the flags of tools/subdivision_flags.h.
void add_subdivision_flags(const SubdivisionOptions& subdivision, std::vector<std::string>& command) {
  if (canonical_text(subdivision).empty()) return;
  const auto add = [&](const char* flag, const std::string& value) {
    command.push_back(flag);
    command.push_back(value);
  };
  add("--subdivide", name_of(subdivision.scheme));
  add("--subdivide-error", fmt::format("{}", subdivision.error));
  add("--subdivide-edge", fmt::format("{}", subdivision.edge));
  add("--displace-detail", fmt::format("{}", subdivision.detail));
  if (!subdivision.displace) command.push_back("--no-displacement");
  if (subdivision.boundary) add("--subdivide-boundary", name_of(*subdivision.boundary));
  if (subdivision.uv) add("--subdivide-uv", name_of(*subdivision.uv));
}

std::vector<std::string> bake_command(const RenderOptions& options, const SceneBakeOptions& bake) {
  std::vector<std::string> command = {options.baker.empty() ? this_program() : options.baker.string(),
                                      "bake",
                                      bake.scene.string(),
                                      "--scene",
                                      "-o",
                                      bake.library.string(),
                                      "--finest-grid",
                                      fmt::format("{}", bake.finest_grid),
                                      "--rays-per-voxel",
                                      fmt::format("{}", bake.rays_per_voxel),
                                      "--assemblies",
                                      name_of(bake.read.assemblies),
                                      "--tile-triangles",
                                      fmt::format("{}", bake.read.tile_triangles),
                                      "--downsampling",
                                      name_of(bake.downsampling),
                                      "--threads",
                                      fmt::format("{}", thread_count()),
                                      "--parent",
                                      fmt::format("{}", ::getpid()),
                                      "--no-warnings"};  // said here, from the manifests
  if (bake.source_only) command.push_back("--source-only");
  add_fog_flags(bake.read.fog, command);
  add_subdivision_flags(bake.subdivision, command);
  return command;
}

struct ReadyAsset {
  fs::path folder;
  Manifest manifest;
};

// The asset of a mesh, if it is up to date. For full detail the one with all levels will do: its level 0 is the same.
std::optional<ReadyAsset> find_ready(const SceneBakeOptions& bake, const GltfScene& scene, size_t mesh,
                                     FileHashes& hashes) {
  const fs::path folder = asset_folder(bake, scene.meshes[mesh]);
  if (auto found = find_up_to_date(asset_source(bake, scene.meshes[mesh]), folder,
                                   asset_bake_options(bake, scene, mesh, hashes)))
    return ReadyAsset{folder, std::move(*found)};
  if (!bake.source_only) return std::nullopt;
  SceneBakeOptions whole = bake;
  whole.source_only = false;
  return find_ready(whole, scene, mesh, hashes);
}

void warn(const RenderOptions& options, const std::string& line) {
  if (options.warning) options.warning(line);
}

// What a bake warned of is as true of the picture, now and at each later run.
void repeat_warnings(const RenderOptions& options, const GltfMesh& mesh, const Manifest& manifest) {
  for (const std::string& warning : manifest.warnings)
    warn(options, fmt::format("mesh {}: {}", mesh.asset_name, warning));
}

// "asset 3 \"maple\"", or the scene itself if nothing tells which asset it was.
std::string what_was_baked(const GltfScene& scene, const std::string& asset) {
  const auto mesh = std::ranges::find(scene.meshes, asset, &GltfMesh::asset_name);
  if (mesh == scene.meshes.end()) return "its assets";
  return fmt::format("mesh {} \"{}\"", mesh - scene.meshes.begin(), mesh->name);
}

// What the bake says of the assets, line by line: "baking NAME", then "ready NAME" or "failed NAME".
struct BakeNews {
  std::string at;  ///< the asset that it works on
  std::map<std::string, bool> is_ready;

  void read(std::string_view line) {
    const size_t blank = std::min(line.find(' '), line.size());
    const std::string_view what = line.substr(0, blank);
    const std::string asset(line.substr(std::min(blank + 1, line.size())));
    if (what == "baking") at = asset;
    if (what == "ready" || what == "failed") is_ready[asset] = what == "ready";
  }
};

// Bakes all that is missing in a process of its own. Errors: Io, BadFile, Cancelled.
Result<BakeNews> bake_in_a_process(const GltfScene& scene, const RenderOptions& options, const SceneBakeOptions& bake) {
  BakeNews news;
  FARFIELD_TRY_LET(const int status, run_child(bake_command(options, bake), options.job,
                                               [&](std::string_view line) { news.read(line); }));
  if (WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == kBakeFailed)) return news;
  if (options.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return make_error(ErrorCode::BadFile, fmt::format("{}: baking {} failed ({})", options.scene.string(),
                                                    what_was_baked(scene, news.at), how_it_ended(status)));
}

}  // namespace

fs::path asset_library_folder(const RenderOptions& options) {
  const fs::path root =
      options.assets.empty() ? options.scene.parent_path() / "farfield-assets" : fs::path(options.assets);
  return root / scene_name(options.scene);
}

Result<std::vector<fs::path>> find_or_bake_assets(const GltfScene& scene, const RenderOptions& options) {
  const SceneBakeOptions bake = scene_bake_options(options);
  std::error_code error;
  fs::create_directories(bake.library, error);
  if (error)
    return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}; choose another folder with --assets",
                                                 bake.library.string(), error.message()));

  const std::vector<bool> in_use = assets_in_use(scene);
  std::vector<fs::path> folders(scene.meshes.size());
  std::vector<size_t> missing;
  FileHashes hashes;  // the scene is read once, however many meshes it has
  for (size_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
    if (!in_use[mesh]) continue;
    if (auto found = find_ready(bake, scene, mesh, hashes)) {
      folders[mesh] = std::move(found->folder);
      repeat_warnings(options, scene.meshes[mesh], found->manifest);
    } else {
      missing.push_back(mesh);
    }
  }
  if (missing.empty()) return folders;

  FARFIELD_TRY_LET(auto news, bake_in_a_process(scene, options, bake));
  std::string first_failure;
  for (const size_t mesh : missing) {
    if (news.is_ready[scene.meshes[mesh].asset_name]) {
      folders[mesh] = asset_folder(bake, scene.meshes[mesh]);
      if (const auto baked = read_manifest(folders[mesh])) repeat_warnings(options, scene.meshes[mesh], *baked);
    } else {
      const std::string failure = fmt::format("{}: baking {} failed", options.scene.string(),
                                              what_was_baked(scene, scene.meshes[mesh].asset_name));
      if (first_failure.empty()) first_failure = failure;
      warn(options, failure + "; the picture is without it");
    }
  }
  const bool any = std::ranges::any_of(folders, [](const fs::path& folder) { return !folder.empty(); });
  if (!first_failure.empty() && !any) return make_error(ErrorCode::Unsupported, first_failure);
  return folders;
}

}  // namespace farfield
