// SPDX-License-Identifier: Apache-2.0
// Level 0 is the source. The first level that saves something over it is made from the source as it looks at that
// resolution; then comes the cascade of thesis 6.4. Level k is made from level k-1: its surface is split into
// macrosurface, which is simplified, and sub-resolution geometry, which joins all such geometry of finer levels, in the
// form in which it left the surface; all of it is voxelised afresh at r_k.
#include "bake/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "bake/asset_textures.h"
#include "bake/bake_volume.h"
#include "bake/bake_workspace.h"
#include "bake/level_writer.h"
#include "bake/pack_level.h"
#include "bake/pack_source.h"
#include "bake/take_parts_out.h"
#include "bake/volume_job.h"
#include "base/big_vector.h"
#include "base/file_io.h"
#include "base/free_memory.h"
#include "base/hash.h"
#include "base/index.h"
#include "base/result.h"
#include "base/stopwatch.h"
#include "cache/level_file.h"
#include "import/read_volume.h"
#include "prefilter/cut_tile.h"
#include "prefilter/face_materials.h"
#include "prefilter/keep_apart.h"
#include "prefilter/macrosurface.h"
#include "prefilter/place_lattice.h"
#include "prefilter/resolve.h"
#include "prefilter/sheet_surface.h"
#include "prefilter/simplify.h"
#include "prefilter/voxelize.h"
#include "prefilter/wall_shell.h"
#include "prefilter/walls.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMaxGrid = 4096;  ///< the brick table has (grid / 8)^3 entries

Result<void> check_options(const BakeOptions& options) {
  const uint32_t finest = options.finest_grid, coarsest = options.coarsest_grid;
  if (!std::has_single_bit(finest) || !std::has_single_bit(coarsest) || finest < coarsest || finest > kMaxGrid) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("bake: grids must be powers of two with 1 <= coarsest <= finest <= {}, not {} to {}",
                                  kMaxGrid, finest, coarsest));
  }
  if (options.rays_per_voxel == 0) return make_error(ErrorCode::InvalidArgument, "bake: rays per voxel must be > 0");
  return check_options(options.import.subdivision);
}

/// One mesh of a file stands in one place, and of tiles cuts matter.
bool may_have_parts(const BakeOptions& options) { return options.import.mesh < 0 && !options.import.tile.is_part(); }

/// Equal text and source hash give equal bytes.
std::string canonical_options(const BakeOptions& options, bool is_volume) {
  if (is_volume) {
    const std::string import = fmt::format("fog={}{}", kFogVersion, canonical_text(options.import.fog));
    if (options.source_only) return "source_only=1 " + import;
    return fmt::format("coarsest_grid={} downsampling={} {}", options.coarsest_grid, name_of(options.downsampling),
                       import);
  }
  const std::string node = options.import.node < 0 ? "" : fmt::format("node={} ", options.import.node);
  const MeshTile& part = options.import.tile;
  const std::string tile =
      part.is_part() ? fmt::format("tile={}/{} tiles={} ", part.number, part.count, kTilesVersion) : "";
  const std::string parts = may_have_parts(options) ? "parts=1 " : "";
  const std::string import = fmt::format("mesh={} {}{}{}{}condition={}", options.import.mesh, node, tile, parts,
                                         canonical_text(import_options(options).subdivision), kConditionVersion);
  if (options.source_only) return "source_only=1 " + import;
  constexpr int kMorphVersion = 1;  // of what the manifest has of morphs
  return fmt::format("finest_grid={} coarsest_grid={} rays_per_voxel={} {} voxelize={} morph={} simplify={},{}",
                     options.finest_grid, options.coarsest_grid, options.rays_per_voxel, import, kVoxelizeVersion,
                     kMorphVersion, name_of(options.simplify), kSimplifyVersion);
}

/// What a bake of `source` with these options writes into its manifest, but for the levels.
Manifest make_manifest(const std::string& source, uint64_t source_hash, const BakeOptions& options, bool is_volume) {
  Manifest manifest;
  manifest.generator = "farfield " FARFIELD_VERSION;
  manifest.source = source;
  manifest.source_hash = source_hash;
  manifest.options = canonical_options(options, is_volume);
  return manifest;
}

bool are_same_bake(const Manifest& a, const Manifest& b) {
  return a.source_hash == b.source_hash && a.options == b.options && a.generator == b.generator && a.source == b.source;
}

