// SPDX-License-Identifier: Apache-2.0
#include "export/level_grids.h"

#include <cmath>

#include "cache/level_values.h"
#include "scattering/carlson.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

/// OpenVDB's voxel (i, j, k) has its *centre* where the transform puts (i, j, k), ours its lower corner: half a voxel
/// is added once, here.
glm::dmat4 index_to_source(const LevelOfAsset& from) {
  const double size = from.entry.resolution;
  const vec3& corner = from.level.header.volume_origin;
  const dvec3 first = from.manifest.origin + from.manifest.rotation * (dvec3(corner) + 0.5 * size);
  glm::dmat4 matrix(size * from.manifest.rotation);
  matrix[3] = glm::dvec4(first, 1.0);
  return matrix;
}

std::shared_ptr<const VolumeBlocks> lattice_of(const LevelOfAsset& from) {
  auto lattice = std::make_shared<VolumeBlocks>();
  lattice->index_to_source = index_to_source(from);
  for_each_brick(from.level, [&](const Brick& brick, const ivec3& coordinates) {
    lattice->blocks.push_back(coordinates);
    lattice->is_there.push_back(brick.mask);
  });
  return lattice;
}

/// A voxel: where its density is, and where the rest of it.
struct Voxel {
  const Brick& brick;
  int number;        ///< in the brick
  uint32_t payload;  ///< in the level's voxel arrays
};

float density_of(const LevelView& level, const Voxel& voxel) {
  const float most = voxel.brick.density_scale * static_cast<float>(voxel.brick.density[voxel.number]) / 255.0f;
  return level.voxel_octants.empty() ? most : most * mean_share(level.voxel_octants[voxel.payload]);
}

/// The mean of sqrt(w^T S w) over directions.
float mean_sigma(const SymMat3& s) {
  const dvec3 e = eigenvalues(s);
  return static_cast<float>(carlson_rg(e.x, e.y, e.z));
}

class GridMaker {
 public:
  GridMaker(const LevelOfAsset& from, const std::string& suffix)
      : from_(from), level_(from.level), suffix_(suffix), lattice_(lattice_of(from)) {}

  std::vector<VolumeGrid> make() {
    add_density();
    level_.header.medium == Medium::Fog ? add_fog() : add_flakes();
    if (!level_.voxel_sggx.empty()) add_shapes();
    return std::move(grids_);
  }

 private:
  /// value(voxel, its floats).
  template <typename Value>
  void add(const std::string& name, VolumeGrid::Kind kind, const char* units, const Value& value) {
    const auto fill = [level = level_, value, width = kind == VolumeGrid::Kind::Vector ? 3 : 1](
                          size_t block, std::span<float> values) {
      const Brick& brick = level.bricks[block];
      for (int i = 0; i < kBrickVoxels; ++i) {
        if (brick.density[static_cast<size_t>(i)] == 0) continue;
        value(level, Voxel{brick, i, brick.payload_index(i)}, &values[static_cast<size_t>(width * i)]);
      }
    };
    grids_.push_back({name + suffix_, kind, lattice_, metadata(units), fill});
  }
  template <typename Value>
  void add_number(const std::string& name, const char* units, const Value& value) {
    add(name, VolumeGrid::Kind::Scalar, units,
        [value](const LevelView& level, const Voxel& voxel, float* out) { *out = value(level, voxel); });
  }
  template <typename Value>
  void add_vector(const std::string& name, const char* units, const Value& value) {
    add(name, VolumeGrid::Kind::Vector, units, [value](const LevelView& level, const Voxel& voxel, float* out) {
      const vec3 v = value(level, voxel);
      out[0] = v.x, out[1] = v.y, out[2] = v.z;
    });
  }

  GridMetadata metadata(const char* units) const {
    const int64_t level{level_.header.level};
    GridMetadata out = {{"units", units},
                    {"farfield_version", kExportGenerator},
                    {"farfield_source", from_.manifest.source},
                    {"farfield_level", level},
                    {"farfield_resolution", from_.entry.resolution}};
    if (!suffix_.empty()) out.emplace_back("MultiResGrid_Level", level);  // as OpenVDB's tools mark grids of several
    return out;
  }

  void add_density() {
    const LevelHeader& header = level_.header;
    const bool is_fog = header.medium == Medium::Fog;
    add("density", VolumeGrid::Kind::Density, "1 / length unit of the source",
        [](const LevelView& level, const Voxel& voxel, float* out) { *out = density_of(level, voxel); });
    GridMetadata& more = grids_.back().metadata;
    more.emplace_back("farfield_medium", is_fog ? "fog" : "flakes");
    if (is_fog) {
      more.emplace_back("farfield_anisotropy", double{header.fog_anisotropy});
    } else {
      more.emplace_back("farfield_hot_spot", double{header.hot_spot});
      more.emplace_back("farfield_highlight_lean", double{header.highlight_lean});
      more.emplace_back("farfield_open_side", from_.manifest.rotation * dvec3(header.open_side));
    }
  }

