// SPDX-License-Identifier: Apache-2.0
// Layout of OUT.partial:
//   volume_KEY.ffl   packed volumes; KEY is the hash of everything that the volume depends on, so no other check of
//                    options or versions is needed to use one again
//   asset/           the asset in the making; becomes OUT by a rename
//   owner            who bakes here, for the messages of those who wait; means nothing without the lock on the folder
#include "bake/bake_workspace.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/result.h"
#include "cache/level_file.h"
#include "cache/manifest.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPollInterval{10};
constexpr const char* kOwnerName = "owner";

tl::unexpected<Error> io_error(const char* verb, const fs::path& path, const char* reason) {
  return make_error(ErrorCode::Io, fmt::format("{}: cannot {}: {}", path.string(), verb, reason));
}
tl::unexpected<Error> io_error(const char* verb, const fs::path& path, const std::error_code& error) {
  return io_error(verb, path, error.message().c_str());
}

/// "a/b.farfield" of "a/b.farfield/": the name that a rename needs.
fs::path without_trailing_slash(const fs::path& path) {
  fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

/// Takes a beginning off a name, if it begins so.
bool skip(std::string_view& name, std::string_view beginning) {
  if (!name.starts_with(beginning)) return false;
  name.remove_prefix(beginning.size());
  return true;
}

bool skip_digits(std::string_view& name) {
  const size_t count = std::min(name.find_first_not_of("0123456789"), name.size());
  name.remove_prefix(count);
  return count > 0;
}

/// Whether an asset's files, or what a write of them that was cut short leaves behind, bear this name.
bool is_asset_file_name(std::string_view name) {
  if (skip(name, "level_")) {
    if (!skip_digits(name) || !skip(name, ".ffl")) return false;
  } else if (skip(name, "texture_")) {
    if (!skip_digits(name) || !skip(name, ".tif")) return false;
  } else if (!skip(name, kManifestName)) {
    return false;
  }
  if (name.empty()) return true;
  return skip(name, ".tmp-") && skip_digits(name) && skip(name, "-") && skip_digits(name) && name.empty();
}

/// Whether a folder with files of these names, all of them asset file names, is an asset. A damaged manifest still
/// counts as ours beside level files: nobody else's files bear their names.
bool is_asset(const fs::path& folder, const std::set<std::string>& names) {
  if (!names.contains(kManifestName)) return false;
  const bool has_levels = std::ranges::any_of(names, [](const auto& name) { return name.starts_with("level_"); });
  const ManifestWriter writer = manifest_writer(folder);
  return writer == ManifestWriter::Farfield || (writer == ManifestWriter::Unknown && has_levels);
}

/// Whether the descriptor is of what the path names now.
bool is_same(int descriptor, const fs::path& path) {
  struct stat opened, named;
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

fs::path working_folder(const fs::path& out) {
  fs::path folder = out;
  folder += ".partial";
  return folder;
}

/// One try to lock a folder: locked, held by another bake, or gone (removed by a bake that ended meanwhile: a lock on
/// that one keeps nobody out). Errors: Io.
enum class LockState { Locked, Held, Gone };
struct LockTry {
  LockState state;
  std::optional<FileDescriptor> descriptor;  ///< if it is locked
};
Result<LockTry> try_to_lock(const fs::path& folder) {
  FileDescriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.get() < 0 && errno == ENOENT) return LockTry{LockState::Gone, {}};
  if (descriptor.get() < 0) return io_error("open", folder, std::strerror(errno));
  if (::flock(descriptor.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return LockTry{LockState::Held, {}};
    return io_error("lock", folder, fmt::format("{}; bake to a file system that can", std::strerror(errno)).c_str());
  }
  if (!is_same(descriptor.get(), folder)) return LockTry{LockState::Gone, {}};
  return LockTry{LockState::Locked, std::move(descriptor)};
}

/// "process 123 on render07", for those who wait.
std::string this_process() {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  return fmt::format("process {} on {}", ::getpid(), host);
}

/// What a bake wrote of itself into the folder that it holds.
std::string owner_of(const fs::path& folder) {
  const auto text = read_small_file(folder / kOwnerName, 1024);
  return text && !text->empty() ? *text : "another bake";
}

/// Between two tries of a lock. Errors: Cancelled.
Result<void> wait_a_little(const fs::path& folder, const Job& job) {
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
  job.report(0, fmt::format("wait for {}", owner_of(folder)));
  std::this_thread::sleep_for(kPollInterval);
  return {};
}

/// Nothing hangs on it: those who wait without it just do not hear for whom.
void write_owner(const fs::path& folder) { std::ofstream(folder / kOwnerName) << this_process(); }

struct LockedFolder {
  FileDescriptor descriptor;
  bool has_waited = false;
};

/// Makes a folder if it is not there, and opens and locks it, once all others have let it go.
Result<LockedFolder> lock_folder(const fs::path& folder, const Job& job) {
  bool has_waited = false;
  for (;;) {
    std::error_code error;
    fs::create_directories(folder, error);
    // It was there, and another bake removed it before its kind was looked at.
    if (error == std::errc::file_exists && !fs::exists(fs::symlink_status(folder))) continue;
    if (error) return io_error("create", folder, error);
    FARFIELD_TRY_LET(auto lock, try_to_lock(folder));
    if (lock.state == LockState::Locked) return LockedFolder{std::move(*lock.descriptor), has_waited};
    if (lock.state == LockState::Gone) continue;
    has_waited = true;
    FARFIELD_TRY(wait_a_little(folder, job));
  }
}

/// Swaps two folders in one step where the file system can; otherwise moves one aside first.
int exchange(const fs::path& staged, const fs::path& out, const fs::path& aside) {
  if (renameat2(AT_FDCWD, staged.c_str(), AT_FDCWD, out.c_str(), RENAME_EXCHANGE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return -1;
  if (::rename(out.c_str(), aside.c_str()) != 0) return -1;
  if (::rename(staged.c_str(), out.c_str()) == 0) return 0;
  const int reason = errno;
  (void)::rename(aside.c_str(), out.c_str());
  errno = reason;
  return -1;
}

}  // namespace

Result<void> check_replaceable(const fs::path& out) {
  const auto refuse = [&](const std::string& reason) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: {}; move it away or choose another name", out.string(), reason));
  };
  std::error_code error;
  const fs::file_status status = fs::symlink_status(out, error);
  if (status.type() == fs::file_type::not_found) return {};
  if (status.type() != fs::file_type::directory) return refuse("exists and is not a baked asset");

  std::set<std::string> names;
  for (fs::directory_iterator entry(out, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code unknown;
    if (entry->symlink_status(unknown).type() != fs::file_type::regular || !is_asset_file_name(name)) {
      return refuse(fmt::format("has \"{}\" in it, which a bake would delete", name));
    }
    names.insert(name);
  }
  if (error) return io_error("list", out, error);
  if (!names.empty() && !is_asset(out, names)) {
    return refuse(names.contains(kManifestName) ? "its manifest.json is not Farfield's"
                                                : "exists and is not a baked asset");
  }
  return {};
}

Result<bool> wait_for_other_bake(const fs::path& out, const Job& job) {
  const fs::path folder = working_folder(without_trailing_slash(out));
  for (bool has_waited = false;; has_waited = true) {
    FARFIELD_TRY_LET(const auto lock, try_to_lock(folder));
    if (lock.state != LockState::Held) return has_waited;
    FARFIELD_TRY(wait_a_little(folder, job));
  }
}

BakeWorkspace::BakeWorkspace(fs::path out, fs::path folder, FileDescriptor lock, bool has_waited)
    : out_(std::move(out)), folder_(std::move(folder)), has_waited_(has_waited), lock_(std::move(lock)) {}

BakeWorkspace::BakeWorkspace(BakeWorkspace&& other) noexcept
    : out_(std::move(other.out_)),
      folder_(std::move(other.folder_)),
      has_waited_(other.has_waited_),
      lock_(std::exchange(other.lock_, std::nullopt)) {}

BakeWorkspace::~BakeWorkspace() {
  if (!lock_) return;
  std::error_code ignored;
  fs::remove_all(asset_dir(), ignored);
  fs::remove(folder_ / kOwnerName, ignored);
  fs::remove(folder_, ignored);  // only if no volume is in it
}

Result<BakeWorkspace> BakeWorkspace::open(const fs::path& out_path, const Job& job) {
  const fs::path out = without_trailing_slash(out_path);
  FARFIELD_TRY(check_replaceable(out));
  const fs::path folder = working_folder(out);
  FARFIELD_TRY_LET(auto lock, lock_folder(folder, job));
  BakeWorkspace workspace(out, folder, std::move(lock.descriptor), lock.has_waited);
  write_owner(folder);
  std::error_code error;
  fs::remove_all(workspace.asset_dir(), error);  // of an interrupted bake
  if (!error) fs::create_directory(workspace.asset_dir(), error);
  if (error) return io_error("create", workspace.asset_dir(), error);
  return workspace;
}

std::optional<LevelData> BakeWorkspace::load_volume(const std::string& file_name) const {
  const auto file = LevelFile::open(folder_ / file_name, LevelCheck::Full);
  if (!file) return std::nullopt;
  return copy_of((*file)->view());
}

Result<void> BakeWorkspace::store_volume(const std::string& file_name, const LevelData& volume) const {
  FARFIELD_TRY(write_level(folder_ / file_name, volume));
  return {};
}

Result<void> BakeWorkspace::publish() {
  FARFIELD_TRY(check_replaceable(out_));
  std::error_code error;
  const fs::path aside = folder_ / "previous";
  const int renamed =
      fs::exists(out_, error) ? exchange(asset_dir(), out_, aside) : ::rename(asset_dir().c_str(), out_.c_str());
  if (renamed != 0) return io_error("move the finished asset here", out_, std::strerror(errno));
  fs::remove_all(folder_, error);  // what is left is waste; that it could not be removed spoils nothing
  lock_.reset();
  return {};
}

}  // namespace farfield