/// Whether every level's and texture's file is the one that the manifest means.
bool is_whole(const fs::path& asset, const Manifest& manifest) {
  const bool has_levels = std::ranges::all_of(manifest.levels, [&](const LevelEntry& entry) {
    const auto file = LevelFile::open_known(asset / entry.file, entry.file_bytes, entry.file_hash);
    return file && (*file)->file_bytes() == entry.file_bytes;
  });
  return has_levels && std::ranges::all_of(manifest.textures, [&](const AssetTexture& texture) {
           const auto hash = hash_file(asset / texture.file);
           return hash && *hash == texture.file_hash;
         });
}

/// Warnings name files as the source sees them: the same asset whatever its folder is called.
std::vector<std::string> without_folder(std::vector<std::string> warnings, const fs::path& folder) {
  const std::string prefix = (folder / "").string();
  if (prefix.empty()) return warnings;
  for (std::string& warning : warnings) {
    for (size_t at; (at = warning.find(prefix)) != std::string::npos;) warning.erase(at, prefix.size());
  }
  return warnings;
}

/// Where vertices and faces of one surface are in another, as long as that is the same.
MorphMaps identity_maps(size_t vertices, size_t faces) {
  MorphMaps maps;
  for (uint32_t v = 0; v < vertices; ++v) maps.vertex.push_back(v);
  for (uint32_t f = 0; f < faces; ++f) maps.face.push_back(f);
  return maps;
}

void compose(std::vector<uint32_t>& first, const std::vector<uint32_t>& then) {
  for (uint32_t& i : first) {
    if (i != kMorphVoxelized && i != kMorphCollapsed) i = then[i];
  }
}

/// Where parts begin in a level. part: of each triangle, as PartedSource has it.
std::vector<uint32_t> first_quads_of_parts(const std::vector<uint32_t>& part, const SurfaceOrder& order,
                                           const LevelData& level) {
  std::vector<uint32_t> part_of_face(part.size());
  for (size_t t = 0; t < part.size(); ++t) part_of_face[order.face_number[t]] = part[t];
  std::vector<uint32_t> first(part.back(), 0);
  for (uint32_t quad = static_cast<uint32_t>(level.quads.size()); quad-- > 0;) {
    if (const uint32_t p = part_of_face[level.quad_first_face[quad]]; p > 0) first[p - 1] = quad;
  }
  return first;
}

/// A surface in two parts. Of `macrosurface` all vertices are kept, so that their numbers stay.
struct SplitSurface {
  Surface macrosurface;
  std::vector<uint32_t> macro_face;  ///< for each face of the whole: its number in macrosurface, or kMorphVoxelized
};

/// Moves the faces that are not macrosurface behind those of `sub_resolution`, where quads are not known any more.
SplitSurface split(const Surface& surface, const std::vector<uint8_t>& is_macrosurface, Surface& sub_resolution) {
  SplitSurface result;
  result.macrosurface.positions = surface.positions;
  result.macrosurface.origin = surface.origin;
  std::vector<uint32_t> moved(surface.positions.size(), kNoIndex);
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    if (is_macrosurface[f]) {
      result.macro_face.push_back(static_cast<uint32_t>(result.macrosurface.triangles.size()));
      result.macrosurface.triangles.push_back(surface.triangles[f]);
      result.macrosurface.materials.push_back(surface.materials[f]);
      if (surface.has_quads()) result.macrosurface.quad.push_back(surface.quad[f]);
      continue;
    }
    result.macro_face.push_back(kMorphVoxelized);
    uvec3 triangle = surface.triangles[f];
    for (int c = 0; c < 3; ++c) {
      uint32_t& vertex = moved[triangle[c]];
      if (vertex == kNoIndex) {
        vertex = static_cast<uint32_t>(sub_resolution.positions.size());
        sub_resolution.positions.push_back(surface.positions[triangle[c]]);
      }
      triangle[c] = vertex;
    }
    sub_resolution.triangles.push_back(triangle);
    sub_resolution.materials.push_back(surface.materials[f]);
  }
  return result;
}

/// Without the vertices that no face uses.
Surface compact(const Surface& surface) {
  Surface result;
  result.origin = surface.origin;
  split(surface, std::vector<uint8_t>(surface.triangles.size(), 0), result);
  return result;
}

/// Adds a surface of the same origin that shares no vertex, as triangles.
void append(const Surface& added, Surface& surface) {
  const auto first = static_cast<uint32_t>(surface.positions.size());
  surface.positions.insert(surface.positions.end(), added.positions.begin(), added.positions.end());
  for (const uvec3& t : added.triangles) surface.triangles.push_back(t + first);
  surface.materials.insert(surface.materials.end(), added.materials.begin(), added.materials.end());
  if (surface.has_quads()) surface.quad.resize(surface.triangles.size(), kNoIndex);
}

