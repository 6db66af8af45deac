// SPDX-License-Identifier: Apache-2.0
#include "import/volume_channels_openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "import/vdb_leaves.h"
#include "import/voxel_ellipsoid.h"

namespace farfield {
namespace {

using openvdb::Coord;
using Matrix = glm::dmat3;

constexpr size_t kBricksBetweenRests = 256;

/// "_level_3" of "density_level_3", a grid of several levels as OpenVDB's tools and ours name them; else nothing.
std::string level_suffix(const std::string& name) {
  constexpr std::string_view kMark = "_level_";
  const size_t at = name.rfind(kMark);
  const bool has_number = at != std::string::npos && at + kMark.size() < name.size() &&
                          name.find_first_not_of("0123456789", at + kMark.size()) == std::string::npos;
  return has_number ? name.substr(at) : "";
}

vec3 to_vec3(const openvdb::Vec3s& v) { return {v.x(), v.y(), v.z()}; }
std::string text_of(const openvdb::Vec3s& v) { return fmt::format("({}, {}, {})", v.x(), v.y(), v.z()); }
std::string text_of(double v) { return fmt::format("{}", v); }
bool is_number(const openvdb::Vec3s& v) { return is_finite(to_vec3(v)); }
bool is_number(double v) { return std::isfinite(v); }

/// A voxel of the volume: in one of its bricks, and in the file.
struct Place {
  size_t brick, voxel;
  Coord at;
};

class ChannelReader {
 public:
  ChannelReader(const VdbChannels& from, SourceVolume& volume, std::set<std::string>& used)
      : from_(from), volume_(volume), used_(used), suffix_(level_suffix(from.density.getName())) {}

  Result<void> run() {
    const auto medium = from_.density.getMetadata<openvdb::StringMetadata>("farfield_medium");
    FARFIELD_TRY(read_shapes());
    return medium && medium->value() == "flakes" ? read_flakes() : read_fog();
  }

 private:
  template <typename... Args>
  tl::unexpected<Error> error(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) const {
    return make_error(code, fmt::format("{}: {}", from_.path, fmt::format(text, std::forward<Args>(args)...)));
  }
  template <typename... Args>
  void warn(fmt::format_string<Args...> text, Args&&... args) {
    volume_.warnings.push_back(fmt::format("{}: {}", from_.path, fmt::format(text, std::forward<Args>(args)...)));
  }

  // ---- grids

  /// The first of these names that is a grid of this type.
  openvdb::GridBase::Ptr find(std::initializer_list<const char*> names, const std::string& type) const {
    for (const char* name : names)
      for (const auto& grid : from_.grids)
        if (grid->getName() == name + suffix_ && grid->valueType() == type) return grid;
    return nullptr;
  }
  bool has(const char* name, const std::string& type) const { return find({name}, type) != nullptr; }

  /// Calls take(place, value) for all voxels with a density; false if there is no such grid.
  template <typename Grid, typename Take>
  Result<bool> read(std::initializer_list<const char*> names, const Take& take) {
    const auto header = find(names, openvdb::typeNameAsString<typename Grid::ValueType>());
    if (!header) return false;
    const std::string name = header->getName();
    used_.insert(name);
    if (header->transform() != from_.density.transform()) {
      return error(ErrorCode::Unsupported, "the grids \"{}\" and \"{}\" have other transforms; resample one{}",
                   from_.density.getName(), name,
                   names.begin()[0] == std::string("albedo") ? ", or give --albedo" : "");
    }
    const auto grid = openvdb::gridPtrCast<Grid>(from_.load(name));
    if (!grid) return error(ErrorCode::BadFile, "the grid \"{}\" cannot be read as {}", name, header->valueType());
    unshare_bricks();
    const auto accessor = grid->getConstAccessor();
    const auto leaves = from_.is_paged ? sorted_leaves(*grid) : std::vector<typename Grid::TreeType::LeafNodeType*>();
    size_t dropped = 0;
    Result<void> done;
    for_each_place([&](const Place& place) {
      // Places come by bricks, and the next one may start seven layers before this one.
      while (dropped < leaves.size() && leaves[dropped]->origin().z() + 2 * kVolumeBrickSide <= place.at.z())
        drop_values(*leaves[dropped++]);
      const auto& value = accessor.getValue(place.at);
      if (is_number(value))
        take(place, value);
      else if (done)
        done = error(ErrorCode::BadFile, "the grid \"{}\" has the value {} at voxel {}; clean it where it was made",
                     name, text_of(value), coordinate_text(place.at));
    });
    FARFIELD_TRY(std::move(done));
    return true;
  }

