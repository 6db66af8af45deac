// SPDX-License-Identifier: Apache-2.0
// How often paths ended on which level of which asset.
#pragma once

#include <cstdint>
#include <vector>

namespace farfield {

/// Sums over all paths; the order in which they are added does not matter.
class LevelHits {
 public:
  void add(uint32_t asset, uint32_t slot, uint64_t count = 1) {
    if (asset >= per_asset_.size()) per_asset_.resize(asset + 1);
    std::vector<uint64_t>& slots = per_asset_[asset];
    if (slot >= slots.size()) slots.resize(slot + 1);
    slots[slot] += count;
  }
  void add(const LevelHits& other) {
    for (uint32_t asset = 0; asset < other.per_asset_.size(); ++asset) {
      for (uint32_t slot = 0; slot < other.per_asset_[asset].size(); ++slot)
        if (other.per_asset_[asset][slot] > 0) add(asset, slot, other.per_asset_[asset][slot]);
    }
  }
  uint64_t of(uint32_t asset, uint32_t slot) const {
    return asset < per_asset_.size() && slot < per_asset_[asset].size() ? per_asset_[asset][slot] : 0;
  }

 private:
  std::vector<std::vector<uint64_t>> per_asset_;
};

}  // namespace farfield