/// Less than what a level with such a volume and surface has resident.
uint64_t least_bytes(const VolumeSize& volume, const Surface& voxelized, const Surface& surface) {
  constexpr uint64_t kTriangle = 20;  // a BVH of quads takes more, without any array of ours
  const auto any = [&](vec3 FaceMaterial::*channel) {
    return std::any_of(voxelized.materials.begin(), voxelized.materials.end(),
                       [&](const FaceMaterial& m) { return max_component(m.*channel) > 0; });
  };
  uint64_t per_voxel = sizeof(PackedFlakeSggx);
  if (any(&FaceMaterial::diffuse)) per_voxel += sizeof(PackedColor);
  if (any(&FaceMaterial::specular)) per_voxel += sizeof(PackedColor) + 1;
  if (any(&FaceMaterial::transmission)) per_voxel += sizeof(PackedColor);
  const uint64_t bytes =
      per_voxel * volume.voxels + sizeof(Brick) * volume.bricks + kTriangle * surface.triangles.size();
  return bytes - bytes / 3;  // what long lines leave, and the estimate's own error
}

/// Less than what a level takes whose walls are wrapped.
uint64_t least_shell_bytes(const Surface& wall, const Surface& sheet, double resolution) {
  constexpr uint64_t kTriangle = 20;
  constexpr uint64_t kOfWall = 8, kOfSheet = 2;  // per voxel; front and back at edges of half a voxel: up to 18
  const auto voxels = [&](const Surface& pieces) { return mark_voxels(pieces, {dvec3(0.0), resolution}).size(); };
  return kTriangle * (kOfWall * voxels(wall) + kOfSheet * voxels(sheet));
}

/// One bake, step by step.
class Baker {
 public:
  Baker(const BakeOptions& options, SourceSurface source, BakeWorkspace workspace, BakeReport report)
      : options_(options),
        workspace_(std::move(workspace)),
        report_(std::move(report)),
        writer_(workspace_.asset_dir(), options.measure_resident, report_.manifest),
        source_(std::move(source)) {}

  Result<BakeReport> run() {
    const Box3 bounds = source_.bounds();
    const double longest_side = max_component(bounds.size());
    const double finest_resolution = longest_side / options_.finest_grid;
    report_.manifest.origin = source_.origin;
    report_.manifest.base_resolution = finest_resolution / 2;
    middle_ = 0.5 * (dvec3(bounds.lower) + dvec3(bounds.upper));
    last_level_ =
        options_.source_only ? 0 : static_cast<uint32_t>(std::bit_width(options_.finest_grid / options_.coarsest_grid));

    FARFIELD_TRY(bake_source());
    for (uint32_t level = 1; level <= last_level_; ++level) {
      FARFIELD_TRY(bake_level(level, std::ldexp(finest_resolution, static_cast<int>(level) - 1)));
    }
    if (!options_.surfaces_only) {
      FARFIELD_TRY(writer_.finish());
      FARFIELD_TRY(workspace_.publish());
    }
    options_.job.report(1, "done");
    return std::move(report_);
  }

 private:
  /// Level 0: the source as it is, with the textures of its materials.
  Result<void> bake_source() {
    options_.job.report(0, "level 0: write");
    LevelReport level_report;
    level_report.grid = 2 * options_.finest_grid;
    const Stopwatch watch;
    FARFIELD_TRY_LET(look_, write_textures(source_, workspace_.asset_dir(), options_.known_textures, options_.job));
    texel_areas_ = texel_areas(source_, look_);
    report_.manifest.textures = look_.textures;
    report_.manifest.materials = look_.materials;

    std::optional<PartedSource> parted;
    if (may_have_parts(options_)) parted = take_parts_out(source_);
    has_parts_ = parted.has_value();
    FARFIELD_TRY_LET(LevelData level, parted ? pack_parts(*parted) : pack_whole());
    auto done = store_level(level, level_report);
    level_report.write_seconds = watch.seconds();
    report_.levels.push_back(level_report);
    return done;
  }

  Result<LevelData> pack_whole() {
    const Surface faces = average_faces(source_, options_.job);
    if (options_.job.is_cancelled()) return cancelled();
    source_order_ = order_surface(faces);
    return pack_level_0(source_, faces, source_order_);
  }

