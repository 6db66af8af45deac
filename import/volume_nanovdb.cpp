// SPDX-License-Identifier: Apache-2.0
#include "import/volume_nanovdb.h"

#include <fmt/format.h>
#include <nanovdb/NanoVDB.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string_view>
#include <type_traits>

namespace farfield {
namespace {

constexpr std::string_view kMagic = "NanoVDB";  ///< and a digit
constexpr uint32_t kMajorVersion = 32;          ///< of the layout that these headers have
constexpr uint64_t kMostZipRatio = 1040;        ///< deflate packs at most 1032 bytes into one
enum Codec : uint16_t { kNone = 0, kZip = 1, kBlosc = 2 };

/// As nanovdb/util/IO.h has them, which does not compile without its optional codecs' warnings.
struct SegmentHeader {
  std::array<char, 8> magic;
  uint32_t version;
  uint16_t grid_count, codec;
};
static_assert(sizeof(SegmentHeader) == 16);
struct GridHeader {
  uint64_t grid_bytes, file_bytes, name_key, voxels;
  uint32_t type, grid_class;
  std::array<uint8_t, 96> boxes_and_size;
  uint32_t name_bytes;
  std::array<uint32_t, 7> counts;
  uint16_t codec, padding;
  uint32_t version;
};
static_assert(sizeof(GridHeader) == 176);

/// Memory as aligned as NanoVDB's nodes want it.
struct alignas(NANOVDB_DATA_ALIGNMENT) Chunk {
  std::array<std::byte, NANOVDB_DATA_ALIGNMENT> bytes;
};

tl::unexpected<Error> broken(const std::string& what) { return make_error(ErrorCode::BadFile, "damaged: " + what); }

// ---- a grid in memory

/// Walks a grid's tree, checking on its way, and puts its values into a grid of OpenVDB.
template <typename Build, typename To>
class TreeReader {
  using Root = typename nanovdb::NanoRoot<Build>::DataType;
  using Upper = nanovdb::NanoUpper<Build>;
  using Lower = nanovdb::NanoLower<Build>;
  using Leaf = nanovdb::NanoLeaf<Build>;
  using Value = typename nanovdb::NanoLeaf<Build>::ValueType;

 public:
  explicit TreeReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  Result<typename To::Ptr> run() {
    constexpr uint64_t kTree = sizeof(nanovdb::GridData);
    if (bytes_.size() < kTree + sizeof(nanovdb::TreeData<3>)) return broken("a grid of too few bytes");
    const auto& tree = *at<nanovdb::TreeData<3>>(kTree);
    FARFIELD_TRY(find_nodes<Leaf>(tree, leaves_));
    FARFIELD_TRY(find_nodes<Lower>(tree, lowers_));
    FARFIELD_TRY(find_nodes<Upper>(tree, uppers_));
    const uint64_t root_at = kTree + tree.mNodeOffset[3];
    const bool fits = tree.mNodeOffset[3] < bytes_.size() && root_at % NANOVDB_DATA_ALIGNMENT == 0 &&
                      root_at + sizeof(Root) <= bytes_.size();
    if (!fits) return broken(fmt::format("its root is at {}", tree.mNodeOffset[3]));
    const auto& root = *at<Root>(root_at);
    using Tile = typename Root::Tile;
    if (root.mTableSize > (bytes_.size() - root_at - sizeof(Root)) / sizeof(Tile))
      return broken(fmt::format("its root has {} tiles", root.mTableSize));
    grid_ = To::create(to_open(root.mBackground));
    for (uint32_t i = 0; i < root.mTableSize; ++i) {
      const Tile& tile = *root.tile(i);
      const openvdb::Coord corner = to_open(tile.origin());
      if (!tile.isChild()) {
        add_tile(3, corner, tile.value, tile.state != 0);
        continue;
      }
      FARFIELD_TRY(add_node<Upper>(child_at(root_at, tile.child), corner, uppers_));
    }
    return grid_;
  }

 private:
  template <typename T>
  const T* at(uint64_t offset) const {
    return reinterpret_cast<const T*>(bytes_.data() + offset);
  }
  static uint64_t child_at(uint64_t parent, int64_t offset) { return parent + static_cast<uint64_t>(offset); }  // wraps

  static openvdb::Coord to_open(const nanovdb::Coord& c) { return {c[0], c[1], c[2]}; }
  static auto to_open(const Value& value) {
    if constexpr (std::is_same_v<Value, nanovdb::Vec3f>)
      return openvdb::Vec3s(value[0], value[1], value[2]);
    else
      return static_cast<typename To::ValueType>(value);
  }

