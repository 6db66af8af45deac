// SPDX-License-Identifier: Apache-2.0
#include "export/export_asset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/hash.h"
#include "base/text.h"
#include "cache/level_file.h"
#include "cache/placed_parts.h"
#include "export/level_grids.h"
#include "export/surface_writers.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// "0, 2, 3"
std::string list_of(const std::vector<uint32_t>& levels) { return fmt::format("{}", fmt::join(levels, ", ")); }

class Exporter {
 public:
  Exporter(const fs::path& asset, const fs::path& target, ExportFormat format, const Manifest& manifest, const Job& job)
      : asset_(asset), target_(target), is_volume_(format == ExportFormat::Vdb), format_(format), manifest_(manifest),
        job_(job) {}

  Result<ExportReport> run(const ExportOptions& options) {
    FARFIELD_TRY_LET(const auto entries, options.levels.empty() ? all_levels() : named_levels(options.levels));
    if (!is_volume_ && entries.size() > 1) {
      return error("{} holds the surface of one level; choose one of {} with --level", target_.string(),
                   list_of(levels_with_part()));
    }
    std::vector<std::unique_ptr<LevelFile>> files;
    for (const LevelEntry* entry : entries) {
      FARFIELD_TRY_LET(auto file, open(*entry));
      files.push_back(std::move(file));
    }
    note_other_parts(entries);
    FARFIELD_TRY(is_volume_ ? write_volumes(entries, files) : write_placed_surface(*entries.front(), files.front()->view()));
    return std::move(report_);
  }

 private:
  template <typename... Args>
  tl::unexpected<Error> error(fmt::format_string<Args...> text, Args&&... args) const {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: {}", asset_.string(), fmt::format(text, std::forward<Args>(args)...)));
  }

  // ---- which levels

  bool has_part(const LevelEntry& entry) const { return (is_volume_ ? entry.voxels : entry.triangles) > 0; }
  const char* part() const { return is_volume_ ? "volume" : "surface"; }

  std::vector<uint32_t> levels_with_part() const {
    std::vector<uint32_t> levels;
    for (const LevelEntry& entry : manifest_.levels)
      if (has_part(entry)) levels.push_back(entry.level);
    return levels;
  }

  Result<std::vector<const LevelEntry*>> all_levels() {
    std::vector<const LevelEntry*> entries;
    std::vector<uint32_t> without;
    for (const LevelEntry& entry : manifest_.levels) {
      if (has_part(entry))
        entries.push_back(&entry);
      else
        without.push_back(entry.level);
    }
    if (entries.empty()) return error("no level has a {}, and {} holds nothing else", part(), target_.string());
    if (!without.empty()) report_.notes.push_back(fmt::format("levels without a {} are left out: {}", part(), list_of(without)));
    return entries;
  }

  Result<std::vector<const LevelEntry*>> named_levels(const std::vector<uint32_t>& levels) const {
    std::vector<const LevelEntry*> entries;
    for (const uint32_t level : levels) {
      const auto entry = std::ranges::find(manifest_.levels, level, &LevelEntry::level);
      if (entry == manifest_.levels.end()) {
        std::vector<uint32_t> stored;
        for (const LevelEntry& e : manifest_.levels) stored.push_back(e.level);
        return error("there is no level {}; it has {}", level, list_of(stored));
      }
      if (!has_part(*entry)) {
        const std::vector<uint32_t> others = levels_with_part();
        return error("level {} has no {}, and {} holds nothing else; {}", level, part(), target_.string(),
                     others.empty() ? std::string("no level has one") : "levels with one: " + list_of(others));
      }
      entries.push_back(&*entry);
    }
    return entries;
  }

  /// What the format has no room for.
  void note_other_parts(const std::vector<const LevelEntry*>& entries) {
    std::vector<uint32_t> levels;
    for (const LevelEntry* entry : entries)
      if ((is_volume_ ? entry->triangles : entry->voxels) > 0) levels.push_back(entry->level);
    if (levels.empty()) return;
    report_.notes.push_back(fmt::format("level{} {}: {}", levels.size() == 1 ? "" : "s", list_of(levels),
                                        is_volume_ ? "surfaces are left out; .ply, .obj and .glb have them"
                                                   : "volumes are left out; a .vdb has them"));
  }
  void note(const LevelEntry& entry, const std::string& text) {
    report_.notes.push_back(fmt::format("level {}: {}", entry.level, text));
  }

