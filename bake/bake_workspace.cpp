// SPDX-License-Identifier: Apache-2.0
// Layout of OUT.partial:
//   volume_KEY.ffl   packed volumes; KEY is the hash of everything that the volume depends on, so no other check of
//                    options or versions is needed to use one again
//   asset/           the asset in the making; becomes OUT by a rename
#include "bake/bake_workspace.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/hash.h"
#include "base/result.h"
#include "cache/level_file.h"
#include "cache/manifest.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

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

/// Makes a folder if it is not there, and opens and locks it. Returns its descriptor.
Result<int> lock_folder(const fs::path& folder) {
  for (;;) {
    std::error_code error;
    fs::create_directories(folder, error);
    // It was there, and another bake removed it before its kind was looked at.
    if (error == std::errc::file_exists && !fs::exists(fs::symlink_status(folder))) continue;
    if (error) return io_error("create", folder, error);
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0 && errno != ENOENT) return io_error("open", folder, std::strerror(errno));
    const bool is_locked = descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
    if (is_locked && is_same(descriptor, folder)) return descriptor;
    if (descriptor >= 0) ::close(descriptor);
    if (descriptor >= 0 && !is_locked) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("{}: is in use by another bake of this asset; wait for it", folder.string()));
    }
    // Another bake ended and removed the folder meanwhile: a lock on that one keeps nobody out.
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

BakeWorkspace::BakeWorkspace(fs::path out, fs::path folder, int lock)
    : out_(std::move(out)), folder_(std::move(folder)), lock_(lock) {}

BakeWorkspace::BakeWorkspace(BakeWorkspace&& other) noexcept
    : out_(std::move(other.out_)), folder_(std::move(other.folder_)), lock_(std::exchange(other.lock_, -1)) {}

BakeWorkspace::~BakeWorkspace() {
  if (lock_ < 0) return;
  std::error_code ignored;
  fs::remove_all(asset_dir(), ignored);
  fs::remove(folder_, ignored);  // only if no volume is in it
  ::close(lock_);
}

Result<BakeWorkspace> BakeWorkspace::open(const fs::path& out_path) {
  const fs::path out = without_trailing_slash(out_path);
  FARFIELD_TRY(check_replaceable(out));
  fs::path folder = out;
  folder += ".partial";
  FARFIELD_TRY_LET(const auto lock, lock_folder(folder));
  BakeWorkspace workspace(out, folder, lock);
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
  ::close(lock_);
  lock_ = -1;
  return {};
}

}  // namespace farfield