  /// Where the nodes of a kind are, side by side.
  struct Nodes {
    uint64_t first = 0, count = 0;
    std::vector<bool> has_parent;
  };
  template <typename Node>
  Result<void> find_nodes(const nanovdb::TreeData<3>& tree, Nodes& nodes) const {
    constexpr uint64_t kTree = sizeof(nanovdb::GridData);
    const uint64_t offset = tree.mNodeOffset[Node::LEVEL];
    nodes.count = tree.mNodeCount[Node::LEVEL];
    if (nodes.count == 0) return {};
    nodes.first = kTree + offset;
    const bool fits = offset < bytes_.size() && nodes.first < bytes_.size() &&
                      nodes.first % NANOVDB_DATA_ALIGNMENT == 0 &&
                      nodes.count <= (bytes_.size() - nodes.first) / sizeof(typename Node::DataType);
    if (!fits) return broken(fmt::format("{} nodes of level {} at {}", nodes.count, int{Node::LEVEL}, offset));
    nodes.has_parent.assign(nodes.count, false);
    return {};
  }

  /// The node's data, if there is a node, which has no parent yet: else a few bytes could stand for any number.
  template <typename Node>
  Result<const typename Node::DataType*> take(uint64_t offset, Nodes& nodes) const {
    constexpr uint64_t kSize = sizeof(typename Node::DataType);
    const uint64_t index = (offset - nodes.first) / kSize;
    const bool is_node = offset >= nodes.first && index < nodes.count && (offset - nodes.first) % kSize == 0;
    if (!is_node) return broken(fmt::format("a child of level {} at {}", int{Node::LEVEL}, offset));
    if (nodes.has_parent[index]) return broken(fmt::format("a second parent of the node at {}", offset));
    nodes.has_parent[index] = true;
    return at<typename Node::DataType>(offset);
  }

  template <typename Node>
  Result<void> add_node(uint64_t offset, const openvdb::Coord& corner, Nodes& nodes) {
    FARFIELD_TRY_LET(const auto* node, take<Node>(offset, nodes));
    constexpr uint32_t kTable = 1u << (3 * Node::LOG2DIM);
    for (uint32_t i = 0; i < kTable; ++i) {
      nanovdb::Coord local = Node::OffsetToLocalCoord(i);
      local <<= Node::ChildNodeType::TOTAL;
      const openvdb::Coord child = corner + to_open(local);
      if (!node->mChildMask.isOn(i)) {
        add_tile(Node::LEVEL, child, node->mTable[i].value, node->mValueMask.isOn(i));
        continue;
      }
      const uint64_t child_offset = child_at(offset, node->mTable[i].child);
      if constexpr (Node::LEVEL == 2) {
        FARFIELD_TRY(add_node<Lower>(child_offset, child, lowers_));
      } else {
        FARFIELD_TRY(add_leaf(child_offset, child));
      }
    }
    return {};
  }

  Result<void> add_leaf(uint64_t offset, const openvdb::Coord& corner) {
    FARFIELD_TRY_LET(const auto* from, take<Leaf>(offset, leaves_));
    auto* leaf = grid_->tree().touchLeaf(corner);
    for (uint32_t i = 0; i < 512; ++i) {  // both have z fastest
      if (from->mValueMask.isOn(i))
        leaf->setValueOn(i, to_open(from->getValue(i)));
      else
        leaf->setValueOff(i, to_open(from->getValue(i)));
    }
    return {};
  }

  void add_tile(uint32_t level, const openvdb::Coord& corner, const Value& value, bool is_active) {
    if (is_active || to_open(value) != grid_->background())
      grid_->tree().addTile(level, corner, to_open(value), is_active);
  }

  const std::span<const std::byte> bytes_;
  Nodes leaves_, lowers_, uppers_;
  typename To::Ptr grid_;
};

template <typename Build, typename To>
Result<openvdb::GridBase::Ptr> to_openvdb(std::span<const std::byte> bytes) {
  FARFIELD_TRY_LET(const auto grid, (TreeReader<Build, To>(bytes).run()));
  return openvdb::GridBase::Ptr(grid);
}

/// Null for types that are no densities, colours or directions.
Result<openvdb::GridBase::Ptr> read_tree(nanovdb::GridType type, std::span<const std::byte> bytes) {
  using nanovdb::GridType;
  switch (type) {
    case GridType::Float:
      return to_openvdb<float, openvdb::FloatGrid>(bytes);
    case GridType::Double:
      return to_openvdb<double, openvdb::DoubleGrid>(bytes);
    case GridType::Fp4:
      return to_openvdb<nanovdb::Fp4, openvdb::FloatGrid>(bytes);
    case GridType::Fp8:
      return to_openvdb<nanovdb::Fp8, openvdb::FloatGrid>(bytes);
    case GridType::Fp16:
      return to_openvdb<nanovdb::Fp16, openvdb::FloatGrid>(bytes);
    case GridType::Vec3f:
      return to_openvdb<nanovdb::Vec3f, openvdb::Vec3SGrid>(bytes);
    default:
      return openvdb::GridBase::Ptr();
  }
}

Result<void> add_grid(std::span<const std::byte> bytes, NanoVdbGrids& out) {
  if (bytes.size() < sizeof(nanovdb::GridData)) return broken("a grid of too few bytes");
  const auto& data = *reinterpret_cast<const nanovdb::GridData*>(bytes.data());
  if (std::memcmp(&data.mMagic, kMagic.data(), kMagic.size()) != 0) return broken("a grid does not start as one");
  const std::string name(data.mGridName, strnlen(data.mGridName, nanovdb::GridData::MaxNameSize));
  FARFIELD_TRY_LET(const auto grid, read_tree(data.mGridType, bytes));
  if (!grid) {
    const bool has_name = data.mGridType < nanovdb::GridType::End;
    out.others.push_back(fmt::format("\"{}\" ({})", name, has_name ? nanovdb::toStr(data.mGridType) : "unknown"));
    return {};
  }
  openvdb::math::Mat4d matrix = openvdb::math::Mat4d::identity();  // OpenVDB's vectors stand on the left
  for (int axis = 0; axis < 3; ++axis)
    for (int c = 0; c < 3; ++c) matrix(axis, c) = data.mMap.mMatD[3 * c + axis];
  for (int c = 0; c < 3; ++c) matrix(3, c) = data.mMap.mVecD[c];
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  grid->setGridClass(data.mGridClass == nanovdb::GridClass::LevelSet ? openvdb::GRID_LEVEL_SET
                                                                     : openvdb::GRID_FOG_VOLUME);
  out.grids.push_back(grid);
  return {};
}

// ---- the file

class NanoVdbFile {
 public:
  explicit NanoVdbFile(const std::string& path) : stream_(path, std::ios::binary) {
    std::error_code error;
    left_ = std::filesystem::file_size(path, error);
    if (error) left_ = 0;
  }