  Result<LevelData> pack_parts(const PartedSource& parted) {
    const Surface faces = average_faces(parted.surface, options_.job);
    if (options_.job.is_cancelled()) return cancelled();
    const SurfaceOrder order = order_surface(faces, parted.part);
    LevelData level = pack_level_0(parted.surface, faces, order);
    level.header.bounds = source_.bounds();
    level.placements = parted.places;
    level.part_first_quad = first_quads_of_parts(parted.part, order, level);
    return level;
  }

  LevelData pack_level_0(const SourceSurface& source, const Surface& faces, const SurfaceOrder& order) const {
    const Surface ordered = reorder(faces, order);
    LevelData level = pack_level(0, report_.manifest.base_resolution, ordered, order, {}, {});
    free_memory(level.face_sggx);  // hits have the normals themselves
    pack_source(source, order, ordered, level);
    return level;
  }

  Result<void> bake_level(uint32_t level, double resolution) {
    LevelReport level_report;
    level_report.level = level;
    level_report.grid = options_.finest_grid >> (level - 1);
    if (!is_resolved_) {
      if (level != last_level_ && saves_nothing_resolved(level, resolution)) {
        if (options_.job.is_cancelled()) return cancelled();
        level_report.worthless = true;
        report_.levels.push_back(level_report);
        return {};
      }
      FARFIELD_TRY(resolve_source(level, resolution));
    }

    FARFIELD_TRY_LET(const SurfaceOrder order, simplify_surface(level, resolution, level_report));
    if (options_.job.is_cancelled()) return cancelled();

    if (options_.surfaces_only) {
      level_report.triangles = surface_.triangles.size();
      report_.levels.push_back(level_report);
      return {};
    }

    LevelData volume;
    if (!level_report.worthless) {
      FARFIELD_TRY_LET(volume, voxelize_rest(level, resolution, level_report));
    }

    options_.job.report(share_done(level, 0.98), fmt::format("level {}: write", level));
    const Stopwatch watch;
    Result<void> done;
    if (!level_report.worthless) {
      done = store_level(pack_level(level, resolution, surface_, order, std::move(volume), from_stored_), level_report);
    }
    level_report.write_seconds = watch.seconds();
    report_.levels.push_back(level_report);
    return done;
  }

  /// Whether a level that shows the source's detail at this resolution would take more than level 0.
  bool saves_nothing_resolved(uint32_t level, double resolution) const {
    constexpr uint64_t kLeastPerFace = 40;  // a BVH of quads, colours and normals
    const uint64_t faces = estimate_resolved_faces(source_, static_cast<float>(resolution), options_.job);
    const bool is_split = faces > source_.triangles.size();  // else simplification decides what it takes
    return is_split && kLeastPerFace * faces > most_bytes_worth_writing(level);
  }

  /// Makes surface_ from the source, for this level and all that follow.
  Result<void> resolve_source(uint32_t level, double resolution) {
    options_.job.report(share_done(level, 0), fmt::format("level {}: resolve", level));
    auto resolved = resolve(source_, static_cast<float>(resolution), options_.job);
    if (!resolved) {
      return make_error(resolved.error().code,
                        fmt::format("{}: {}", report_.manifest.source, resolved.error().message));
    }
    cut_points_ = CutPoints(source_, *resolved);
    surface_ = std::move(resolved->surface);
    map_from_source(*resolved);
    is_resolved_ = true;
    source_ = {};
    return {};
  }

  /// From the final numbers of level 0; what is not there any more fades out. None from parts, which stand for many.
  void map_from_source(const ResolvedSurface& resolved) {
    static_assert(kNoIndex == kMorphVoxelized);
    if (has_parts_) return;
    from_stored_ = identity_maps(source_.positions.size(), source_.triangles.size());
    for (size_t v = 0; v < source_.positions.size(); ++v) {
      from_stored_.vertex[source_order_.vertex_number[v]] = resolved.vertex_of[v];
    }
    for (size_t f = 0; f < source_.triangles.size(); ++f) {
      from_stored_.face[source_order_.face_number[f]] = resolved.face_of[f];
    }
  }