  // ---- their files

  Result<std::unique_ptr<LevelFile>> open(const LevelEntry& entry) const {
    const fs::path path = asset_ / entry.file;
    FARFIELD_TRY_LET(auto file, LevelFile::open_known(path, entry.file_bytes, entry.file_hash));
    const LevelView& view = file->view();
    const double resolution = double{view.header.resolution};
    const bool is_meant = view.header.level == entry.level &&
                          std::abs(resolution - entry.resolution) <= 1e-6 * resolution &&
                          face_count(view) == entry.triangles && voxel_count(view) == entry.voxels;
    if (is_meant) return file;
    return make_error(ErrorCode::BadFile, fmt::format("{}: is not the level that the manifest describes; bake it again",
                                                      path.string()));
  }

  // ---- what becomes of them

  Result<void> write_volumes(const std::vector<const LevelEntry*>& entries,
                             const std::vector<std::unique_ptr<LevelFile>>& files) {
    VolumeFile out;
    out.metadata = {{"creator", kExportGenerator}, {"farfield_source", manifest_.source}};
    out.content_hash = hash_bytes(std::as_bytes(std::span(std::string_view(kExportGenerator))), manifest_.source_hash);
    for (size_t i = 0; i < files.size(); ++i) {
      const LevelEntry& entry = *entries[i];
      const LevelView& view = files[i]->view();
      const std::string suffix = files.size() > 1 ? fmt::format("_level_{}", entry.level) : "";
      ExportedLevel exported{entry.level, entry.resolution};
      exported.voxels = voxel_count(view);
      for (VolumeGrid& grid : level_grids({view, entry, manifest_}, suffix)) {
        exported.grids.push_back(grid.name);
        out.grids.push_back(std::move(grid));
      }
      out.content_hash = mix64(out.content_hash, entry.file_hash);
      report_.levels.push_back(std::move(exported));
    }
    return write_volume(target_, out, job_);
  }

  /// The formats have no parts: each place has faces of its own.
  Result<void> write_placed_surface(const LevelEntry& entry, const LevelView& view) {
    if (!view.has_parts()) return write_surface(entry, view);
    const LevelData flat = flattened(view);
    return write_surface(entry, view_of(flat));
  }

  Result<void> write_surface(const LevelEntry& entry, const LevelView& view) {
    job_.report(0, fmt::format("level {}", entry.level));
    const auto write = format_ == ExportFormat::Obj ? write_obj : format_ == ExportFormat::Ply ? write_ply : write_glb;
    FARFIELD_TRY_LET(const WrittenSurface written, write(target_, {view, entry, manifest_}, job_));
    ExportedLevel exported{entry.level, entry.resolution, written.faces, written.vertices, written.materials};
    report_.levels.push_back(std::move(exported));
    for (const std::string& text : written.notes) note(entry, text);
    if (!view.shading_uv.empty()) note(entry, "textures are left out; its faces have their mean colours");
    if (!view.shading_color.empty()) note(entry, "colours within its faces are left out; their means are there");
    return {};
  }

  const fs::path& asset_;
  const fs::path& target_;
  const bool is_volume_;
  const ExportFormat format_;
  const Manifest& manifest_;
  const Job& job_;
  ExportReport report_;
};

}  // namespace

Result<ExportFormat> export_format_of(const fs::path& path) {
  const std::string ending = lower_case(path.extension().string());
  if (ending == ".vdb") return ExportFormat::Vdb;
  if (ending == ".obj") return ExportFormat::Obj;
  if (ending == ".ply") return ExportFormat::Ply;
  if (ending == ".glb") return ExportFormat::Glb;
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("{}: the name must end in .vdb (volumes), .obj, .ply or .glb (surfaces)", path.string()));
}

std::vector<fs::path> files_of_export(const fs::path& target) {
  const auto format = export_format_of(target);
  if (format && *format == ExportFormat::Obj) return {target, mtl_of(target)};
  return {target};
}

Result<ExportReport> export_asset(const fs::path& asset, const fs::path& target, const ExportOptions& options,
                                  const Job& job) {
  FARFIELD_TRY_LET(const ExportFormat format, export_format_of(target));
  FARFIELD_TRY_LET(const Manifest manifest, read_manifest(asset));
  return Exporter(asset, target, format, manifest, job).run(options);
}

}  // namespace farfield
