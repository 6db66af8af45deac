// SPDX-License-Identifier: Apache-2.0
// A small hash set that numbers its keys in order of insertion and is cheap to clear: for local explorations.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/hash.h"

namespace farfield {

/// Maps keys to 0, 1, 2, ... in order of insertion. One thread at a time.
class IndexMap {
 public:
  void clear() {
    for (const uint32_t slot : used_slots_) slots_[slot] = kEmpty;
    used_slots_.clear();
    keys_.clear();
  }

  /// The key's index, and whether it is new.
  std::pair<uint32_t, bool> insert(uint32_t key) {
    if (2 * (keys_.size() + 1) > slots_.size()) grow();
    const uint32_t slot = find_slot(key);
    if (slots_[slot] != kEmpty) return {slots_[slot], false};
    const uint32_t index = static_cast<uint32_t>(keys_.size());
    slots_[slot] = index;
    used_slots_.push_back(slot);
    keys_.push_back(key);
    return {index, true};
  }

  uint32_t key(uint32_t index) const { return keys_[index]; }
  size_t size() const { return keys_.size(); }

 private:
  static constexpr uint32_t kEmpty = 0xffffffffu;

  uint32_t find_slot(uint32_t key) const {
    const uint32_t mask = static_cast<uint32_t>(slots_.size()) - 1;
    uint32_t slot = static_cast<uint32_t>(mix64(key)) & mask;
    while (slots_[slot] != kEmpty && keys_[slots_[slot]] != key) slot = (slot + 1) & mask;
    return slot;
  }

  void grow() {
    slots_.assign(slots_.empty() ? 128 : 2 * slots_.size(), kEmpty);
    used_slots_.clear();
    for (uint32_t index = 0; index < keys_.size(); ++index) {
      const uint32_t slot = find_slot(keys_[index]);
      slots_[slot] = index;
      used_slots_.push_back(slot);
    }
  }

  std::vector<uint32_t> slots_;  ///< power of two, at most half full
  std::vector<uint32_t> used_slots_;
  std::vector<uint32_t> keys_;
};

}  // namespace farfield