  /// Steps A and S: what is no longer surface at this resolution leaves surface_, the rest is simplified.
  Result<SurfaceOrder> simplify_surface(uint32_t level, double resolution, LevelReport& level_report) {
    options_.job.report(share_done(level, 0), fmt::format("level {}: analyse", level));
    const Stopwatch analysis;
    auto is_macrosurface = classify_macrosurface(surface_, static_cast<float>(resolution), options_.job);
    if (options_.job.is_cancelled()) return cancelled();
    unwrap_walls(resolution, is_macrosurface);
    SplitSurface parts = split(surface_, is_macrosurface, sub_resolution_);
    FARFIELD_TRY_LET(const size_t first_shell_face, wrap_walls(level, resolution, parts, level_report));
    level_report.macrosurface_triangles = parts.macrosurface.triangles.size();
    level_report.voxelized_triangles = sub_resolution_.triangles.size();
    level_report.analysis_seconds = analysis.seconds();
    if (options_.job.is_cancelled()) return cancelled();

    options_.job.report(share_done(level, 0.03), fmt::format("level {}: simplify", level));
    const Stopwatch simplification;
    SimplifyResult simplified =
        simplify(parts.macrosurface,
                 {static_cast<float>(resolution), options_.simplify, cut_points_.find(parts.macrosurface.positions)},
                 options_.job);
    if (options_.job.is_cancelled()) return cancelled();
    FARFIELD_TRY(keep_walls_apart(level, resolution, parts.macrosurface, simplified, level_report));
    SurfaceOrder order = order_surface(simplified.surface);
    surface_ = reorder(simplified.surface, order);
    note_shell(first_shell_face, simplified, order);
    compose(from_stored_.vertex, simplified.vertex_map);
    compose(from_stored_.vertex, order.vertex_number);
    compose(from_stored_.face, parts.macro_face);
    compose(from_stored_.face, simplified.face_map);
    compose(from_stored_.face, order.face_number);
    level_report.simplify_seconds = simplification.seconds();
    if (options_.see_surfaces) {
      FARFIELD_TRY(
          options_.see_surfaces({level, level_report.grid, resolution, parts.macrosurface, sub_resolution_, surface_}));
    }
    return order;
  }

  Result<void> keep_walls_apart(uint32_t level, double resolution, const Surface& macrosurface,
                                SimplifyResult& simplified, LevelReport& level_report) {
    FARFIELD_TRY_LET(level_report.apart, keep_apart(macrosurface, static_cast<float>(resolution), simplified,
                                                    cut_points_.find(simplified.surface.positions)));
    const ApartReport& apart = level_report.apart;
    if (apart.crossing > 0) {
      report_.warnings.push_back(fmt::format(
          "level {}: of {} vertices of walls close behind each other, {} still are on the wrong side; their "
          "colours may show through",
          level, apart.walls, apart.crossing));
    }
    return {};
  }

  /// Takes the surface around the last level's walls away. Pieces stay in wall_ where it still is macrosurface;
  /// half-open walls must be found again.
  void unwrap_walls(double resolution, std::vector<uint8_t>& is_macrosurface) {
    append(std::exchange(sheet_, {}), sub_resolution_);
    if (is_shell_.empty()) {  // there are none, or no level was worth wrapping them
      append(std::exchange(wall_, {}), sub_resolution_);
      return;
    }
    std::vector<uint8_t> is_wall_still = is_macrosurface, is_other = is_shell_, is_other_macrosurface;
    for (size_t f = 0; f < is_shell_.size(); ++f) {
      is_wall_still[f] &= is_shell_[f];
      is_other[f] = !is_shell_[f];
      if (is_other[f]) is_other_macrosurface.push_back(is_macrosurface[f]);
    }
    const auto stays = find_near(wall_, surface_, is_wall_still, 0.5 * resolution);
    wall_ = compact(split(wall_, stays, sub_resolution_).macrosurface);
    Surface shell;
    SplitSurface parts = split(surface_, is_other, shell);
    surface_ = std::move(parts.macrosurface);
    compose(from_stored_.face, parts.macro_face);
    is_macrosurface = std::move(is_other_macrosurface);
    is_shell_ = {};
  }

  /// Wraps what looks like a wall at this resolution or did before, and says the first face of what is around it.
  /// Levels are wrapped afresh, as volumes are made afresh.
  Result<size_t> wrap_walls(uint32_t level, double resolution, SplitSurface& parts, LevelReport& level_report) {
    FARFIELD_TRY_LET(const Walls walls, find_walls(sub_resolution_, parts.macrosurface, resolution));
    move_pieces(walls.kinds);
    const bool are_none = wall_.triangles.empty() && sheet_.triangles.empty();
    level_report.worthless = !are_none && level != last_level_ &&
                             least_shell_bytes(wall_, sheet_, resolution) > most_bytes_worth_writing(level);
    if (are_none || level_report.worthless) return parts.macrosurface.triangles.size();
    move_cores(walls.is_core, parts);
    const size_t first_shell_face = parts.macrosurface.triangles.size();
    FARFIELD_TRY(wrap(wall_, resolution, wrap_wall, parts.macrosurface));
    FARFIELD_TRY(wrap(sheet_, resolution, lay_sheet, parts.macrosurface));
    return first_shell_face;
  }

