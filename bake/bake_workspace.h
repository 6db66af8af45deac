// SPDX-License-Identifier: Apache-2.0
// Where a bake works until its asset is complete: a folder OUT.partial beside OUT. Nothing half-written ever bears the
// final name, and what was slow to compute survives an interruption.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/file_io.h"
#include "base/job.h"
#include "base/result.h"
#include "cache/level.h"

namespace farfield {

/// Whether a bake may replace, and thus delete, what is at `out`: nothing, an empty folder, or an asset with no other
/// files in it. Errors: InvalidArgument (naming what does not belong), Io.
Result<void> check_replaceable(const std::filesystem::path& out);

/// Waits while another bake of OUT is running, in this process or another; `job` tells whose it is. True if there was
/// one. The lock is the system's and goes with the process that holds it: none is ever stale. Errors: Cancelled, Io.
Result<bool> wait_for_other_bake(const std::filesystem::path& out, const Job& job);

/// The working folder of one bake; locked, so that two bakes of one asset do not mix. When it goes without publish(),
/// it keeps the stored volumes and removes the rest. One thread at a time.
class BakeWorkspace {
 public:
  /// Creates or finds OUT.partial, and waits until no other bake uses it. Errors: those of check_replaceable(OUT),
  /// Cancelled, Io.
  static Result<BakeWorkspace> open(const std::filesystem::path& out, const Job& job = {});
  BakeWorkspace(BakeWorkspace&& other) noexcept;
  BakeWorkspace& operator=(BakeWorkspace&&) = delete;
  ~BakeWorkspace();

  /// Another bake held it first: OUT may be what was wanted by now.
  bool has_waited() const { return has_waited_; }

  /// Where the asset's files are to be written; empty at first.
  std::filesystem::path asset_dir() const { return folder_ / "asset"; }

  /// The packed volume that an earlier bake stored under VolumeJob::file_name(); nothing if there is none or it is
  /// damaged.
  std::optional<LevelData> load_volume(const std::string& file_name) const;
  /// Stores a packed volume (pack_volume, not empty) for a later bake. Errors: Io.
  Result<void> store_volume(const std::string& file_name, const LevelData& volume) const;

  /// Makes asset_dir() the asset OUT, in one step also where OUT exists, and removes the workspace. Errors: those of
  /// check_replaceable(OUT), as it may have changed since open(), Io; what was at OUT is then untouched.
  Result<void> publish();

 private:
  BakeWorkspace(std::filesystem::path out, std::filesystem::path folder, FileDescriptor lock, bool has_waited);

  std::filesystem::path out_;
  std::filesystem::path folder_;
  bool has_waited_ = false;
  std::optional<FileDescriptor> lock_;  ///< of folder_; none: moved from or published
};

}  // namespace farfield
