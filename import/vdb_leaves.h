// SPDX-License-Identifier: Apache-2.0
// The leaves of an OpenVDB grid in the order in which bricks lie in levels, so that those of a file that is larger than
// memory can come and go. Part of the module.
#pragma once

#include <openvdb/openvdb.h>

#include <algorithm>
#include <tuple>
#include <vector>

namespace farfield {

/// A file as large as this is read leaf by leaf, as its voxels are asked for; a smaller one at once.
inline constexpr uint64_t kPagedFileBytes = uint64_t{32} << 20;

/// By z, then y, then x.
template <typename Grid>
std::vector<typename Grid::TreeType::LeafNodeType*> sorted_leaves(Grid& grid) {
  std::vector<typename Grid::TreeType::LeafNodeType*> leaves;
  grid.tree().getNodes(leaves);
  std::ranges::sort(leaves, {}, [](const auto* leaf) {
    const openvdb::Coord& at = leaf->origin();
    return std::tuple(at.z(), at.y(), at.x());
  });
  return leaves;
}

/// Frees the values of a leaf, which are 0 from then on; which of them are active stays.
template <typename Leaf>
void drop_values(Leaf& leaf) {
  typename Leaf::Buffer none(openvdb::PartialCreate(), openvdb::zeroVal<typename Leaf::ValueType>());
  leaf.swap(none);
}

}  // namespace farfield
