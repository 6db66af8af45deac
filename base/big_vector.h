// SPDX-License-Identifier: Apache-2.0
// Vectors that may be larger than memory. What is large lies in files without a name, which the system pages in and out
// as it does with any file: it is gone with the vector or the process, however that ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

#include "base/result.h"

namespace farfield {

/// From here on a block of memory is a file, in the system's temporary place (TMPDIR).
inline constexpr size_t kScratchFromBytes = size_t{64} << 20;

/// There was no room for such a file. Whoever makes vectors that large turns it into an Error: with_scratch().
struct ScratchFull : std::bad_alloc {
  explicit ScratchFull(Error why) : error(std::move(why)) {}
  Error error;  ///< Io: names the folder, how much was asked for, the remedy
};

/// Blocks of any size; freed with the size that they were asked for with. Any thread. Throws ScratchFull.
void* allocate_scratch(size_t bytes);
void free_scratch(void* block, size_t bytes) noexcept;

/// The pages of a block's file leave this process, until they are touched again; what they hold stays, and the system
/// writes it to the disk when it wants their memory. Nothing happens to small blocks. Any thread, also while others
/// read or write the block.
void rest_scratch(const void* block, size_t bytes) noexcept;

/// Whether the files that are mapped have more pages in memory than they should, so that it is time for rest().
bool is_much_in_memory();

template <typename T>
struct ScratchAllocator {
  static_assert(alignof(T) <= 64);
  using value_type = T;

  ScratchAllocator() = default;
  template <typename U>
  ScratchAllocator(const ScratchAllocator<U>&) {}  // NOLINT(google-explicit-constructor): as allocators are

  T* allocate(size_t count) {
    if (count > SIZE_MAX / sizeof(T)) throw std::bad_array_new_length();
    return static_cast<T*>(allocate_scratch(count * sizeof(T)));
  }
  void deallocate(T* block, size_t count) noexcept { free_scratch(block, count * sizeof(T)); }
  bool operator==(const ScratchAllocator&) const { return true; }
};

/// As std::vector. Growing copies it, as there: reserve() where the size is known.
template <typename T>
using BigVector = std::vector<T, ScratchAllocator<T>>;

template <typename T>
void rest(const BigVector<T>& vector) {
  rest_scratch(vector.data(), vector.capacity() * sizeof(T));
}

/// make(), a Result, or the error of a scratch file that there was no room for.
template <typename Make>
auto with_scratch(const Make& make) -> decltype(make()) {
  try {
    return make();
  } catch (const ScratchFull& full) {
    return tl::unexpected(full.error);
  }
}

}  // namespace farfield