  template <typename Visit>
  void for_each_place(const Visit& visit) const {
    for (size_t entry = 0; entry < volume_.brick_table.size(); ++entry) {
      const uint32_t index = volume_.brick_table[entry];
      if (index == kEmptyBrick) continue;
      if (entry % kBricksBetweenRests == 0 && is_much_in_memory()) rest(volume_);
      const ivec3 corner = volume_.brick_of_entry(entry) * kVolumeBrickSide;
      for (int i = 0; i < kVolumeBrickVoxels; ++i) {
        if (!(volume_.bricks[index][static_cast<size_t>(i)] > 0)) continue;
        const ivec3 v = corner + voxel_in_brick(i);
        visit(Place{index, static_cast<size_t>(i), from_.first_voxel + Coord(v.x, v.y, v.z)});
      }
    }
  }

  /// Tiles share their densities' bricks, but not what else they have.
  void unshare_bricks() {
    if (is_unshared_) return;
    is_unshared_ = true;
    volume_.bricks.reserve(volume_.filled_bricks);
    std::vector<bool> is_used(volume_.bricks.size(), false);
    for (uint32_t& index : volume_.brick_table) {
      if (index == kEmptyBrick) continue;
      if (is_used[index]) {
        volume_.bricks.push_back(DensityBrick(volume_.bricks[index]));
        index = static_cast<uint32_t>(volume_.bricks.size() - 1);
        continue;
      }
      is_used[index] = true;
    }
  }

  /// A channel of numbers within [least, most]; values outside are clamped, and said to be.
  Result<bool> read_numbers(const char* name, float least, float most, BigVector<NumberBrick>& bricks) {
    uint64_t clamped = 0;
    FARFIELD_TRY_LET(const bool is_there, read<openvdb::FloatGrid>({name}, [&](const Place& p, float value) {
                       bricks.resize(volume_.bricks.size());
                       bricks[p.brick][p.voxel] = std::clamp(value, least, most);
                       clamped += bricks[p.brick][p.voxel] != value;
                     }));
    if (clamped > 0)
      warn("the grid \"{}{}\" has {} values outside [{}, {}]: clamped", name, suffix_, clamped, least, most);
    return is_there;
  }

  /// The same of colours.
  Result<bool> read_colors(const char* name, float most, BigVector<ColorBrick>& bricks) {
    uint64_t clamped = 0;
    FARFIELD_TRY_LET(const bool is_there,
                     read<openvdb::Vec3SGrid>({name}, [&](const Place& p, const openvdb::Vec3s& value) {
                       bricks.resize(volume_.bricks.size());
                       bricks[p.brick][p.voxel] = glm::clamp(to_vec3(value), vec3(0.0f), vec3(most));
                       clamped += bricks[p.brick][p.voxel] != to_vec3(value);
                     }));
    if (clamped > 0) warn("the grid \"{}{}\" has {} colours outside [0, {}]: clamped", name, suffix_, clamped, most);
    return is_there;
  }

  double number(const char* name) const {
    const auto metadata = from_.density.getMetadata<openvdb::DoubleMetadata>(name);
    return metadata && std::isfinite(metadata->value()) ? metadata->value() : 0.0;
  }

  // ---- fog

