// SPDX-License-Identifier: Apache-2.0
#include "tests/support/vdb_files.h"

#define NANOVDB_USE_ZIP  // of its writer
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <cmath>

namespace farfield::test {
namespace {

openvdb::Coord coordinate(const ivec3& v) { return {v.x, v.y, v.z}; }

template <typename Grid, typename Value>
openvdb::GridBase::Ptr make_grid(const VdbGrid& given, const Value& value) {
  using ValueType = typename Grid::ValueType;
  const auto grid = Grid::create(ValueType(static_cast<float>(given.background)));
  for (const VdbTile& tile : given.tiles) {
    grid->fill(openvdb::CoordBBox(coordinate(tile.lower), coordinate(tile.upper)),
               ValueType(static_cast<float>(tile.value)), true);
  }
  auto accessor = grid->getAccessor();
  for (const VdbVoxel& voxel : given.voxels) accessor.setValueOn(coordinate(voxel.at), value(voxel));
  return grid;
}

openvdb::GridBase::Ptr make_grid(const VdbGrid& given) {
  switch (given.kind) {
    case VdbGrid::Kind::Double:
      return make_grid<openvdb::DoubleGrid>(given, [](const VdbVoxel& v) { return v.value; });
    case VdbGrid::Kind::Color:
      return make_grid<openvdb::Vec3SGrid>(
          given, [](const VdbVoxel& v) { return openvdb::Vec3s(v.color.x, v.color.y, v.color.z); });
    default:
      return make_grid<openvdb::FloatGrid>(given, [](const VdbVoxel& v) { return static_cast<float>(v.value); });
  }
}

openvdb::GridBase::Ptr placed_grid(const VdbGrid& given) {
  const auto grid = make_grid(given);
  grid->setName(given.name);
  openvdb::math::Mat4d matrix;  // OpenVDB's vectors stand on the left
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix(column, row) = given.index_to_source[column][row];
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  grid->setGridClass(given.kind == VdbGrid::Kind::LevelSet ? openvdb::GRID_LEVEL_SET : openvdb::GRID_FOG_VOLUME);
  grid->setSaveFloatAsHalf(given.kind == VdbGrid::Kind::Half);
  return grid;
}

template <typename Grid, typename Put>
void take_voxels(const openvdb::GridBase::Ptr& base, const Put& put, std::vector<VdbVoxel>& voxels) {
  const auto grid = openvdb::gridPtrCast<Grid>(base);
  if (!grid) return;
  for (auto value = grid->cbeginValueOn(); value; ++value) {
    const openvdb::Coord at = value.getCoord();
    put(*value, voxels.emplace_back(VdbVoxel{{at.x(), at.y(), at.z()}, 0, vec3(0.0f)}));
  }
}

}  // namespace

std::vector<VdbVoxel> filled_cube(const ivec3& lower, int side, const std::function<double(const ivec3&)>& value) {
  std::vector<VdbVoxel> voxels;
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const double v = value({x, y, z});
        if (v != 0) voxels.push_back({lower + ivec3(x, y, z), v, vec3(0.0f)});
      }
  return voxels;
}

void write_vdb(const std::filesystem::path& path, const std::vector<VdbGrid>& grids) {
  openvdb::initialize();
  openvdb::GridPtrVec written;
  for (const VdbGrid& given : grids) written.push_back(placed_grid(given));
  openvdb::io::File(path.string()).write(written);
}

void write_nvdb(const std::filesystem::path& path, const VdbGrid& given, bool fp8, bool zip) {
  openvdb::initialize();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(placed_grid(given));
  const auto handle = fp8 ? nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, nanovdb::Fp8>(*grid)
                          : nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, float>(*grid);
  nanovdb::io::writeGrid(path.string(), handle, zip ? nanovdb::io::Codec::ZIP : nanovdb::io::Codec::NONE);
}

void write_frustum_vdb(const std::filesystem::path& path) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setName("density");
  grid->getAccessor().setValueOn({3, 3, 3}, 1.0f);
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0.0), openvdb::Vec3d(10.0)), 0.5, 4.0));
  openvdb::io::File(path.string()).write({grid});
}

std::vector<VdbContent> read_vdb(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  std::vector<VdbContent> contents;
  for (auto name = file.beginName(); name != file.endName(); ++name) {
    const openvdb::GridBase::Ptr grid = file.readGrid(name.gridName());
    VdbContent& content = contents.emplace_back();
    content.name = grid->getName();
    content.type = grid->valueType();
    content.is_fog = grid->getGridClass() == openvdb::GRID_FOG_VOLUME;
    const openvdb::math::Mat4d matrix = grid->transform().baseMap()->getAffineMap()->getMat4();
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) content.index_to_source[column][row] = matrix(column, row);
    const auto put_number = [](auto value, VdbVoxel& voxel) { voxel.value = static_cast<double>(value); };
    take_voxels<openvdb::FloatGrid>(grid, put_number, content.voxels);
    take_voxels<openvdb::Int32Grid>(grid, put_number, content.voxels);
    take_voxels<openvdb::Vec3SGrid>(
        grid,
        [](const openvdb::Vec3s& v, VdbVoxel& voxel) {
          voxel.color = {v.x(), v.y(), v.z()};
        },
        content.voxels);
    for (auto item = grid->beginMeta(); item != grid->endMeta(); ++item)
      content.metadata[item->first] = item->second->str();
  }
  return contents;
}

std::vector<double> march_vdb(const std::filesystem::path& path, std::span<const VdbRay> rays, double scale,
                              int steps) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::PointSampler> sampler(*grid);
  std::vector<double> transmittances;
  for (const VdbRay& ray : rays) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      const dvec3 p = ray.origin + ray.length * (i + 0.5) / steps * ray.direction;
      sum += static_cast<double>(sampler.wsSample(openvdb::Vec3d(p.x, p.y, p.z)));
    }
    transmittances.push_back(std::exp(-scale * sum * ray.length / steps));
  }
  return transmittances;
}

}  // namespace farfield::test
