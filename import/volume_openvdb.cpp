// SPDX-License-Identifier: Apache-2.0
// The module farfield_volumes, and what reads OpenVDB files [Museth 2013], or NanoVDB's by way of OpenVDB's grids.
// Nothing of OpenVDB leaves this file; what it throws ends here as an Error.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "base/text.h"
#include "farfield/export.h"
#include "import/vdb_leaves.h"
#include "import/volume_channels_openvdb.h"
#include "import/volume_module.h"
#include "import/volume_nanovdb.h"
#include "import/volume_write_openvdb.h"
#include "import/voxel_shape.h"

namespace farfield {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr uint64_t kLeavesBetweenRests = 4096;
constexpr double kSmallNegative = 1e-3;  ///< of the largest density: what filters leave behind, not an error
constexpr std::array<const char*, 6> kEmissionNames = {"temperature", "heat", "flame", "flames", "fire", "emission"};

bool is_emission(const std::string& name) {
  return std::ranges::find(kEmissionNames, lower_case(name)) != kEmissionNames.end();
}

bool is_scalar(const openvdb::GridBase& grid) { return grid.valueType() == "float" || grid.valueType() == "double"; }
bool is_level_set(const openvdb::GridBase& grid) { return grid.getGridClass() == openvdb::GRID_LEVEL_SET; }

/// A file's grids without their voxels.
struct Contents {
  std::vector<openvdb::GridBase::Ptr> grids;

  std::string list() const {
    std::string text;
    for (const auto& grid : grids) {
      text += fmt::format("{}\"{}\" ({}{})", text.empty() ? "" : ", ", grid->getName(), grid->valueType(),
                          is_level_set(*grid) ? ", level set" : "");
    }
    return text.empty() ? "none" : text;
  }
};

/// Where the last of a file's grids ends, by what the file says.
class GridEnds : openvdb::io::Archive {
 public:
  explicit GridEnds(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    readHeader(stream);
    setFormatVersion(stream);
    setLibraryVersion(stream);
    setDataCompression(stream);
    openvdb::MetaMap().readMeta(stream);
    for (int32_t i = 0, count = readGridCount(stream); i < count && stream; ++i) {
      openvdb::io::GridDescriptor grid;
      grid.read(stream);
      last = std::max(last, static_cast<uint64_t>(grid.getEndPos()));
      grid.seekToEnd(stream);
    }
  }
  uint64_t last = 0;
};

/// How a grid's lattice lies in the source's space.
struct Lattice {
  openvdb::math::Mat4d index_to_source;
  VoxelShape shape;

  /// index: in OpenVDB's sense, where voxels have their centres at whole numbers.
  dvec3 to_source(const openvdb::Vec3d& index) const {
    const openvdb::Vec3d p = index_to_source.transform(index);
    return {p.x(), p.y(), p.z()};
  }
};

/// Reads one file. One thread at a time.
class VdbReader {
 public:
  VdbReader(const std::string& path, const FogOptions& options, const Job& job)
      : path_(path), options_(options), job_(job), file_(path) {}

