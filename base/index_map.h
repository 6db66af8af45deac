// SPDX-License-Identifier: Apache-2.0
// A small hash set that numbers its keys in order of insertion and is cheap to clear: for local explorations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace farfield {

/// Maps keys (any but 0xffffffff) to 0, 1, 2, ... in order of insertion. One thread at a time.
class IndexMap {
 public:
  void clear() {
    // Last in, first out: each removal restores the table before the insertion, so no probe chain breaks.
    for (; !keys_.empty(); keys_.pop_back()) slots_[find_slot(keys_.back())] = Slot{};
  }

  /// The key's index, and whether it is new.
  std::pair<uint32_t, bool> insert(uint32_t key) {
    if (2 * (keys_.size() + 1) > slots_.size()) grow();
    Slot& slot = slots_[find_slot(key)];
    if (slot.key == key) return {slot.index, false};
    slot = {key, static_cast<uint32_t>(keys_.size())};
    keys_.push_back(key);
    return {slot.index, true};
  }

  uint32_t key(uint32_t index) const { return keys_[index]; }
  size_t size() const { return keys_.size(); }

 private:
  static constexpr uint32_t kEmpty = 0xffffffffu;
  struct Slot {
    uint32_t key = kEmpty, index = 0;
  };

  /// Where the key is, or where it would be.
  size_t find_slot(uint32_t key) const {
    // Multiplicative hashing: the upper bits of key * 2^32 / golden ratio.
    size_t slot = (key * 0x9e3779b1u) >> shift_;
    while (slots_[slot].key != kEmpty && slots_[slot].key != key) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }

  void grow() {
    shift_ = slots_.empty() ? 25 : shift_ - 1;
    slots_.assign(size_t{1} << (32 - shift_), Slot{});
    for (uint32_t index = 0; index < keys_.size(); ++index) slots_[find_slot(keys_[index])] = {keys_[index], index};
  }

  std::vector<Slot> slots_;  ///< 2^(32 - shift_), at most half full
  std::vector<uint32_t> keys_;
  int shift_ = 32;
};

}  // namespace farfield