  /// What runs inside of walls leaves the macrosurface and is wrapped with their pieces.
  void move_cores(const std::vector<uint8_t>& is_core, SplitSurface& parts) {
    if (std::ranges::count(is_core, 1) == 0) return;
    std::vector<uint8_t> stays;
    for (const uint8_t is_one : is_core) stays.push_back(!is_one);
    SplitSurface rest = split(parts.macrosurface, stays, wall_);
    parts.macrosurface = std::move(rest.macrosurface);
    compose(parts.macro_face, rest.macro_face);
  }

  /// What is of walls leaves sub_resolution_.
  void move_pieces(const std::vector<WallKind>& kinds) {
    if (std::ranges::all_of(kinds, [](WallKind kind) { return kind == WallKind::None; })) return;
    Surface pieces;
    std::vector<uint8_t> is_none, is_closed;
    for (const WallKind kind : kinds) {
      is_none.push_back(kind == WallKind::None);
      if (kind != WallKind::None) is_closed.push_back(kind == WallKind::Closed);
    }
    sub_resolution_ = compact(split(sub_resolution_, is_none, pieces).macrosurface);
    append(compact(split(pieces, is_closed, sheet_).macrosurface), wall_);
  }

  /// Adds the surface around these pieces; where there is none to be seen they become sub-resolution geometry again.
  template <typename Wrap>
  Result<void> wrap(Surface& pieces, double resolution, const Wrap& wrapped, Surface& macrosurface) {
    if (pieces.triangles.empty()) return {};
    FARFIELD_TRY_LET(const Surface shell, wrapped(pieces, resolution));
    if (shell.triangles.empty()) append(std::exchange(pieces, {}), sub_resolution_);
    append(shell, macrosurface);
    return {};
  }

  /// Which faces of surface_ came from `first_shell_face` or later.
  void note_shell(size_t first_shell_face, const SimplifyResult& simplified, const SurfaceOrder& order) {
    if ((wall_.triangles.empty() && sheet_.triangles.empty()) || first_shell_face == simplified.face_map.size()) return;
    is_shell_.assign(surface_.triangles.size(), 0);
    for (size_t f = first_shell_face; f < simplified.face_map.size(); ++f) {
      if (simplified.face_map[f] != kMorphCollapsed) is_shell_[order.face_number[simplified.face_map[f]]] = 1;
    }
  }

  /// Step V, or its result from an interrupted bake.
  Result<LevelData> voxelize_rest(uint32_t level, double resolution, LevelReport& level_report) {
    const std::string stage = fmt::format("level {}: voxelise", level);
    options_.job.report(share_done(level, 0.05), stage);
    const Stopwatch watch;
    const VolumeJob job{sub_resolution_,
                        surface_,
                        place_lattice(sub_resolution_, middle_, resolution),
                        {.rays_per_voxel = options_.rays_per_voxel,
                         .seed = level,
                         .job = options_.job.step(stage, share_done(level, 0.05), share_done(level, 0.97))}};
    const std::string file_name = job.file_name();
    if (auto stored = workspace_.load_volume(file_name)) {
      level_report.resumed = true;
      return std::move(*stored);
    }
    if (level != last_level_) {  // the root is always wanted
      VoxelizeOptions estimate;
      estimate.rays_per_voxel = options_.rays_per_voxel;
      estimate.seed = level;
      estimate.job = options_.job.quiet();
      FARFIELD_TRY_LET(const auto size, estimate_volume(job.geometry, job.lattice, estimate));
      if (least_bytes(size, sub_resolution_, surface_) > most_bytes_worth_writing(level)) {
        level_report.worthless = true;
        level_report.triangles = surface_.triangles.size();
        level_report.voxelize_seconds = watch.seconds();
        return LevelData{};
      }
    }
    FARFIELD_TRY_LET(LevelData packed, job.run());
    if (packed.has_volume()) {
      if (const auto stored = workspace_.store_volume(file_name, packed); !stored) {
        report_.warnings.push_back("an interrupted bake could not be resumed: " + stored.error().message);
      }
    }
    level_report.voxelize_seconds = watch.seconds();
    return packed;
  }

