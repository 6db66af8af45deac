// SPDX-License-Identifier: Apache-2.0
#include "cache/residency.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <utility>
#include <vector>

#include "base/bytes.h"
#include "base/check.h"
#include "base/parallel.h"

namespace farfield {

namespace {

uint64_t saturating_add(uint64_t a, uint64_t b) {
  uint64_t sum;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<uint64_t>::max() : sum;
}

uint64_t excess(uint64_t actual, uint64_t planned) { return actual > planned ? actual - planned : 0; }

/// Runs a load. An exception (out of memory, as a rule) becomes an Error: if it passed, the waiting threads would wait
/// for ever.
Result<LoadedItem> run_load(const ResidencyItem& item, uint64_t bytes_left) {
  Result<LoadedItem> loaded;
  run_isolated([&] {
    try {
      loaded = item.load(bytes_left);
    } catch (const std::exception& exception) {
      loaded = make_error(ErrorCode::Io, fmt::format("loading failed: {}", exception.what()));
    }
  });
  FARFIELD_CHECK(!loaded || loaded->object != nullptr);
  return loaded;
}

bool has_failed(ItemState state) { return state == ItemState::Refused || state == ItemState::Broken; }

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
  load_ended_.wait(lock, [&] {
    const ItemState state = item.state.load(std::memory_order_relaxed);
    return state == ItemState::Ready || has_failed(state) || (state == ItemState::Empty && !is_loading_);
  });
  if (item.state.load(std::memory_order_relaxed) == ItemState::Empty) load(index, lock);
  return item.object.get();
}

void ResidentSet::load(size_t index, std::unique_lock<std::mutex>& lock) {
  Item& item = items_[index];
  is_loading_ = true;
  item.state.store(ItemState::Loading, std::memory_order_relaxed);
  const Result<void> reserved = reserve(item);
  const uint64_t bytes_left = budget_bytes_ - std::min(budget_bytes_, stats_.accounted_bytes);

  lock.unlock();
  const auto start = std::chrono::steady_clock::now();
  Result<LoadedItem> loaded = reserved ? run_load(item.planned, bytes_left) : tl::unexpected(reserved.error());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  lock.lock();

  reserved_bytes_ = 0;
  const Result<void> settled = settle(item, loaded);
  if (settled) {
    stats_.load_seconds += seconds.count();
    item.stats.load_seconds += seconds.count();
    ++item.stats.loads;
  }

  lock.unlock();
  if (!settled) {
    loaded = tl::unexpected(settled.error());  // destroys what was loaded and may not stay
    if (report_) report_(index, settled.error());
  }
  lock.lock();

  is_loading_ = false;
  load_ended_.notify_all();
}

/// Counts the item's planned bytes before it is loaded.
Result<void> ResidentSet::reserve(Item& item) {
  const uint64_t planned = saturating_add(item.planned.resident_bytes, item.planned.build_peak_bytes);
  const uint64_t total = saturating_add(stats_.accounted_bytes, planned);
  if (total > budget_bytes_) {
    return make_error(ErrorCode::OutOfBudget,
                      fmt::format("loading it needs {} more, and {} of the budget of {} are in use; raise the budget "
                                  "to {} ({} bytes)",
                                  format_bytes(planned), format_bytes(stats_.accounted_bytes),
                                  format_bytes(budget_bytes_), format_bytes(total), total));
  }
  reserved_bytes_ = planned;
  stats_.peak_accounted_bytes = std::max(stats_.peak_accounted_bytes, total);
  return {};
}

/// Replaces the plan by what the load took, and decides whether the item is Ready, Refused or Broken.
Result<void> ResidentSet::settle(Item& item, Result<LoadedItem>& loaded) {
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
  item.object = std::move(loaded->object);
  ++stats_.loads;
  ++stats_.ready_items;
  item.state.store(ItemState::Ready, std::memory_order_release);
  // release: a thread that reads the pointer without the lock sees the whole object
  item.ready.store(item.object.get(), std::memory_order_release);
  return {};
}

Result<void> ResidentSet::account(Item& item, const LoadedItem& loaded) {
  const uint64_t with_item = saturating_add(stats_.accounted_bytes, loaded.resident_bytes);
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
                                  format_bytes(loaded.resident_bytes), format_bytes(stats_.accounted_bytes),
                                  format_bytes(budget_bytes_), format_bytes(worst), worst));
  }
  stats_.accounted_bytes = with_item;
  return {};
}

void ResidentSet::release(std::span<const size_t> items) {
  std::vector<std::unique_ptr<Resident>> dropped;
  uint64_t dropped_bytes = 0;
  {
    const std::lock_guard lock(mutex_);
    FARFIELD_CHECK(!is_loading_);
    for (const size_t index : items) {
      Item& item = items_[index];
      const ItemState state = item.state.load(std::memory_order_relaxed);
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
  snapshot.accounted_bytes = saturating_add(stats_.accounted_bytes, reserved_bytes_);
  return snapshot;
}

}  // namespace farfield