  Result<NanoVdbGrids> read() {
    NanoVdbGrids out;
    while (left_ > 0) FARFIELD_TRY(read_segment(out));
    if (out.grids.empty() && out.others.empty()) return broken("there is no grid in it");
    return out;
  }

 private:
  Result<void> read_segment(NanoVdbGrids& out) {
    SegmentHeader segment;
    FARFIELD_TRY(take(&segment, sizeof(segment)));
    if (std::memcmp(segment.magic.data(), kMagic.data(), kMagic.size()) != 0)
      return broken("a part of it does not start as one");
    if (segment.version >> 21 != kMajorVersion) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("is of version {}, not {}: convert it to .vdb with nanovdb_convert",
                                    segment.version >> 21, kMajorVersion));
    }
    std::vector<GridHeader> headers;
    for (int i = 0; i < segment.grid_count; ++i) {
      FARFIELD_TRY(take(&headers.emplace_back(), sizeof(GridHeader)));
      if (headers.back().name_bytes > left_) return broken("cut short in a grid's name");
      stream_.ignore(headers.back().name_bytes);
      left_ -= headers.back().name_bytes;
    }
    for (const GridHeader& header : headers) {
      FARFIELD_TRY_LET(const auto chunks, read_bytes(header));
      FARFIELD_TRY(add_grid(std::as_bytes(std::span(chunks)).first(header.grid_bytes), out));
    }
    return {};
  }

  Result<std::vector<Chunk>> read_bytes(const GridHeader& header) {
    const auto cut = [&] { return broken(fmt::format("a grid of {} bytes, and the file ends", header.file_bytes)); };
    if (header.file_bytes > left_) return cut();
    const auto allocated = [&] { return std::vector<Chunk>(header.grid_bytes / sizeof(Chunk) + 1); };
    if (header.codec == kNone) {
      if (header.grid_bytes > header.file_bytes) return cut();
      auto chunks = allocated();
      FARFIELD_TRY(take(chunks.data(), header.grid_bytes));
      return chunks;
    }
    if (header.codec != kZip) {
      return make_error(ErrorCode::Unsupported,
                        "is packed with Blosc: write it with ZIP or no compression, or convert it to .vdb");
    }
    uint64_t packed_bytes = 0;
    FARFIELD_TRY(take(&packed_bytes, sizeof(packed_bytes)));
    if (packed_bytes > left_) return cut();
    if (header.grid_bytes / kMostZipRatio > packed_bytes)
      return broken(fmt::format("{} bytes that are to be {}", packed_bytes, header.grid_bytes));
    std::vector<Bytef> packed(packed_bytes);
    FARFIELD_TRY(take(packed.data(), packed_bytes));
    auto chunks = allocated();
    uLongf unpacked = header.grid_bytes;
    const int status = uncompress(reinterpret_cast<Bytef*>(chunks.data()), &unpacked, packed.data(), packed_bytes);
    if (status != Z_OK || unpacked != header.grid_bytes) return broken("a grid that does not unpack");
    return chunks;
  }

  Result<void> take(void* to, uint64_t bytes) {
    if (bytes > left_ || !stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes)))
      return broken("the file ends too early");
    left_ -= bytes;
    return {};
  }

  std::ifstream stream_;
  uint64_t left_ = 0;  ///< bytes of the file that are not read yet
};

}  // namespace

bool is_nanovdb_file(const std::string& path) {
  std::array<char, 8> start{};
  std::ifstream stream(path, std::ios::binary);
  return stream.read(start.data(), start.size()) && std::memcmp(start.data(), kMagic.data(), kMagic.size()) == 0;
}

Result<NanoVdbGrids> read_nanovdb(const std::string& path) { return NanoVdbFile(path).read(); }

}  // namespace farfield
