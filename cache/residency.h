// SPDX-License-Identifier: Apache-2.0
// ResidentSet: loadable items under a hard budget of bytes. Knows neither Embree nor levels: an item is two planned
// sizes and a function that loads it.
//
// Who owns. The ResidentSet owns every loaded object and destroys it in release() or at its end. acquire() lends it:
//   a borrowed object stays valid until the item is released. Items are never removed.
// Who counts. accounted_bytes() = other bytes (set_other_bytes) + actual bytes of Ready items + planned bytes of the
//   item being loaded, build peak included, which are reserved before its load starts. One load runs at a time, so one
//   build peak is reserved at a time. When a load ends, what it says it really takes replaces the plan; the difference
//   is counted in Stats::unplanned_bytes. The budget is hard: a load whose reservation does not fit is not started,
//   and one that turns out to take more than is left stops there, as it is told how much that is. Both make the item
//   Refused until it is released.
// Who locks. acquire() of a Ready item is one atomic load (acquire), no lock. Otherwise one mutex guards states and
//   sums. It is never held while loading, reporting or destroying. Threads that need an item being loaded wait on a
//   condition variable; the first thread that needs an Empty item loads it itself.
// Who waits, and why there is no deadlock. A thread that loads may wait inside TBB (Embree builds do) and TBB may hand
//   it other tasks meanwhile. If such a task were a ray that needs another item, it would wait for a load that lies
//   below it on its own stack. So loads run isolated (base/parallel.h): until it is done, the loading thread and the
//   workers that help it take up only tasks of that load. A load must not call acquire().
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>

#include "base/result.h"

namespace farfield {

/// Base of whatever a load makes.
struct Resident {
  virtual ~Resident() = default;
};

/// What a load hands over, and what it really took.
struct LoadedItem {
  std::unique_ptr<Resident> object;  ///< not null
  uint64_t resident_bytes = 0;       ///< that stay until release
  uint64_t build_peak_bytes = 0;     ///< further ones at the worst moment of the load
};

/// What an item will take, as far as is known before it is loaded, and how to load it.
struct ResidencyItem {
  uint64_t resident_bytes = 0;
  uint64_t build_peak_bytes = 0;
  /// Called by the one thread that loads, with what the budget has left: more it must not take even for a moment, but
  /// fail with OutOfBudget. May use parallel_for and TBB; may be called again after a release.
  std::function<Result<LoadedItem>(uint64_t bytes_left)> load;
};

enum class ItemState : uint8_t {
  Empty,    ///< not in memory
  Loading,  ///< some thread loads it
  Ready,    ///< in memory
  Refused,  ///< its load did not fit the budget; until release()
  Broken,   ///< its load failed; it stays so
};

/// What one item has taken so far.
struct ItemStats {
  uint64_t loads = 0;       ///< that succeeded, reloads included
  double load_seconds = 0;  ///< wall time, summed over them
};

struct ResidencyStats {
  uint64_t accounted_bytes = 0;
  uint64_t peak_accounted_bytes = 0;
  uint64_t loads = 0;            ///< that succeeded, reloads included
  uint64_t releases = 0;         ///< of Ready items
  uint64_t ready_items = 0;      ///< now
  uint64_t broken_items = 0;     ///< now, Refused ones included
  uint64_t unplanned_bytes = 0;  ///< sum over loads of what they took beyond their plan, peaks included
  double load_seconds = 0;       ///< wall time, summed over loads
};

/// Thread rule: acquire, try_acquire, state and stats are safe from any thread. add, release and the setters are for
/// one thread at a time with no acquire() running and no borrowed object of a released item in use (between frames).
class ResidentSet {
 public:
  /// report: called once for each item that breaks, never concurrently, not under the lock; must not call back.
  using Report = std::function<void(size_t item, const Error& error)>;

  explicit ResidentSet(uint64_t budget_bytes, Report report = {});
  ~ResidentSet();
  ResidentSet(const ResidentSet&) = delete;
  ResidentSet& operator=(const ResidentSet&) = delete;

  /// Adds an item, Empty. Returns its number: 0, 1, 2, ...
  size_t add(ResidencyItem item);
  size_t size() const { return items_.size(); }

  /// The item's object, loaded first if need be: waits for the thread that loads it, or loads it in this thread.
  /// nullptr: the item is Refused or Broken.
  const Resident* acquire(size_t item) {
    if (const Resident* object = try_acquire(item)) return object;
    return acquire_slowly(item);
  }
  /// The item's object if it is Ready, else nullptr. Never waits.
  const Resident* try_acquire(size_t item) const { return items_[item].ready.load(std::memory_order_acquire); }

  ItemState state(size_t item) const { return items_[item].state.load(std::memory_order_acquire); }
  /// Latest known size: planned until the first load, then what the last load took. For the planner.
  uint64_t resident_bytes(size_t item) const;
  uint64_t build_peak_bytes(size_t item) const;
  ItemStats item_stats(size_t item) const;

  /// Destroys the objects of those of these items that are Ready, and makes them Empty; Refused ones too.
  void release(std::span<const size_t> items);

  uint64_t budget_bytes() const { return budget_bytes_; }
  /// Bytes that others use and that the budget pays for too (instance records, the host scene, ...).
  void set_other_bytes(uint64_t bytes);

  ResidencyStats stats() const;

 private:
  struct Item {
    std::atomic<const Resident*> ready{nullptr};     ///< object.get() while Ready, else null; read without lock
    std::atomic<ItemState> state{ItemState::Empty};  ///< written under mutex_
    ResidencyItem planned;                           ///< sizes guarded by mutex_; those of the last load after one
    std::unique_ptr<Resident> object;                ///< guarded by mutex_
    ItemStats stats;                                 ///< guarded by mutex_
  };

  const Resident* acquire_slowly(size_t item);
  void load(size_t item, std::unique_lock<std::mutex>& lock);
  Result<void> reserve(Item& item);
  Result<void> settle(Item& item, Result<LoadedItem>& loaded);
  Result<void> account(Item& item, const LoadedItem& loaded);

  const uint64_t budget_bytes_;
  const Report report_;
  std::deque<Item> items_;  ///< a deque: items do not move, and adding does not disturb them

  mutable std::mutex mutex_;
  std::condition_variable load_ended_;
  bool is_loading_ = false;      ///< guarded by mutex_, as are the following
  uint64_t reserved_bytes_ = 0;  ///< of the one load that runs
  uint64_t other_bytes_ = 0;
  ResidencyStats stats_;  ///< accounted_bytes: other and Ready bytes, without reserved_bytes_
};

}  // namespace farfield