  Result<VolumeExtent> read_extent() {
    FARFIELD_TRY_LET(const auto grid, open_density());
    FARFIELD_TRY_LET(const Lattice lattice, lattice_of(*grid));
    const auto lower = grid->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MIN);
    const auto upper = grid->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MAX);
    CoordBBox box;
    if (lower && upper) {
      box = CoordBBox(Coord(lower->value()), Coord(upper->value()));
    } else {  // written without statistics
      box = load(grid->getName())->evalActiveVoxelBoundingBox();
    }
    if (box.empty()) return nothing_in(grid->getName());
    VolumeExtent extent{dvec3(INFINITY), dvec3(-INFINITY)};
    for (int i = 0; i < 8; ++i) {
      const openvdb::Vec3d corner((i & 1 ? box.max().x() + 0.5 : box.min().x() - 0.5),
                                  (i & 2 ? box.max().y() + 0.5 : box.min().y() - 0.5),
                                  (i & 4 ? box.max().z() + 0.5 : box.min().z() - 0.5));
      extent.lower = glm::min(extent.lower, lattice.to_source(corner));
      extent.upper = glm::max(extent.upper, lattice.to_source(corner));
    }
    return extent;
  }

  Result<VolumeOnLattice> read() {
    FARFIELD_TRY_LET(const auto header, open_density());
    FARFIELD_TRY_LET(const Lattice lattice, lattice_of(*header));
    volume_.rotation = lattice.shape.rotation;
    volume_.voxel_size = lattice.shape.size;
    volume_.anisotropy = static_cast<float>(options_.anisotropy);
    const std::string name = header->getName();
    const bool is_double = header->valueType() == "double";
    FARFIELD_TRY(is_double ? take_density<openvdb::DoubleGrid>(name, lattice)
                           : take_density<openvdb::FloatGrid>(name, lattice));
    used_ = {name};
    FARFIELD_TRY(read_channels({path_, options_, [&](const std::string& grid) { return load(grid); }, contents_.grids,
                                *header, first_voxel_, is_paged_},
                               volume_, used_));
    warn_of_the_rest();
    return VolumeOnLattice{std::move(volume_), lattice.shape};
  }

 private:
  template <typename... Args>
  tl::unexpected<Error> error(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) const {
    return make_error(code, fmt::format("{}: {}", path_, fmt::format(text, std::forward<Args>(args)...)));
  }
  tl::unexpected<Error> cancelled() const { return make_error(ErrorCode::Cancelled, "read volume: cancelled"); }
  tl::unexpected<Error> nothing_in(const std::string& name) const {
    return error(ErrorCode::BadFile, "the grid \"{}\" has no voxel with a density: there is nothing to see", name);
  }

  // ---- which grid

  Result<openvdb::GridBase::Ptr> open_density() {
    if (is_nanovdb_file(path_)) {
      FARFIELD_TRY(open_nanovdb());
    } else {
      FARFIELD_TRY(check_whole());
      file_.setCopyMaxBytes(0);
      file_.open(/*delayLoad=*/is_paged_);
      for (auto name = file_.beginName(); name != file_.endName(); ++name) {
        contents_.grids.push_back(file_.readGridMetadata(name.gridName()));
      }
    }
    if (contents_.grids.empty()) return error(ErrorCode::BadFile, "there is no grid in it; was it cut short?");
    return choose_density();
  }

  /// A file that is cut short must not be mapped: what is behind its end reads as anything.
  Result<void> check_whole() {
    std::error_code unknown;
    const uint64_t bytes = std::filesystem::file_size(path_, unknown);
    is_paged_ = !unknown && bytes >= kPagedFileBytes && !options_.level_set;
    if (!is_paged_) return {};
    const uint64_t wanted = GridEnds(path_).last;
    if (wanted <= bytes) return {};
    return error(ErrorCode::BadFile, "it is cut short: its grids need {} bytes and it has {}", wanted, bytes);
  }

  /// All of its grids are in memory at once.
  Result<void> open_nanovdb() {
    auto read = read_nanovdb(path_);
    if (!read) return error(read.error().code, "{}", read.error().message);
    is_in_memory_ = true;
    contents_.grids = std::move(read->grids);
    for (const std::string& other : read->others) warn("a grid that is ignored: {}", other);
    if (contents_.grids.empty()) {
      return error(ErrorCode::Unsupported,
                   "none of its grids is of float, double, Fp4, Fp8, Fp16 or Vec3f: {}; convert it to .vdb",
                   fmt::join(read->others, ", "));
    }
    return {};
  }

  /// A grid with its voxels.
  openvdb::GridBase::Ptr load(const std::string& name) {
    if (!is_in_memory_) return file_.readGrid(name);
    for (const auto& grid : contents_.grids)
      if (grid->getName() == name) return grid;
    return nullptr;
  }

  Result<openvdb::GridBase::Ptr> choose_density() const {
    const auto named = [&](const std::string& name) -> openvdb::GridBase::Ptr {
      for (const auto& grid : contents_.grids)
        if (grid->getName() == name) return grid;
      return nullptr;
    };
    if (!options_.density_grid.empty()) {
      const auto grid = named(options_.density_grid);
      if (!grid) {
        return error(ErrorCode::Unsupported, "there is no grid \"{}\"; it has {}", options_.density_grid,
                     contents_.list());
      }
      return check_density(grid);
    }
    if (const auto grid = named("density")) return check_density(grid);
    std::vector<openvdb::GridBase::Ptr> fogs;
    for (const auto& grid : contents_.grids) {
      if (is_scalar(*grid) && !is_emission(grid->getName()) && (options_.level_set || !is_level_set(*grid)))
        fogs.push_back(grid);
    }
    if (fogs.size() == 1) return check_density(fogs.front());
    return error(ErrorCode::Unsupported, "{}; choose one of its grids with --density-grid: {}",
                 fogs.empty() ? "no float grid is a fog volume" : "several float grids could be the density",
                 contents_.list());
  }

  Result<openvdb::GridBase::Ptr> check_density(const openvdb::GridBase::Ptr& grid) const {
    const std::string name = grid->getName();
    if (is_emission(name)) {
      return error(ErrorCode::Unsupported,
                   "the grid \"{}\" is emission, which is not modelled yet; choose a density with --density-grid: {}",
                   name, contents_.list());
    }
    if (!is_scalar(*grid)) {
      return error(ErrorCode::Unsupported, "the grid \"{}\" holds {}, a density is float; choose among {}", name,
                   grid->valueType(), contents_.list());
    }
    if (is_level_set(*grid) && !options_.level_set) {
      return error(ErrorCode::Unsupported,
                   "the grid \"{}\" is a level set, a surface; with --level-set the inside is taken as fog", name);
    }
    return grid;
  }

  // ---- where it lies

  Result<Lattice> lattice_of(const openvdb::GridBase& grid) const {
    const auto affine = grid.transform().isLinear() ? grid.transform().baseMap()->getAffineMap() : nullptr;
    if (!affine) {
      return error(ErrorCode::Unsupported, "the grid \"{}\" lies in a frustum; resample it to a linear transform",
                   grid.getName());
    }
    Lattice lattice{affine->getMat4(), {}};
    std::array<dvec3, 3> edges;
    for (int axis = 0; axis < 3; ++axis) {  // rows: OpenVDB's vectors stand on the left
      const auto& m = lattice.index_to_source;
      edges[static_cast<size_t>(axis)] = {m(axis, 0), m(axis, 1), m(axis, 2)};
    }
    lattice.shape = voxel_shape(edges);
    if (lattice.shape.is_singular)
      return error(ErrorCode::BadFile, "the transform of the grid \"{}\" is singular or not finite", grid.getName());
    return lattice;
  }

  // ---- densities

  /// What is active: tiles first, then the voxels of leaves. Of a file that is paged leaves lose their values when
  /// they have been looked at.
  template <typename Grid, typename Tile, typename Leaf>
  void for_each_active(Grid& grid, const Tile& tile, const Leaf& leaf) const {
    auto value = grid.cbeginValueOn();
    value.setMaxDepth(Grid::ValueOnCIter::LEAF_DEPTH - 1);
    for (; value; ++value) {
      CoordBBox box;
      value.getBoundingBox(box);
      tile(box, static_cast<double>(*value));
    }
    for (auto* of_grid : sorted_leaves(grid)) {
      leaf(*of_grid);
      if (is_paged_) drop_values(*of_grid);
    }
  }

  template <typename Grid>
  typename Grid::Ptr load_density(const std::string& name) {
    auto grid = openvdb::gridPtrCast<Grid>(load(name));
    if (is_level_set(*grid)) openvdb::tools::sdfToFogVolume(*grid);
    return grid;
  }

  template <typename Grid>
  Result<void> take_density(const std::string& name, const Lattice& lattice) {
    auto grid = load_density<Grid>(name);
    if (job_.is_cancelled()) return cancelled();
    const double background = static_cast<double>(grid->background());
    if (background != 0) {
      return error(ErrorCode::Unsupported, "the grid \"{}\" has density {} all around: a volume must end somewhere",
                   name, background);
    }
    FARFIELD_TRY_LET(const CoordBBox box, check_values(*grid));
    FARFIELD_TRY(make_table(name, box));
    const Coord corner = box.min();
    volume_.origin = lattice.to_source(openvdb::Vec3d(corner.x() - 0.5, corner.y() - 0.5, corner.z() - 0.5));
    first_voxel_ = corner;
    if (is_paged_) grid = load_density<Grid>(name);
    volume_.bricks.reserve(bricks_of_leaves(*grid, box));
    Result<void> done;
    uint64_t leaves = 0;
    for_each_active(
        *grid,
        [&](const CoordBBox& tile, double value) {
          if (done) done = fill_tile(tile, value);
        },
        [&](const auto& leaf) {
          if (done) done = fill_leaf(leaf);
          if (++leaves % kLeavesBetweenRests == 0 && is_much_in_memory()) rest(volume_);
        });
    FARFIELD_TRY(std::move(done));
    return count_voxels(name);
  }

  /// How many bricks hold voxels of leaves that are active, within the box: they are there once, and do not grow.
  template <typename Grid>
  size_t bricks_of_leaves(Grid& grid, const CoordBBox& box) const {
    std::vector<bool> is_there(volume_.brick_table.size(), false);
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
      for (auto v = leaf->cbeginValueOn(); v; ++v) {
        if (!box.isInside(v.getCoord())) continue;
        const Coord at = v.getCoord() - first_voxel_;
        is_there[volume_.table_index(ivec3(at.x(), at.y(), at.z()) / kVolumeBrickSide)] = true;
      }
    return static_cast<size_t>(std::count(is_there.begin(), is_there.end(), true));
  }

  /// The bounds of what has a density, once every value is known to be one.
  template <typename Grid>
  Result<CoordBBox> check_values(Grid& grid) {
    double largest = 0, smallest = 0;
    Coord smallest_at, broken_at;
    std::optional<double> broken;
    CoordBBox box;
    const auto look_at = [&](double value, const Coord& at) {
      if (!std::isfinite(value) && !broken) broken = value, broken_at = at;
      if (value < smallest) smallest = value, smallest_at = at;
      largest = std::max(largest, value);
      return value > 0;
    };
    for_each_active(
        grid,
        [&](const CoordBBox& tile, double value) {
          if (look_at(value, tile.min())) box.expand(tile);
        },
        [&](const auto& leaf) {
          for (auto v = leaf.cbeginValueOn(); v; ++v) {
            const Coord at = v.getCoord();
            if (look_at(static_cast<double>(*v), at)) box.expand(at);
          }
        });
    if (broken) {
      return error(ErrorCode::BadFile, "the grid \"{}\" has the density {} at voxel {}; clean it where it was made",
                   grid.getName(), *broken, coordinate_text(broken_at));
    }
    if (box.empty()) return nothing_in(grid.getName());
    if (smallest < -kSmallNegative * largest) {
      return error(ErrorCode::BadFile,
                   "the grid \"{}\" has the negative density {} at voxel {}; clean it where it was made",
                   grid.getName(), smallest, coordinate_text(smallest_at));
    }
    if (smallest < 0) {
      warn("the grid \"{}\" has densities below 0, down to {}: taken as 0", grid.getName(), smallest);
    }
    if (!(largest * options_.density_scale <= kDensestVolume)) {
      return error(ErrorCode::BadFile,
                   "the density {} times the scale {} is more than {}: choose another --density-scale", largest,
                   options_.density_scale, kDensestVolume);
    }
    return box;
  }

  Result<void> make_table(const std::string& name, const CoordBBox& box) {
    const glm::i64vec3 lower(box.min().x(), box.min().y(), box.min().z());
    const glm::i64vec3 dims = glm::i64vec3(box.max().x(), box.max().y(), box.max().z()) - lower + glm::i64vec3(1);
    const glm::i64vec3 bricks = (dims + glm::i64vec3(7)) / glm::i64vec3(8);
    const auto most = static_cast<int64_t>(kMostTableBricks);
    const bool fits = bricks.x <= most && bricks.y <= most / bricks.x && bricks.z <= most / (bricks.x * bricks.y);
    if (!fits) {
      return error(ErrorCode::Unsupported,
                   "the grid \"{}\" extends over {} x {} x {} voxels, {} million blocks of 8^3 are possible; "
                   "crop it or split it into several files",
                   name, dims.x, dims.y, dims.z, kMostTableBricks >> 20);
    }
    volume_.dims = ivec3(dims);
    volume_.brick_dims = ivec3(bricks);
    volume_.brick_table.assign(static_cast<size_t>(bricks.x * bricks.y * bricks.z), kEmptyBrick);
    return {};
  }

  float scaled(double value) const { return static_cast<float>(value * options_.density_scale); }

  uint32_t add_brick(float density) {
    volume_.bricks.emplace_back().fill(density);
    return static_cast<uint32_t>(volume_.bricks.size() - 1);
  }

  DensityBrick& own_brick(size_t table_index) {
    uint32_t& index = volume_.brick_table[table_index];
    if (index == kEmptyBrick) index = add_brick(0.0f);
    return volume_.bricks[index];
  }

  template <typename LeafNode>
  Result<void> fill_leaf(const LeafNode& leaf) {
    for (auto v = leaf.cbeginValueOn(); v; ++v) {
      const double value = static_cast<double>(*v);
      if (!(value > 0)) continue;
      const Coord at = v.getCoord() - first_voxel_;
      const ivec3 voxel(at.x(), at.y(), at.z());
      own_brick(volume_.table_index(voxel / kVolumeBrickSide))[index_in_brick(voxel)] = scaled(value);
    }
    return check_size();
  }

  /// Bricks that a tile covers wholly are one and the same.
  Result<void> fill_tile(const CoordBBox& tile, double value) {
    if (!(value > 0)) return {};
    const auto [shared, is_new] = tile_bricks_.try_emplace(value, kEmptyBrick);
    const Coord lower_coord = tile.min() - first_voxel_, upper_coord = tile.max() - first_voxel_;
    const ivec3 lower(lower_coord.x(), lower_coord.y(), lower_coord.z());
    const ivec3 upper(upper_coord.x(), upper_coord.y(), upper_coord.z());
    ivec3 brick;
    for (brick.z = lower.z / 8; brick.z <= upper.z / 8; ++brick.z)
      for (brick.y = lower.y / 8; brick.y <= upper.y / 8; ++brick.y)
        for (brick.x = lower.x / 8; brick.x <= upper.x / 8; ++brick.x) {
          const ivec3 first = glm::max(lower, brick * 8), last = glm::min(upper, brick * 8 + 7);
          const size_t entry = volume_.table_index(brick);
          if (last - first == ivec3(7)) {
            if (shared->second == kEmptyBrick) shared->second = add_brick(scaled(value));
            volume_.brick_table[entry] = shared->second;
            continue;
          }
          DensityBrick& own = own_brick(entry);
          for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
              for (int x = first.x; x <= last.x; ++x) own[index_in_brick({x, y, z})] = scaled(value);
        }
    return check_size();
  }

  Result<void> check_size() const {
    if (job_.is_cancelled()) return cancelled();
    if (volume_.bricks.size() < kEmptyBrick - 1) return {};
    return too_large();
  }
  tl::unexpected<Error> too_large() const {
    return error(ErrorCode::Unsupported, "it has more than {} million voxels; split it into several files",
                 kMostVolumeVoxels / 1000000);
  }

  Result<void> count_voxels(const std::string& name) {
    std::vector<uint32_t> active(volume_.bricks.size(), 0);
    for (size_t i = 0; i < volume_.bricks.size(); ++i) {
      for (const float density : volume_.bricks[i]) {
        if (density > 0) ++active[i];
        volume_.densest = std::max(volume_.densest, density);
      }
    }
    for (const uint32_t index : volume_.brick_table) {
      if (index == kEmptyBrick) continue;
      ++volume_.filled_bricks;
      volume_.active_voxels += active[index];
    }
    if (volume_.active_voxels > kMostVolumeVoxels) return too_large();
    if (volume_.active_voxels == 0) return nothing_in(name);  // all were so thin that the scale left nothing
    return {};
  }

  // ---- what is said

  template <typename... Args>
  void warn(fmt::format_string<Args...> text, Args&&... args) {
    volume_.warnings.push_back(fmt::format("{}: {}", path_, fmt::format(text, std::forward<Args>(args)...)));
  }

  void warn_of_the_rest() {
    std::string emission, others;
    for (const auto& grid : contents_.grids) {
      const std::string name = grid->getName();
      if (used_.contains(name)) continue;
      std::string& list = is_emission(name) ? emission : others;
      list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", name);
    }
    if (!emission.empty()) warn("emission is not modelled yet; ignored: {}", emission);
    if (!others.empty()) warn("grids that are ignored: {}", others);
  }

  const std::string& path_;
  const FogOptions& options_;
  const Job& job_;
  openvdb::io::File file_;
  bool is_paged_ = false;      ///< leaves are read when they are looked at, and not kept
  bool is_in_memory_ = false;  ///< of NanoVDB: file_ is not open, contents_ has voxels
  Contents contents_;
  SourceVolume volume_;
  Coord first_voxel_;
  std::map<double, uint32_t> tile_bricks_;  ///< by density
  std::set<std::string> used_;              ///< names of grids
};

/// What OpenVDB throws of a file is about its bytes.
template <typename T, typename Read>
Result<T> guarded(const std::string& path, const Read& read) {
  try {
    openvdb::initialize();
    return read();
  } catch (const ScratchFull& full) {
    return tl::unexpected(full.error);
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::BadFile,
                      fmt::format("{}: asks for more memory than there is: it is too large, or damaged", path));
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: not a readable OpenVDB file: {}", path, exception.what()));
  }
}

Result<VolumeExtent> read_extent(const std::string& path, const FogOptions& options) {
  return guarded<VolumeExtent>(path, [&] { return VdbReader(path, options, {}).read_extent(); });
}

Result<VolumeOnLattice> read(const std::string& path, const FogOptions& options, const Job& job) {
  return guarded<VolumeOnLattice>(path, [&] { return VdbReader(path, options, job).read(); });
}

}  // namespace
}  // namespace farfield

extern "C" FARFIELD_API const farfield::VolumeModule farfield_volume_module_4;
const farfield::VolumeModule farfield_volume_module_4 = {farfield::read_extent, farfield::read,
                                                         farfield::write_openvdb};