  void add_fog() {
    add_vector("albedo", "of single scattering, linear RGB",
               [](const LevelView& level, const Voxel& voxel) { return fog_params(level, voxel.payload).albedo; });
    if (!level_.voxel_anisotropy.empty()) {
      add_number("anisotropy", "mean cosine of scattering", [](const LevelView& level, const Voxel& voxel) {
        return fog_params(level, voxel.payload).anisotropy;
      });
    } else if (!level_.voxel_self_shadowing.empty()) {
      add_self_shadowing();
    }
  }

  void add_self_shadowing() {
    add_number("self_shadowing", "share that leaves a voxel after one scattering",
               [](const LevelView& level, const Voxel& voxel) {
                 return unorm_at(level.voxel_self_shadowing, voxel.payload);
               });
  }

  void add_flakes() {
    add_vector("albedo", "of a flake, highlight included, linear RGB", [](const LevelView& level, const Voxel& voxel) {
      const FlakeParams p = flake_params(level, voxel.payload);
      return layered_albedo(p.specular, glm::min(p.diffuse + p.transmission, vec3(1.0f)));
    });
    const bool is_matte = level_.voxel_specular.empty() && level_.voxel_transmission.empty();
    if (!level_.voxel_diffuse.empty() && !is_matte) add_color("diffuse", "albedo, linear RGB", &LevelView::voxel_diffuse);
    if (!level_.voxel_specular.empty()) {
      add_color("specular", "reflectance at normal incidence (F0), linear RGB", &LevelView::voxel_specular);
      add_number("roughness", "GGX alpha is its square", [](const LevelView& level, const Voxel& voxel) {
        return std::sqrt(std::sqrt(unorm_at(level.voxel_roughness2, voxel.payload)));
      });
    }
    if (!level_.voxel_transmission.empty())
      add_color("transmission", "diffuse, linear RGB", &LevelView::voxel_transmission);
    if (!level_.voxel_self_shadowing.empty()) add_self_shadowing();
    if (!level_.voxel_emission.empty()) {
      add_vector("emission", "radiance of flakes, linear RGB", [](const LevelView& level, const Voxel& voxel) {
        return emission_at(level.voxel_emission, voxel.payload);
      });
    }
    if (!level_.voxel_octants.empty()) {
      add("octants", VolumeGrid::Kind::Integer, "two bits for each octant: docs/file_format.md, section 29",
          [](const LevelView& level, const Voxel& voxel, float* out) {
            *out = static_cast<float>(level.voxel_octants[voxel.payload]);
          });
    }
  }

  void add_color(const char* name, const char* units, ArrayView<PackedColor> LevelView::*colors) {
    add_vector(name, units, [colors](const LevelView& level, const Voxel& voxel) {
      return color_at(level.*colors, voxel.payload);
    });
  }

  /// sigma_t(w) = density sqrt(w^T S w), S turned into the source's space.
  void add_shapes() {
    const mat3 rotation(from_.manifest.rotation);
    const auto shape = [rotation](const LevelView& level, const Voxel& voxel) {
      return congruence(rotation, unpack(level.voxel_sggx[voxel.payload]));
    };
    add_vector("sggx_diagonal", "S_xx, S_yy, S_zz", [shape](const LevelView& level, const Voxel& voxel) {
      const SymMat3 s = shape(level, voxel);
      return vec3(s.xx, s.yy, s.zz);
    });
    add_vector("sggx_off_diagonal", "S_xy, S_xz, S_yz", [shape](const LevelView& level, const Voxel& voxel) {
      const SymMat3 s = shape(level, voxel);
      return vec3(s.xy, s.xz, s.yz);
    });
    add_number("density_isotropic", "1 / length unit of the source; density times the mean of sqrt(w^T S w)",
               [](const LevelView& level, const Voxel& voxel) {
                 return density_of(level, voxel) * mean_sigma(unpack(level.voxel_sggx[voxel.payload]));
               });
  }

  const LevelOfAsset from_;
  const LevelView& level_;
  const std::string suffix_;
  const std::shared_ptr<const VolumeBlocks> lattice_;
  std::vector<VolumeGrid> grids_;
};

}  // namespace

std::vector<VolumeGrid> level_grids(const LevelOfAsset& from, const std::string& suffix) {
  return GridMaker(from, suffix).make();
}

}  // namespace farfield