  /// Writes a level if it is worth its bytes, and notes it in the manifest.
  Result<void> store_level(const LevelData& level, LevelReport& level_report) {
    const uint32_t number = level.header.level;
    level_report.triangles = face_count(level);
    level_report.voxels = voxel_count(level);
    if (options_.job.is_cancelled()) return cancelled();
    FARFIELD_TRY_LET(level_report.is_written,
                     writer_.write(view_of(level), level_report.grid, most_bytes_worth_writing(number)));
    if (level_report.is_written && number > 0)
      from_stored_ = identity_maps(surface_.positions.size(), surface_.triangles.size());
    return {};
  }

  /// The source is always written. A coarser level must save a tenth against the last one written; for the root, which
  /// stays resident, any saving will do. Level 0 counts with its textures as finely as that level would show them.
  uint64_t most_bytes_worth_writing(uint32_t level) const {
    if (report_.manifest.levels.empty()) return std::numeric_limits<uint64_t>::max();
    const LevelEntry& last = report_.manifest.levels.back();
    uint64_t before = last.resident_bytes;
    if (last.level == 0) before += texture_bytes(level);
    return most_bytes_after(before, level == last_level_);
  }

  /// Tiles have their textures together.
  uint64_t texture_bytes(uint32_t level) const {
    const double resolution = std::ldexp(report_.manifest.base_resolution, static_cast<int>(level));
    return texture_bytes_at(texel_areas_, look_, resolution) / options_.import.tile.count;
  }

  static tl::unexpected<Error> cancelled() { return make_error(ErrorCode::Cancelled, "bake: cancelled"); }

  /// How much of the whole bake is done when `part` of a level is: levels are weighted by about the rays they cast.
  double share_done(uint32_t level, double part) const {
    const auto weight = [](uint32_t k) { return std::max(std::pow(0.2, k - 1), 0.01); };
    double before = 0, all = 0;
    for (uint32_t k = 1; k <= last_level_; ++k) {
      all += weight(k);
      if (k < level) before += weight(k);
    }
    constexpr double kSource = 0.05;  // import and level 0
    return kSource + (1 - kSource) * (before + part * weight(level)) / all;
  }

  const BakeOptions& options_;
  BakeWorkspace workspace_;
  BakeReport report_;
  LevelWriter writer_;         ///< into report_.manifest
  SourceSurface source_;       ///< until it is resolved
  SurfaceOrder source_order_;  ///< of level 0, unless it has parts
  bool has_parts_ = false;     ///< level 0
  AssetLook look_;
  std::vector<double> texel_areas_;
  bool is_resolved_ = false;       ///< from then on surface_ is there
  Surface surface_;                ///< of the level at hand, in final order
  Surface sub_resolution_;         ///< all that has left the surface so far, but for wall_ and sheet_
  Surface wall_;                   ///< pieces of the walls that are wrapped at the level at hand
  Surface sheet_;                  ///< pieces of the half-open ones that are laid as sheets
  CutPoints cut_points_;           ///< if the source is a tile
  std::vector<uint8_t> is_shell_;  ///< faces of surface_ that are such walls
  MorphMaps from_stored_;          ///< from the last written level to surface_
  dvec3 middle_{0.0};              ///< of the source's bounds
  uint32_t last_level_ = 0;
};

BakeReport nothing_to_do(Manifest manifest, const Stopwatch& watch) {
  BakeReport report;
  report.warnings = manifest.warnings;
  report.manifest = std::move(manifest);
  report.up_to_date = true;
  report.total_seconds = watch.seconds();
  return report;
}

/// What goes into a manifest before anything is baked, and how the rest is.
struct Task {
  std::string source_name;
  uint64_t source_hash = 0;
  std::vector<HashedFile> source_files;
  std::vector<std::string> warnings;
  bool is_volume = false;
  std::function<Result<BakeReport>(BakeWorkspace workspace, BakeReport report)> run;
};

