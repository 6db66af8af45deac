// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/asset_library.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

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
constexpr int kBakeFailed = 1;  // exit code of `farfield bake` that says why on standard error

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
                                      "--no-warnings"};  // said here, from the manifest
  if (options.full_detail) command.push_back("--source-only");
  return command;
}

BakeOptions bake_options(const RenderOptions& options, size_t mesh, FileHashes& hashes) {
  BakeOptions bake;
  bake.finest_grid = options.finest_grid;
  bake.source_only = options.full_detail;
  bake.import.mesh = static_cast<int>(mesh);
  bake.import.known_hashes = &hashes;
  return bake;
}

void warn(const RenderOptions& options, const std::string& line) {
  if (options.warning) options.warning(line);
}

// What a bake warned of is as true of the picture, now and at each later run.
void repeat_warnings(const RenderOptions& options, const GltfMesh& mesh, const Manifest& manifest) {
  for (const std::string& warning : manifest.warnings)
    warn(options, fmt::format("mesh {}: {}", mesh.asset_name, warning));
}

// Errors: Unsupported, when it is the mesh that cannot be baked and others may; else Io, BadFile, Cancelled.
Result<void> bake_mesh(const GltfScene& scene, const RenderOptions& options, size_t mesh, const fs::path& folder) {
  FARFIELD_TRY_LET(const auto child, start(bake_command(options, mesh, folder)));
  FARFIELD_TRY_LET(const auto status, wait_for(child, options));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (options.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  const std::string how = WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                                              : fmt::format("exit code {}", WEXITSTATUS(status));
  const bool has_refused = WIFEXITED(status) && WEXITSTATUS(status) == kBakeFailed;
  return make_error(
      has_refused ? ErrorCode::Unsupported : ErrorCode::BadFile,
      fmt::format("{}: baking mesh {} \"{}\" failed ({})", options.scene.string(), mesh, scene.meshes[mesh].name, how));
}

// The mesh's asset is in `folder` afterwards, up to date, and its warnings have been said.
Result<void> find_or_bake(const GltfScene& scene, const RenderOptions& options, size_t mesh, const fs::path& folder,
                          FileHashes& hashes) {
  if (const auto found = find_up_to_date(options.scene, folder, bake_options(options, mesh, hashes))) {
    repeat_warnings(options, scene.meshes[mesh], *found);
    return {};
  }
  FARFIELD_TRY(bake_mesh(scene, options, mesh, folder));
  if (const auto baked = read_manifest(folder)) repeat_warnings(options, scene.meshes[mesh], *baked);
  return {};
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
  FileHashes hashes;  // the scene is read once, however many meshes it has
  std::optional<Error> first_failure;
  bool any = false;
  for (size_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
    if (!in_use[mesh]) continue;
    const char* suffix = options.full_detail ? ".source.farfield" : ".farfield";
    const fs::path folder = library / (scene.meshes[mesh].asset_name + suffix);
    const auto found = find_or_bake(scene, options, mesh, folder, hashes);
    if (found) {
      folders[mesh] = folder;
      any = true;
      continue;
    }
    if (found.error().code != ErrorCode::Unsupported) return tl::unexpected(found.error());
    if (!first_failure) first_failure = found.error();
    warn(options, fmt::format("{}; the picture is without it", found.error().message));
  }
  if (first_failure && !any) return tl::unexpected(*first_failure);
  return folders;
}

}  // namespace farfield
