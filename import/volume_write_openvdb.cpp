// SPDX-License-Identifier: Apache-2.0
// OpenVDB files through OpenVDB's own archive, grid by grid: its File wants all grids in memory at once, writes to the
// final name, and marks each file with random bytes.
#include "import/volume_write_openvdb.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>

#include <ostream>
#include <streambuf>

#include "base/hash.h"
#include "base/temporary_file.h"

namespace farfield {
namespace {

constexpr int kBlockVoxels = 512;

/// A stream into a temporary file, which keeps the first error.
class FileStream : public std::streambuf {
 public:
  explicit FileStream(TemporaryFile& file) : file_(file) {}

 protected:
  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    return file_.write(std::as_bytes(std::span(bytes, static_cast<size_t>(count)))) ? count : 0;
  }
  int_type overflow(int_type c) override {
    const char byte = traits_type::to_char_type(c);
    return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode) override {
    return file_.seek(static_cast<uint64_t>(static_cast<off_type>(position))) ? position : pos_type(off_type(-1));
  }
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode which) override {
    if (from == std::ios_base::beg) return seekpos(pos_type(offset), which);
    if (from != std::ios_base::cur || !file_.is_good()) return pos_type(off_type(-1));
    const auto here = static_cast<off_type>(file_.position());
    return offset == 0 ? pos_type(here) : seekpos(pos_type(here + offset), which);
  }

 private:
  TemporaryFile& file_;
};

void add_metadata(openvdb::MetaMap& to, const GridMetadata& from) {
  for (const auto& [name, value] : from) {
    if (const auto* text = std::get_if<std::string>(&value)) to.insertMeta(name, openvdb::StringMetadata(*text));
    if (const auto* number = std::get_if<int64_t>(&value)) to.insertMeta(name, openvdb::Int64Metadata(*number));
    if (const auto* number = std::get_if<double>(&value)) to.insertMeta(name, openvdb::DoubleMetadata(*number));
    if (const auto* v = std::get_if<dvec3>(&value))
      to.insertMeta(name, openvdb::Vec3DMetadata(openvdb::Vec3d(v->x, v->y, v->z)));
  }
}

openvdb::math::Transform::Ptr to_transform(const glm::dmat4& index_to_source) {
  openvdb::math::Mat4d matrix;  // OpenVDB's vectors stand on the left
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix(column, row) = index_to_source[column][row];
  return openvdb::math::Transform::createLinearTransform(matrix);
}

/// OpenVDB counts voxels of a leaf with z fastest.
openvdb::Index leaf_offset(int voxel) {
  return static_cast<openvdb::Index>((voxel & 7) << 6 | (voxel >> 3 & 7) << 3 | voxel >> 6);
}

template <typename Grid, int kValues, typename MakeValue>
openvdb::GridBase::Ptr make_grid(const VolumeGrid& given, const MakeValue& make_value) {
  const auto grid = Grid::create();
  std::vector<float> values(kValues * kBlockVoxels);
  const VolumeBlocks& lattice = *given.lattice;
  for (size_t block = 0; block < lattice.blocks.size(); ++block) {
    given.fill(block, values);
    const ivec3 corner = 8 * lattice.blocks[block];
    auto* leaf = grid->tree().touchLeaf({corner.x, corner.y, corner.z});
    for (int voxel = 0; voxel < kBlockVoxels; ++voxel) {
      if ((lattice.is_there[block][static_cast<size_t>(voxel) >> 6] >> (voxel & 63) & 1) == 0) continue;
      leaf->setValueOn(leaf_offset(voxel), make_value(&values[static_cast<size_t>(kValues * voxel)]));
    }
  }
  return grid;
}

openvdb::GridBase::Ptr make_values(const VolumeGrid& given) {
  if (given.kind == VolumeGrid::Kind::Vector)
    return make_grid<openvdb::Vec3SGrid, 3>(given, [](const float* v) { return openvdb::Vec3s(v); });
  if (given.kind == VolumeGrid::Kind::Integer)
    return make_grid<openvdb::Int32Grid, 1>(given, [](const float* v) { return static_cast<int32_t>(*v); });
  return make_grid<openvdb::FloatGrid, 1>(given, [](const float* v) { return *v; });
}

openvdb::GridBase::Ptr make_grid(const VolumeGrid& given) {
  const openvdb::GridBase::Ptr grid = make_values(given);
  grid->setName(given.name);
  grid->setTransform(to_transform(given.lattice->index_to_source));
  if (given.kind == VolumeGrid::Kind::Density) grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  if (given.kind == VolumeGrid::Kind::Vector) grid->setVectorType(openvdb::VEC_INVARIANT);
  add_metadata(*grid, given.metadata);
  grid->addStatsMetadata();  // bounds, for who reads the header alone
  return grid;
}

class Archive : public openvdb::io::Archive {
 public:
  Result<void> write_to(TemporaryFile& file, const VolumeFile& content, const Job& job) const {
    FileStream buffer(file);
    std::ostream stream(&buffer);
    writeHeader(stream, /*seekable=*/true);
    openvdb::MetaMap metadata;
    add_metadata(metadata, content.metadata);
    metadata.writeMeta(stream);
    const auto count = static_cast<int32_t>(content.grids.size());
    stream.write(reinterpret_cast<const char*>(&count), sizeof(count));
    for (size_t i = 0; i < content.grids.size() && file.is_good(); ++i) {
      const VolumeGrid& given = content.grids[i];
      job.report(static_cast<double>(i) / static_cast<double>(content.grids.size()), given.name);
      if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "write volume: cancelled");
      const openvdb::GridBase::Ptr grid = make_grid(given);
      openvdb::io::GridDescriptor descriptor(given.name, grid->type(), grid->saveFloatAsHalf());
      writeGrid(descriptor, grid, stream, /*seekable=*/true);
    }
    mark(file, content.content_hash);
    return {};
  }

 private:
  /// In place of the random bytes that the header got: the same content, the same file.
  static void mark(TemporaryFile& file, uint64_t hash) {
    constexpr uint64_t kPlace = 8 + 4 + 2 * 4 + 1;  // behind magic, version, library version, "has offsets"
    const std::string digits = to_hex(hash) + to_hex(mix64(hash));
    const std::string text = fmt::format("{}-{}-{}-{}-{}", digits.substr(0, 8), digits.substr(8, 4),
                                         digits.substr(12, 4), digits.substr(16, 4), digits.substr(20));
    if (file.seek(kPlace)) file.write(std::as_bytes(std::span(text)));
  }
};

}  // namespace

Result<void> write_openvdb(const std::string& path, const VolumeFile& file, const Job& job) {
  TemporaryFile target(path);
  try {
    openvdb::initialize();
    FARFIELD_TRY(Archive().write_to(target, file, job));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::OutOfBudget,
                      fmt::format("{}: there is no memory for its grids; write a coarser level", path));
  } catch (const std::exception& exception) {
    // A full disk is better said by the file itself.
    if (target.is_good())
      return make_error(ErrorCode::Io, fmt::format("cannot write {}: OpenVDB: {}", path, exception.what()));
  }
  return target.commit();
}

}  // namespace farfield