/// Runs a task unless its result is there already.
Result<BakeReport> bake_unless_up_to_date(Task task, const fs::path& out, const BakeOptions& options) {
  const Stopwatch watch;
  BakeReport report;
  report.warnings = task.warnings;
  report.manifest = make_manifest(task.source_name, task.source_hash, options, task.is_volume);
  report.manifest.source_files = std::move(task.source_files);
  report.manifest.warnings = std::move(task.warnings);
  const auto find_same = [&]() -> std::optional<Manifest> {
    auto manifest = read_manifest(out);
    const bool is_same = manifest && are_same_bake(*manifest, report.manifest) && is_whole(out, *manifest);
    return is_same && !options.even_if_up_to_date ? std::optional(std::move(*manifest)) : std::nullopt;
  };
  if (auto manifest = find_same()) return nothing_to_do(std::move(*manifest), watch);
  FARFIELD_TRY_LET(auto workspace, with_warnings(BakeWorkspace::open(out, options.job), report.warnings));
  if (workspace.has_waited()) {
    if (auto manifest = find_same()) return nothing_to_do(std::move(*manifest), watch);
  }
  const std::vector<std::string> warnings = report.warnings;
  FARFIELD_TRY_LET(
      auto baked,
      with_warnings(with_scratch([&] { return task.run(std::move(workspace), std::move(report)); }), warnings));
  baked.total_seconds = watch.seconds();
  return baked;
}

/// Imports a mesh or a volume and bakes it; import_seconds says how long the import took.
Result<BakeReport> import_and_bake(const fs::path& source, const fs::path& out, const BakeOptions& options,
                                   double& import_seconds) {
  const Stopwatch watch;
  const auto named_briefly = [&](auto imported) {
    std::vector<std::string>& warnings = imported ? imported->warnings : imported.error().warnings;
    warnings = without_folder(std::move(warnings), source.parent_path());
    import_seconds = watch.seconds();
    return imported;
  };
  if (is_volume_file(source)) {
    FARFIELD_TRY_LET(auto volume, named_briefly(read_volume(source, options.import.fog, options.job.quiet())));
    return bake(std::move(volume), source.filename().string(), out, options);
  }
  FARFIELD_TRY_LET(auto asset, named_briefly(import_asset(source, import_options(options), options.job.quiet())));
  return bake(std::move(asset), source.filename().string(), out, options);
}

}  // namespace

ImportOptions import_options(const BakeOptions& options) {
  ImportOptions import = options.import;
  import.subdivision.grid = 2 * options.finest_grid;
  return import;
}

std::optional<Manifest> find_up_to_date(const fs::path& source, const fs::path& out, const BakeOptions& options) {
  auto manifest = read_manifest(out);
  if (!manifest || !manifest->source_files) return std::nullopt;
  const auto source_hash = hash_source(source, *manifest->source_files, options.import);
  if (!source_hash) return std::nullopt;
  const Manifest wanted = make_manifest(source.filename().string(), *source_hash, options, is_volume_file(source));
  if (!are_same_bake(*manifest, wanted) || !is_whole(out, *manifest)) return std::nullopt;
  return std::move(*manifest);
}

Result<BakeReport> bake(const fs::path& source, const fs::path& out, const BakeOptions& options) {
  FARFIELD_TRY(check_options(options));
  const Stopwatch watch;
  if (auto manifest = find_up_to_date(source, out, options)) return nothing_to_do(std::move(*manifest), watch);
  // Before the import, which may take minutes.
  FARFIELD_TRY(check_replaceable(out));
  FARFIELD_TRY_LET(const bool has_waited, wait_for_other_bake(out, options.job));
  if (has_waited) {
    if (auto manifest = find_up_to_date(source, out, options)) return nothing_to_do(std::move(*manifest), watch);
  }
  options.job.report(0, "import");
  double import_seconds = 0;
  FARFIELD_TRY_LET(auto report, import_and_bake(source, out, options, import_seconds));
  report.import_seconds = import_seconds;
  report.total_seconds += import_seconds;
  return report;
}

Result<BakeReport> bake(ImportedAsset asset, const std::string& source_name, const fs::path& out,
                        const BakeOptions& options) {
  FARFIELD_TRY(check_options(options));
  Task task{source_name, asset.source_hash, std::move(asset.source_files), std::move(asset.warnings), false, {}};
  task.run = [&](BakeWorkspace workspace, BakeReport report) {
    return Baker(options, std::move(asset.source), std::move(workspace), std::move(report)).run();
  };
  return bake_unless_up_to_date(std::move(task), out, options);
}

Result<BakeReport> bake(SourceVolume volume, const std::string& source_name, const fs::path& out,
                        const BakeOptions& options) {
  FARFIELD_TRY(check_options(options));
  Task task{source_name, volume.source_hash, {}, std::move(volume.warnings), true, {}};
  task.run = [&](BakeWorkspace workspace, BakeReport report) {
    return bake_levels(volume, options, std::move(workspace), std::move(report));
  };
  return bake_unless_up_to_date(std::move(task), out, options);
}

}  // namespace farfield
