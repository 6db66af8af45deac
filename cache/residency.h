// SPDX-License-Identifier: Apache-2.0
// ResidentSet: loadable items under a hard budget of bytes. Knows neither Embree nor levels: an item is two planned
// sizes and a function that loads it.
//
// Who owns. The ResidentSet owns every loaded object and destroys it in release() or at its end. acquire() lends it:
//   a borrowed object stays valid until the item is released. Items are never removed.
// Who counts. accounted_bytes() = other bytes (set_other_bytes) + actual bytes of Ready items and of objects loaded
//   ahead + planned bytes of the items being loaded, build peaks included, which are reserved before a load starts.
//   Several loads run at a time where the reservations of all of them fit. When a load ends, what it says it really
//   takes replaces the plan; the difference is counted in Stats::unplanned_bytes. The budget is hard: a load whose
//   reservation does not fit waits for the others to end, and if it then does not fit is not started; one that turns
//   out to take more than it has reserved stops there, as it is told how much that is, and is done again alone, with
//   all that is left. Not even then: the item is Refused until it is released.
// Who locks. acquire() of a Ready item is one atomic load (acquire), no lock. Otherwise one mutex guards states and
//   sums. It is never held while loading, reporting or destroying. Threads that need an item being loaded wait on a
//   condition variable; the first thread that needs an Empty item loads it itself.
// Who waits, and why there is no deadlock. A thread that loads may wait inside TBB (Embree builds do) and TBB may hand
//   it other tasks meanwhile. If such a task were a ray that needs another item, it would wait for a load that lies
//   below it on its own stack. So loads run isolated (base/parallel.h): until it is done, the loading thread and the
//   workers that help it take up only tasks of that load. A load must not call acquire().
// What is loaded ahead (load_ahead) is a guess, and changes nothing but times: the item stays Empty for everyone until
//   it is acquired, which takes what was loaded ahead if it is there. Whatever fails ahead, or takes another size than
//   was known, is dropped unsaid: the acquire that needs it loads it again and says so. It gets no more than the room
//   set aside for it (set_ahead_room), and what it holds is dropped if a load that is needed does not fit beside it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "base/result.h"
#include "cache/load_terms.h"

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
  /// Called by the one thread that loads the item; other items may be loaded meanwhile. May use parallel_for and TBB;
  /// may be called again after a failure and after a release.
  std::function<Result<LoadedItem>(const LoadTerms& terms)> load;
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
  double wait_seconds = 0;       ///< wall time of acquire(), summed over threads: loading, or waiting for who loads
};

/// Thread rule: acquire, try_acquire, load_ahead, state and stats are safe from any thread. The rest is for one thread
/// at a time with no acquire() running and no borrowed object of a released item in use (between frames); add also
/// with no load_ahead() running.
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

  /// Loads an Empty item for an acquire() to come, if there is room for it; else, and if it was tried in vain since the
  /// last acquire(), does nothing.
  void load_ahead(size_t item);
  /// What loads ahead may hold and reserve at a time. Goes for those to come.
  void set_ahead_room(uint64_t bytes);
  /// Drops what was loaded ahead, and stops what is being loaded so, but for these items (sorted).
  void drop_ahead(std::span<const size_t> kept = {});

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
    std::unique_ptr<Resident> object;                ///< guarded by mutex_, as are the following
    ItemStats stats;
    bool needs_more = false;          ///< than planned, it has turned out: to be loaded alone
    std::unique_ptr<Resident> ahead;  ///< loaded ahead; of the planned size
    double ahead_seconds = 0;         ///< how long that took
    bool is_loading_ahead = false;
    bool has_failed_ahead = false;
    std::atomic<bool> cancel_ahead{false};
  };
  using Dropped = std::vector<std::unique_ptr<Resident>>;

  const Resident* acquire_slowly(size_t item);
  bool may_load(const Item& item) const;
  void load(size_t item, std::unique_lock<std::mutex>& lock);
  Result<uint64_t> reserve(Item& item);
  void make_ready(Item& item, std::unique_ptr<Resident> object, double seconds);
  Result<void> settle(Item& item, Result<LoadedItem>& loaded, double seconds);
  Result<void> account(Item& item, const LoadedItem& loaded);
  void drop_ahead(std::span<const size_t> kept, std::unique_lock<std::mutex>& lock);

  const uint64_t budget_bytes_;
  const Report report_;
  std::deque<Item> items_;  ///< a deque: items do not move, and adding does not disturb them

  mutable std::mutex mutex_;
  std::condition_variable load_ended_;
  std::mutex report_mutex_;
  size_t loads_running_ = 0;     ///< guarded by mutex_, as are the following; those ahead not counted
  bool is_alone_ = false;        ///< the one load that runs may take all there is
  uint64_t reserved_bytes_ = 0;  ///< of the loads that run, those ahead too
  uint64_t other_bytes_ = 0;
  uint64_t ahead_room_bytes_ = 0;
  uint64_t ahead_bytes_ = 0;  ///< what loads ahead hold and have reserved
  ResidencyStats stats_;      ///< accounted_bytes: other and Ready bytes, and those loaded ahead, but not reserved ones
};

}  // namespace farfield