  Result<void> read_fog() {
    FARFIELD_TRY(read_albedo());
    if (from_.options.anisotropy != 0) return {};
    volume_.anisotropy =
        static_cast<float>(std::clamp(number("farfield_anisotropy"), -kMostAnisotropy, kMostAnisotropy));
    constexpr auto kMost = static_cast<float>(kMostAnisotropy);
    FARFIELD_TRY_LET(const bool is_of_all, read_numbers("anisotropy", -kMost, kMost, volume_.anisotropies));
    if (is_of_all) return {};  // of all that a voxel scatters: nothing is left to tell apart
    FARFIELD_TRY(read_numbers("self_shadowing", 1.0f / 255, 1, volume_.self_shadowing));
    return {};
  }

  Result<void> read_albedo() {
    if (from_.options.albedo) {
      volume_.albedo = *from_.options.albedo;
      return {};
    }
    uint64_t clamped = 0;
    FARFIELD_TRY_LET(const bool is_there,
                     read<openvdb::Vec3SGrid>({"albedo", "Cd"}, [&](const Place& p, const auto& value) {
                       volume_.albedos.resize(volume_.bricks.size());
                       for (int c = 0; c < 3; ++c) {
                         const float in_range = std::clamp(value[c], 0.0f, 1.0f);
                         clamped += in_range != value[c];
                         volume_.albedos[p.brick][p.voxel][static_cast<size_t>(c)] =
                             static_cast<uint16_t>(std::lround(65535.0f * in_range));
                       }
                     }));
    if (clamped > 0) warn("it has {} albedos outside [0, 1]: clamped", clamped);
    if (is_there) return {};
    volume_.albedo = vec3(kDefaultAlbedo);
    warn("it says no albedo: {} is taken, --albedo says another", kDefaultAlbedo);
    return {};
  }

  // ---- flakes

  Result<void> read_flakes() {
    if (from_.options.albedo || from_.options.anisotropy != 0)
      warn("--albedo and --anisotropy are of fog, and its voxels are flakes: ignored");
    SourceFlakes& flakes = volume_.flakes.emplace();
    FARFIELD_TRY_LET(const bool is_diffuse, read_colors("diffuse", 1, flakes.diffuse));
    FARFIELD_TRY_LET(const bool is_specular, read_colors("specular", 1, flakes.specular));
    FARFIELD_TRY_LET(const bool is_translucent, read_colors("transmission", 1, flakes.transmission));
    if (!is_diffuse && !is_specular && !is_translucent) FARFIELD_TRY(read_colors("albedo", 1, flakes.diffuse));
    if (is_specular) FARFIELD_TRY(read_numbers("roughness", 0, 1, flakes.roughness));
    FARFIELD_TRY(read_colors("emission", 1e30f, flakes.emission));
    FARFIELD_TRY(read_numbers("self_shadowing", 1.0f / 255, 1, volume_.self_shadowing));
    FARFIELD_TRY(read<openvdb::Int32Grid>({"octants"}, [&](const Place& p, int32_t value) {
      flakes.octants.resize(volume_.bricks.size());
      flakes.octants[p.brick][p.voxel] = static_cast<uint16_t>(value);
    }));
    flakes.hot_spot = static_cast<float>(number("farfield_hot_spot"));
    flakes.highlight_lean = static_cast<float>(number("farfield_highlight_lean"));
    if (const auto side = from_.density.getMetadata<openvdb::Vec3DMetadata>("farfield_open_side")) {
      const dvec3 in_source(side->value().x(), side->value().y(), side->value().z());
      flakes.open_side = vec3(glm::transpose(volume_.rotation) * in_source);
    }
    // What exports write beside, for others, is in these.
    for (const char* derived : {"albedo", "density_isotropic"}) used_.insert(derived + suffix_);
    return {};
  }

  // ---- shapes

