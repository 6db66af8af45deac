// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/asset_library.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include "bake/bake.h"
#include "base/parallel.h"
#include "base/result.h"
#include "cache/manifest.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::milliseconds kPollInterval{10};

// "forest" for forest.glb, forest.gltf, forest.glb.gz.
std::string scene_name(const fs::path& scene) {
  fs::path name = scene.filename();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

// Starts a program with standard output closed to the world; standard error stays ours, so its progress line and its
// error line are seen.
Result<pid_t> start(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return make_error(ErrorCode::Io, fmt::format("cannot start {}: {}", argv[0], std::strerror(error)));
  return child;
}

// Waits for a child; when the job is cancelled, asks it to stop first (a bake keeps the levels that it finished).
Result<int> wait_for(pid_t child, const RenderOptions& options) {
  bool asked_to_stop = false;
  for (;;) {
    int status = 0;
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended < 0) return make_error(ErrorCode::Io, fmt::format("cannot wait for a bake: {}", std::strerror(errno)));
    if (ended == child) {
      if (asked_to_stop) return make_error(ErrorCode::Cancelled, "cancelled");
      return status;
    }
    if (!asked_to_stop && options.job.is_cancelled()) {
      kill(child, SIGTERM);
      asked_to_stop = true;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

// Not "/proc/self/exe" itself, so that the child has this program's name in `ps`.
std::string this_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? "/proc/self/exe" : program.string();
}

std::vector<std::string> bake_command(const RenderOptions& options, size_t mesh, const fs::path& folder) {
  std::vector<std::string> command = {options.baker.empty() ? this_program() : options.baker.string(),
                                      "bake",
                                      options.scene.string(),
                                      "-o",
                                      folder.string(),
                                      "--mesh",
                                      fmt::format("{}", mesh),
                                      "--finest-grid",
                                      fmt::format("{}", options.finest_grid),
                                      "--threads",
                                      fmt::format("{}", thread_count()),
                                      "--quiet"};
  if (options.full_detail) command.push_back("--source-only");
  return command;
}

BakeOptions bake_options(const RenderOptions& options, size_t mesh) {
  BakeOptions bake;
  bake.finest_grid = options.finest_grid;
  bake.source_only = options.full_detail;
  bake.import.mesh = static_cast<int>(mesh);
  return bake;
}

// What the bake said, which is as true of this picture as of the asset.
void repeat_warnings(const GltfScene& scene, const RenderOptions& options, size_t mesh, const Manifest& manifest) {
  if (!options.warning) return;
  for (const std::string& warning : manifest.warnings)
    options.warning(fmt::format("mesh {}: {}", scene.meshes[mesh].asset_name, warning));
}

// How a bake ended.
struct BakeEnd {
  bool is_done = false;
  std::string how;  // if not: "exit code 3"
};

Result<BakeEnd> bake_mesh(const RenderOptions& options, size_t mesh, const fs::path& folder) {
  FARFIELD_TRY_LET(const auto child, start(bake_command(options, mesh, folder)));
  FARFIELD_TRY_LET(const auto status, wait_for(child, options));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return BakeEnd{true, {}};
  if (options.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  if (WIFEXITED(status)) return BakeEnd{false, fmt::format("exit code {}", WEXITSTATUS(status))};
  // Killed from outside or out of memory: no fault of the mesh.
  return make_error(ErrorCode::BadFile, fmt::format("{}: baking mesh {} failed (signal {})", options.scene.string(),
                                                    mesh, WTERMSIG(status)));
}

std::vector<bool> meshes_in_use(const GltfScene& scene) {
  std::vector<bool> in_use(scene.meshes.size(), false);
  for (const GltfInstance& instance : scene.instances)
    in_use[instance.mesh] = scene.meshes[instance.mesh].triangle_count > 0;
  return in_use;
}

}  // namespace

fs::path asset_library_folder(const RenderOptions& options) {
  const fs::path root =
      options.assets.empty() ? options.scene.parent_path() / "farfield-assets" : fs::path(options.assets);
  return root / scene_name(options.scene);
}

Result<std::vector<fs::path>> find_or_bake_assets(const GltfScene& scene, const RenderOptions& options) {
  const fs::path library = asset_library_folder(options);
  std::error_code error;
  fs::create_directories(library, error);
  if (error)
    return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}; choose another folder with --assets",
                                                 library.string(), error.message()));

  const std::vector<bool> in_use = meshes_in_use(scene);
  std::vector<fs::path> folders(scene.meshes.size());
  std::string broken;  // the first
  for (size_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
    if (!in_use[mesh]) continue;
    const char* suffix = options.full_detail ? ".source.farfield" : ".farfield";
    const fs::path folder = library / (scene.meshes[mesh].asset_name + suffix);
    if (const auto manifest = find_up_to_date(options.scene, folder, bake_options(options, mesh))) {
      repeat_warnings(scene, options, mesh, *manifest);
      folders[mesh] = folder;
      continue;
    }
    FARFIELD_TRY_LET(const auto end, bake_mesh(options, mesh, folder));
    if (end.is_done) {
      if (const auto manifest = read_manifest(folder)) repeat_warnings(scene, options, mesh, *manifest);
      folders[mesh] = folder;
      continue;
    }
    const std::string said = fmt::format("baking mesh {} \"{}\" failed ({})", mesh, scene.meshes[mesh].name, end.how);
    if (broken.empty()) broken = said;
    if (options.warning) options.warning(said + "; it is left out");
  }
  if (!broken.empty() && std::ranges::all_of(folders, &fs::path::empty)) {
    return make_error(ErrorCode::BadFile,
                      fmt::format("{}: {}, and nothing is left to show", options.scene.string(), broken));
  }
  return folders;
}

}  // namespace farfield
