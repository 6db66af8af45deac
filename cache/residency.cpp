// SPDX-License-Identifier: Apache-2.0
#include "cache/residency.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>
#include <vector>

#include "base/bytes.h"
#include "base/check.h"
#include "base/parallel.h"
#include "base/stopwatch.h"

namespace farfield {

namespace {

uint64_t saturating_add(uint64_t a, uint64_t b) {
  uint64_t sum;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<uint64_t>::max() : sum;
}

uint64_t excess(uint64_t actual, uint64_t planned) { return actual > planned ? actual - planned : 0; }

/// Runs a load. An exception (out of memory, as a rule) becomes an Error: if it passed, the waiting threads would wait
/// for ever.
Result<LoadedItem> run_load(const ResidencyItem& item, const LoadTerms& terms) {
  Result<LoadedItem> loaded;
  run_isolated([&] {
    try {
      loaded = item.load(terms);
    } catch (const std::exception& exception) {
      loaded = make_error(ErrorCode::Io, fmt::format("loading failed: {}", exception.what()));
    }
  });
  FARFIELD_CHECK(!loaded || loaded->object != nullptr);
  return loaded;
}

bool has_failed(ItemState state) { return state == ItemState::Refused || state == ItemState::Broken; }

uint64_t while_loading(const ResidencyItem& item) { return saturating_add(item.resident_bytes, item.build_peak_bytes); }

}  // namespace

ResidentSet::ResidentSet(uint64_t budget_bytes, Report report)
    : budget_bytes_(budget_bytes), report_(std::move(report)) {}

ResidentSet::~ResidentSet() = default;

size_t ResidentSet::add(ResidencyItem item) {
  FARFIELD_CHECK(item.load != nullptr);
  const std::lock_guard lock(mutex_);
  items_.emplace_back().planned = std::move(item);
  return items_.size() - 1;
}

const Resident* ResidentSet::acquire_slowly(size_t index) {
  Item& item = items_[index];
  if (has_failed(item.state.load(std::memory_order_acquire))) return nullptr;  // rays ask often: no lock
  std::unique_lock lock(mutex_);
  const Stopwatch watch;
  while (true) {
    const ItemState state = item.state.load(std::memory_order_relaxed);
    if (state == ItemState::Ready || has_failed(state)) break;
    if (item.ahead) {
      ahead_bytes_ -= item.planned.resident_bytes;
      make_ready(item, std::move(item.ahead), item.ahead_seconds);
    } else if (state == ItemState::Loading || item.is_loading_ahead) {
      load_ended_.wait(lock);
    } else if (may_load(item)) {
      load(index, lock);
    } else if (loads_running_ > 0) {
      load_ended_.wait(lock);
    } else if (ahead_bytes_ > 0) {  // it does not fit, or wants all there is: guesses go
      ahead_room_bytes_ = 0;
      drop_ahead({}, lock);
    } else {
      load(index, lock);
    }
  }
  stats_.wait_seconds += watch.seconds();
  return item.object.get();
}

/// Whether it fits beside all that is there and that is being loaded.
bool ResidentSet::may_load(const Item& item) const {
  const uint64_t in_use = saturating_add(stats_.accounted_bytes, reserved_bytes_);
  return !is_alone_ && !item.needs_more && saturating_add(in_use, while_loading(item.planned)) <= budget_bytes_;
}

void ResidentSet::load(size_t index, std::unique_lock<std::mutex>& lock) {
  Item& item = items_[index];
  item.state.store(ItemState::Loading, std::memory_order_relaxed);
  item.has_failed_ahead = false;
  ++loads_running_;
  const uint64_t left = budget_bytes_ - std::min(budget_bytes_, stats_.accounted_bytes);
  const Result<uint64_t> reserved = reserve(item);
  is_alone_ = item.needs_more;
  const uint64_t most = is_alone_ ? left : reserved.value_or(0);

  lock.unlock();
  const Stopwatch watch;
  Result<LoadedItem> loaded = reserved ? run_load(item.planned, {most}) : tl::unexpected(reserved.error());
  const double seconds = watch.seconds();
  lock.lock();

  --loads_running_;
  is_alone_ = false;
  reserved_bytes_ -= reserved.value_or(0);
  load_ended_.notify_all();
  if (reserved && !loaded && loaded.error().code == ErrorCode::OutOfBudget && most < left) {
    item.needs_more = true;
    item.state.store(ItemState::Empty, std::memory_order_relaxed);
    return;
  }
  const Result<void> settled = settle(item, loaded, seconds);
  if (settled) return;
  lock.unlock();
  loaded = tl::unexpected(settled.error());  // destroys what was loaded and may not stay
  if (report_) {
    const std::lock_guard one_at_a_time(report_mutex_);
    report_(index, settled.error());
  }
  lock.lock();
}

/// Counts the item's planned bytes before it is loaded.
Result<uint64_t> ResidentSet::reserve(Item& item) {
  const uint64_t planned = while_loading(item.planned);
  const uint64_t in_use = saturating_add(stats_.accounted_bytes, reserved_bytes_);
  const uint64_t total = saturating_add(in_use, planned);
  if (total > budget_bytes_) {
    return make_error(
        ErrorCode::OutOfBudget,
        fmt::format(
            "loading it needs {} more, and {} of the budget of {} are in use; raise the budget to {} ({} bytes)",
            format_bytes(planned), format_bytes(in_use), format_bytes(budget_bytes_), format_bytes(total), total));
  }
  reserved_bytes_ += planned;
  stats_.peak_accounted_bytes = std::max(stats_.peak_accounted_bytes, total);
  return planned;
}

/// The item's bytes are counted already.
void ResidentSet::make_ready(Item& item, std::unique_ptr<Resident> object, double seconds) {
  item.object = std::move(object);
  item.stats.load_seconds += seconds;
  ++item.stats.loads;
  stats_.load_seconds += seconds;
  ++stats_.loads;
  ++stats_.ready_items;
  item.state.store(ItemState::Ready, std::memory_order_release);
  // release: a thread that reads the pointer without the lock sees the whole object
  item.ready.store(item.object.get(), std::memory_order_release);
}

/// Replaces the plan by what the load took, and decides whether the item is Ready, Refused or Broken.
Result<void> ResidentSet::settle(Item& item, Result<LoadedItem>& loaded, double seconds) {
  item.needs_more = false;
  Result<void> outcome;
  if (loaded) {
    outcome = account(item, *loaded);
  } else {
    outcome = tl::unexpected(loaded.error());
  }
  if (!outcome) {
    ++stats_.broken_items;
    const bool is_refused = outcome.error().code == ErrorCode::OutOfBudget;
    item.state.store(is_refused ? ItemState::Refused : ItemState::Broken, std::memory_order_release);
    return outcome;
  }
  make_ready(item, std::move(loaded->object), seconds);
  return {};
}

Result<void> ResidentSet::account(Item& item, const LoadedItem& loaded) {
  const uint64_t in_use = saturating_add(stats_.accounted_bytes, reserved_bytes_);
  const uint64_t with_item = saturating_add(in_use, loaded.resident_bytes);
  const uint64_t worst = saturating_add(with_item, loaded.build_peak_bytes);
  stats_.peak_accounted_bytes = std::max(stats_.peak_accounted_bytes, worst);
  stats_.unplanned_bytes = saturating_add(
      stats_.unplanned_bytes, saturating_add(excess(loaded.resident_bytes, item.planned.resident_bytes),
                                             excess(loaded.build_peak_bytes, item.planned.build_peak_bytes)));
  item.planned.resident_bytes = loaded.resident_bytes;
  item.planned.build_peak_bytes = loaded.build_peak_bytes;
  if (with_item > budget_bytes_) {
    return make_error(ErrorCode::OutOfBudget,
                      fmt::format("it takes {}, more than planned, and {} of the budget of {} are in use; raise the "
                                  "budget to {} ({} bytes)",
                                  format_bytes(loaded.resident_bytes), format_bytes(in_use),
                                  format_bytes(budget_bytes_), format_bytes(worst), worst));
  }
  stats_.accounted_bytes += loaded.resident_bytes;
  return {};
}

void ResidentSet::set_ahead_room(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  ahead_room_bytes_ = bytes;
}

void ResidentSet::load_ahead(size_t index) {
  std::unique_lock lock(mutex_);
  Item& item = items_[index];
  const uint64_t resident = item.planned.resident_bytes, peak = item.planned.build_peak_bytes;
  const uint64_t bytes = while_loading(item.planned);
  const bool is_wanted = item.state.load(std::memory_order_relaxed) == ItemState::Empty && !item.ahead &&
                         !item.is_loading_ahead && !item.has_failed_ahead;
  if (!is_wanted || !may_load(item) || saturating_add(ahead_bytes_, bytes) > ahead_room_bytes_) return;

  item.is_loading_ahead = true;
  item.cancel_ahead.store(false, std::memory_order_relaxed);
  reserved_bytes_ += bytes;
  ahead_bytes_ += bytes;
  stats_.peak_accounted_bytes = std::max(stats_.peak_accounted_bytes, stats_.accounted_bytes + reserved_bytes_);

  lock.unlock();
  const Stopwatch watch;
  Result<LoadedItem> loaded = run_load(item.planned, {bytes, &item.cancel_ahead});
  const double seconds = watch.seconds();
  const bool is_as_planned = loaded && loaded->resident_bytes == resident && loaded->build_peak_bytes == peak;
  if (!is_as_planned) loaded = LoadedItem();  // before its room is anyone else's
  lock.lock();

  const bool is_cancelled = item.cancel_ahead.load(std::memory_order_relaxed);
  reserved_bytes_ -= bytes;
  ahead_bytes_ -= bytes;
  item.is_loading_ahead = false;
  item.has_failed_ahead = !is_as_planned && !is_cancelled;
  if (is_as_planned) {  // also if it is too late to cancel: drop_ahead() waits for the end and drops it
    item.ahead = std::move(loaded->object);
    item.ahead_seconds = seconds;
    ahead_bytes_ += resident;
    stats_.accounted_bytes += resident;
  }
  load_ended_.notify_all();
}

void ResidentSet::drop_ahead(std::span<const size_t> kept) {
  std::unique_lock lock(mutex_);
  drop_ahead(kept, lock);
}

void ResidentSet::drop_ahead(std::span<const size_t> kept, std::unique_lock<std::mutex>& lock) {
  if (ahead_bytes_ == 0) return;
  const auto is_kept = [&](size_t index) { return std::ranges::binary_search(kept, index); };
  for (size_t i = 0; i < items_.size(); ++i) {
    if (items_[i].is_loading_ahead && !is_kept(i)) items_[i].cancel_ahead.store(true, std::memory_order_relaxed);
  }
  Dropped dropped;
  uint64_t dropped_bytes = 0;
  for (size_t i = 0; i < items_.size(); ++i) {
    if (is_kept(i)) continue;
    Item& item = items_[i];
    load_ended_.wait(lock, [&] { return !item.is_loading_ahead; });
    if (!item.ahead) continue;
    dropped.push_back(std::move(item.ahead));
    dropped_bytes += item.planned.resident_bytes;
  }
  lock.unlock();
  dropped.clear();
  lock.lock();
  ahead_bytes_ -= dropped_bytes;
  stats_.accounted_bytes -= dropped_bytes;
}

void ResidentSet::release(std::span<const size_t> items) {
  Dropped dropped;
  uint64_t dropped_bytes = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const size_t index : items) {
      Item& item = items_[index];
      const ItemState state = item.state.load(std::memory_order_relaxed);
      FARFIELD_CHECK(state != ItemState::Loading);
      if (state == ItemState::Ready) {
        item.ready.store(nullptr, std::memory_order_relaxed);  // no reader runs now: see the thread rule
        dropped.push_back(std::move(item.object));
        dropped_bytes += item.planned.resident_bytes;
        --stats_.ready_items;
        ++stats_.releases;
      } else if (state == ItemState::Refused) {
        --stats_.broken_items;
      } else {
        continue;
      }
      item.state.store(ItemState::Empty, std::memory_order_relaxed);
    }
  }
  dropped.clear();
  const std::lock_guard lock(mutex_);
  stats_.accounted_bytes -= dropped_bytes;
}

uint64_t ResidentSet::resident_bytes(size_t item) const {
  const std::lock_guard lock(mutex_);
  return items_[item].planned.resident_bytes;
}

uint64_t ResidentSet::build_peak_bytes(size_t item) const {
  const std::lock_guard lock(mutex_);
  return items_[item].planned.build_peak_bytes;
}

ItemStats ResidentSet::item_stats(size_t item) const {
  const std::lock_guard lock(mutex_);
  return items_[item].stats;
}

void ResidentSet::set_other_bytes(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  stats_.accounted_bytes = saturating_add(stats_.accounted_bytes - other_bytes_, bytes);
  other_bytes_ = bytes;
  stats_.peak_accounted_bytes = std::max(stats_.peak_accounted_bytes, stats_.accounted_bytes + reserved_bytes_);
}

ResidencyStats ResidentSet::stats() const {
  const std::lock_guard lock(mutex_);
  ResidencyStats snapshot = stats_;
  snapshot.accounted_bytes += reserved_bytes_;
  return snapshot;
}

}  // namespace farfield