  Result<void> read_shapes() {
    const bool has_diagonal = has("sggx_diagonal", "vec3s"), has_rest = has("sggx_off_diagonal", "vec3s");
    if (has_diagonal != has_rest) {
      return error(ErrorCode::Unsupported,
                   "the grids \"sggx_diagonal{0}\" and \"sggx_off_diagonal{0}\" belong together; "
                   "there is one of them",
                   suffix_);
    }
    if (has_diagonal) return read_ellipsoids();
    return read_fibres();
  }

  Result<void> read_ellipsoids() {
    FARFIELD_TRY(read<openvdb::Vec3SGrid>({"sggx_diagonal"}, [&](const Place& p, const openvdb::Vec3s& v) {
      volume_.shapes.resize(volume_.bricks.size());
      for (int i = 0; i < 3; ++i) volume_.shapes[p.brick][p.voxel][static_cast<size_t>(i)] = v[i];
    }));
    FARFIELD_TRY(read<openvdb::Vec3SGrid>({"sggx_off_diagonal"}, [&](const Place& p, const openvdb::Vec3s& v) {
      for (int i = 0; i < 3; ++i) volume_.shapes[p.brick][p.voxel][static_cast<size_t>(3 + i)] = v[i];
    }));
    if (has("density_isotropic", "float")) used_.insert("density_isotropic" + suffix_);
    uint64_t mended = 0, round = 0;
    const Matrix to_grid = glm::transpose(volume_.rotation);
    return set_shapes(
        [&](const Place& p) {
          const std::array<float, 6>& s = volume_.shapes[p.brick][p.voxel];
          Matrix m(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
          if (!(m[0][0] + m[1][1] + m[2][2] > 0)) return ++round, Matrix(1.0);
          mended += mend_ellipsoid(m);
          return to_grid * m * volume_.rotation;
        },
        [&] {
          if (mended > 0) warn("{} voxels have matrices that are no SGGX: the nearest are taken", mended);
          if (round > 0) warn("{} voxels have no SGGX: they stop alike from all sides", round);
        });
  }

  Result<void> read_fibres() {
    BigVector<ColorBrick> directions;
    FARFIELD_TRY_LET(const bool is_there,
                     read<openvdb::Vec3SGrid>({"fibre", "fiber", "direction"}, [&](const Place& p, const auto& v) {
                       directions.resize(volume_.bricks.size());
                       directions[p.brick][p.voxel] = to_vec3(v);
                     }));
    if (!is_there) return {};
    volume_.shapes.resize(volume_.bricks.size());
    const Matrix to_grid = glm::transpose(volume_.rotation);
    uint64_t round = 0;
    return set_shapes(
        [&](const Place& p) {
          const dvec3 d = to_grid * dvec3(directions[p.brick][p.voxel]);
          if (!(glm::length(d) > 0)) return ++round, Matrix(1.0);
          return fibre_ellipsoid(d, from_.options.fibre_roughness);
        },
        [&] {
          if (round > 0) warn("{} voxels have no direction: they stop alike from all sides", round);
        });
  }

  /// shape(place): of any trace above 0, in the grid's axes. Then says what is to be said.
  template <typename Shape, typename Say>
  Result<void> set_shapes(const Shape& shape, const Say& say) {
    volume_.densest = 0;
    for_each_place([&](const Place& p) {
      float& density = volume_.bricks[p.brick][p.voxel];
      put_ellipsoid(shape(p), volume_.shapes[p.brick][p.voxel], density);
      volume_.densest = std::max(volume_.densest, density);
    });
    say();
    return {};
  }

  const VdbChannels& from_;
  SourceVolume& volume_;
  std::set<std::string>& used_;
  const std::string suffix_;
  bool is_unshared_ = false;
};

}  // namespace

std::string coordinate_text(const Coord& c) { return fmt::format("({}, {}, {})", c.x(), c.y(), c.z()); }

Result<void> read_channels(const VdbChannels& from, SourceVolume& volume, std::set<std::string>& used) {
  return ChannelReader(from, volume, used).run();
}

}  // namespace farfield
