// SPDX-License-Identifier: Apache-2.0
#include "cache/residency.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <array>
#include <atomic>
#include <set>
#include <stdexcept>
#include <thread>

#include "base/hash.h"
#include "base/parallel.h"
#include "tests/support/raise_to.h"

namespace farfield {
namespace {

/// A resident that knows whether it is whole, and counts how many are alive.
struct Tracked : Resident {
  Tracked(uint64_t number, std::atomic<int>& alive) : value(number), copy(number), alive_count(alive) { ++alive_count; }
  ~Tracked() override {
    value = 0;
    --alive_count;
  }
  bool is_whole() const { return value == copy; }
  uint64_t value, copy;
  std::atomic<int>& alive_count;
};

class ResidencyTest : public testing::Test {
 protected:
  /// An item that takes what it plans.
  ResidencyItem item(uint64_t resident, uint64_t peak, uint64_t number = 1) {
    return {resident, peak, [=, this](const LoadTerms&) -> Result<LoadedItem> {
              ++loads_;
              return LoadedItem{std::make_unique<Tracked>(number, alive_), resident, peak};
            }};
  }
  /// An item that plans one size and takes another.
  ResidencyItem liar(uint64_t planned, uint64_t actual, uint64_t actual_peak = 0) {
    ResidencyItem result = item(actual, actual_peak);
    result.resident_bytes = planned;
    result.build_peak_bytes = 0;
    return result;
  }
  ResidencyItem broken(const std::string& message) {
    return {10, 0, [=, this](const LoadTerms&) -> Result<LoadedItem> {
              ++loads_;
              return make_error(ErrorCode::BadFile, message);
            }};
  }
  ResidentSet::Report reports() {
    return
        [this](size_t index, const Error& error) { reports_.push_back(fmt::format("{}: {}", index, error.message)); };
  }

  std::atomic<int> alive_{0};
  std::atomic<int> loads_{0};
  std::vector<std::string> reports_;
};

TEST_F(ResidencyTest, LoadsOnFirstAcquireAndOnlyThen) {
  ResidentSet residency(1000);
  const size_t a = residency.add(item(100, 50, 7));
  EXPECT_EQ(residency.state(a), ItemState::Empty);
  EXPECT_EQ(residency.try_acquire(a), nullptr);
  EXPECT_EQ(loads_, 0);
  const auto* object = static_cast<const Tracked*>(residency.acquire(a));
  ASSERT_NE(object, nullptr);
  EXPECT_EQ(object->value, 7u);
  EXPECT_EQ(residency.acquire(a), object);
  EXPECT_EQ(residency.try_acquire(a), object);
  EXPECT_EQ(residency.state(a), ItemState::Ready);
  EXPECT_EQ(loads_, 1);
}

TEST_F(ResidencyTest, CountsResidentBytesAfterAndBuildPeaksDuringLoads) {
  ResidentSet residency(1000);
  residency.set_other_bytes(100);
  uint64_t during = 0;
  ResidencyItem watched = item(200, 300);
  watched.load = [&, load = watched.load](const LoadTerms& terms) {
    EXPECT_EQ(terms.most_bytes, 500u);
    during = residency.stats().accounted_bytes;
    return load(terms);
  };
  const size_t a = residency.add(watched);
  const size_t b = residency.add(item(50, 10));
  residency.acquire(a);
  EXPECT_EQ(during, 600u);
  EXPECT_EQ(residency.stats().accounted_bytes, 300u);
  EXPECT_EQ(residency.stats().peak_accounted_bytes, 600u);
  residency.acquire(b);
  EXPECT_EQ(residency.stats().accounted_bytes, 350u);
  EXPECT_EQ(residency.stats().peak_accounted_bytes, 600u);
  EXPECT_EQ(residency.stats().loads, 2u);
  EXPECT_EQ(residency.stats().ready_items, 2u);
  EXPECT_EQ(residency.stats().unplanned_bytes, 0u);
  EXPECT_GT(residency.stats().load_seconds, 0.0);
  residency.set_other_bytes(0);
  EXPECT_EQ(residency.stats().accounted_bytes, 250u);
}

TEST_F(ResidencyTest, ReleaseDestroysAndUncountsAndTheNextAcquireLoadsAgain) {
  ResidentSet residency(1000);
  const std::array items = {residency.add(item(100, 0)), residency.add(item(200, 0)), residency.add(item(300, 0))};
  for (const size_t i : items) residency.acquire(i);
  EXPECT_EQ(alive_, 3);
  residency.release(std::span(items).first(2));
  EXPECT_EQ(alive_, 1);
  EXPECT_EQ(residency.stats().accounted_bytes, 300u);
  EXPECT_EQ(residency.stats().releases, 2u);
  EXPECT_EQ(residency.state(items[0]), ItemState::Empty);
  EXPECT_NE(residency.acquire(items[0]), nullptr);
  EXPECT_EQ(residency.stats().loads, 4u);
  residency.release(items);  // one of them is Empty
  EXPECT_EQ(residency.stats().accounted_bytes, 0u);
  EXPECT_EQ(alive_, 0);
}

TEST_F(ResidencyTest, DestroysEverythingAtItsEnd) {
  {
    ResidentSet residency(1000);
    residency.acquire(residency.add(item(1, 0)));
    residency.acquire(residency.add(item(1, 0)));
    EXPECT_EQ(alive_, 2);
  }
  EXPECT_EQ(alive_, 0);
}

TEST_F(ResidencyTest, BrokenItemIsTriedOnceReportedOnceAndStaysBroken) {
  ResidentSet residency(1000, reports());
  const size_t a = residency.add(broken("bad bytes"));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(residency.acquire(a), nullptr);
  residency.release(std::span(&a, 1));
  EXPECT_EQ(residency.state(a), ItemState::Broken);
  EXPECT_EQ(residency.acquire(a), nullptr);
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(reports_, std::vector<std::string>{"0: bad bytes"});
  EXPECT_EQ(residency.stats().broken_items, 1u);
  EXPECT_EQ(residency.stats().accounted_bytes, 0u);
}

TEST_F(ResidencyTest, ExceptionInALoadIsABrokenItem) {
  ResidentSet residency(1000, reports());
  ResidencyItem throwing = item(1, 1);
  throwing.load = [](const LoadTerms&) -> Result<LoadedItem> { throw std::bad_alloc(); };
  const size_t a = residency.add(throwing);
  const size_t b = residency.add(item(1, 1));
  EXPECT_EQ(residency.acquire(a), nullptr);
  EXPECT_NE(residency.acquire(b), nullptr);
  EXPECT_EQ(reports_.size(), 1u);
}

TEST_F(ResidencyTest, LoadThatDoesNotFitIsNotStarted) {
  ResidentSet residency(1000, reports());
  const size_t a = residency.add(item(600, 0));
  const size_t b = residency.add(item(300, 101));
  ASSERT_NE(residency.acquire(a), nullptr);
  EXPECT_EQ(residency.acquire(b), nullptr);
  EXPECT_EQ(residency.acquire(b), nullptr);
  EXPECT_EQ(residency.state(b), ItemState::Refused);
  EXPECT_EQ(loads_, 1);
  ASSERT_EQ(reports_.size(), 1u);
  EXPECT_NE(reports_[0].find("1001 bytes"), std::string::npos) << reports_[0];
  EXPECT_LE(residency.stats().peak_accounted_bytes, 1000u);
  // The next plan has room for it.
  residency.release(std::array{a, b});
  EXPECT_EQ(residency.state(b), ItemState::Empty);
  EXPECT_EQ(residency.stats().broken_items, 0u);
  EXPECT_NE(residency.acquire(b), nullptr);
}

TEST_F(ResidencyTest, WhatALoadReallyTakesReplacesItsPlan) {
  ResidentSet residency(1000);
  const size_t more = residency.add(liar(100, 160, 40));
  const size_t less = residency.add(liar(100, 30));
  residency.acquire(more);
  EXPECT_EQ(residency.stats().accounted_bytes, 160u);
  EXPECT_EQ(residency.stats().unplanned_bytes, 100u);
  EXPECT_EQ(residency.stats().peak_accounted_bytes, 200u);
  EXPECT_EQ(residency.resident_bytes(more), 160u);
  EXPECT_EQ(residency.build_peak_bytes(more), 40u);
  residency.acquire(less);
  EXPECT_EQ(residency.stats().accounted_bytes, 190u);
  EXPECT_EQ(residency.stats().unplanned_bytes, 100u);
  residency.release(std::array{more, less});
  EXPECT_EQ(residency.stats().accounted_bytes, 0u);
}

TEST_F(ResidencyTest, LoadThatTurnsOutTooLargeIsUndone) {
  ResidentSet residency(1000, reports());
  const size_t a = residency.add(item(500, 0));
  const size_t b = residency.add(liar(100, 501));
  residency.acquire(a);
  EXPECT_EQ(residency.acquire(b), nullptr);
  EXPECT_EQ(alive_, 1);
  EXPECT_EQ(residency.stats().accounted_bytes, 500u);
  ASSERT_EQ(reports_.size(), 1u);
  EXPECT_NE(reports_[0].find("1001 bytes"), std::string::npos) << reports_[0];
  EXPECT_EQ(residency.resident_bytes(b), 501u);  // the next plan knows
  residency.release(std::span(&b, 1));
  EXPECT_EQ(residency.acquire(b), nullptr);  // now it is not even started
  EXPECT_EQ(loads_, 2);
}

TEST_F(ResidencyTest, HugePlansDoNotOverflow) {
  ResidentSet residency(1000, reports());
  const size_t a = residency.add(item(~uint64_t{0}, ~uint64_t{0}));
  EXPECT_EQ(residency.acquire(a), nullptr);
  EXPECT_EQ(loads_, 0);
}

TEST_F(ResidencyTest, ManyThreadsShareOneLoad) {
  ResidentSet residency(1000);
  std::atomic<int> running{0};
  ResidencyItem slow = item(10, 10, 5);
  slow.load = [&, load = slow.load](const LoadTerms& terms) {
    EXPECT_EQ(++running, 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    --running;
    return load(terms);
  };
  const size_t a = residency.add(slow);
  std::array<const Resident*, 8> seen{};
  std::vector<std::thread> threads;
  for (auto& slot : seen) threads.emplace_back([&] { slot = residency.acquire(a); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(std::set<const Resident*>(seen.begin(), seen.end()).size(), 1u);
  EXPECT_NE(seen[0], nullptr);
}

/// Frames of threads that acquire random items, with releases between frames, in a budget that never has room for all:
/// the accounting stays below the budget, also while several loads run, objects are whole, broken items stay broken.
/// Meanwhile items are loaded ahead, which nobody notices.
TEST_F(ResidencyTest, StressUnderATinyBudget) {
  constexpr size_t kItems = 40;
  constexpr uint64_t kBudget = 400;
  std::atomic<uint64_t> taken{0};  // by loads that run
  std::atomic<int> report_count{0};
  ResidentSet residency(kBudget, [&](size_t index, const Error& error) {
    // A broken item may also be refused for lack of budget before anyone sees that it is broken.
    EXPECT_TRUE(error.code == ErrorCode::OutOfBudget || (error.code == ErrorCode::BadFile && index % 10 == 3));
    ++report_count;
  });
  for (size_t i = 0; i < kItems; ++i) {
    ResidencyItem tracked = i % 10 == 3 ? broken("bad") : item(10 + i, i % 7, i);
    const uint64_t bytes = tracked.resident_bytes + tracked.build_peak_bytes;
    tracked.load = [&, bytes, load = tracked.load](const LoadTerms& terms) {
      EXPECT_LE(taken += bytes, kBudget);
      std::atomic<uint64_t> sum{0};
      parallel_for(64, 8, [&](size_t begin, size_t end) { sum += end - begin; });
      EXPECT_EQ(sum, 64u);
      auto loaded = load(terms);
      taken -= bytes;
      return loaded;
    };
    residency.add(tracked);
  }
  for (uint64_t frame = 0; frame < 60; ++frame) {
    std::vector<std::thread> threads;
    residency.set_ahead_room(frame % 3 * kBudget / 4);
    std::atomic<bool> is_done{false};
    std::thread ahead([&] {
      for (uint64_t step = 0; !is_done; ++step) residency.load_ahead(mix64(frame, step) % kItems);
    });
    for (uint64_t thread = 0; thread < 6; ++thread) {
      threads.emplace_back([&, thread] {
        for (uint64_t step = 0; step < 200; ++step) {
          const size_t index = mix64(frame * 1000 + thread, step) % kItems;
          const Resident* object = step % 3 == 0 ? residency.try_acquire(index) : residency.acquire(index);
          if (object == nullptr) continue;
          const auto& tracked = static_cast<const Tracked&>(*object);
          ASSERT_TRUE(tracked.is_whole());
          ASSERT_EQ(tracked.value, index);
          ASSERT_NE(index % 10, 3u);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    std::vector<size_t> released, kept;
    for (size_t i = 0; i < kItems; ++i) (mix64(frame, i) % 3 != 0 ? released : kept).push_back(i);
    residency.drop_ahead(kept);  // while some are being loaded
    residency.release(released);
    is_done = true;
    ahead.join();
    EXPECT_LE(residency.stats().accounted_bytes, kBudget);
    residency.drop_ahead();
    uint64_t expected = 0;
    for (size_t i = 0; i < kItems; ++i) {
      if (residency.state(i) == ItemState::Ready) expected += 10 + i;
    }
    EXPECT_EQ(residency.stats().accounted_bytes, expected);
  }
  const ResidencyStats stats = residency.stats();
  EXPECT_LE(stats.peak_accounted_bytes, kBudget);
  EXPECT_GT(stats.peak_accounted_bytes, kBudget / 2);
  EXPECT_EQ(static_cast<int>(stats.ready_items), alive_.load());
  for (size_t i = 0; i < kItems; ++i) {
    residency.release(std::array{i});
    EXPECT_EQ(residency.acquire(i) == nullptr, i % 10 == 3);
    residency.release(std::array{i});
  }
  EXPECT_GE(report_count, 4);
  EXPECT_EQ(residency.stats().accounted_bytes, 0u);
}

TEST_F(ResidencyTest, SeveralLoadsRunAtATimeWhereTheyFit) {
  for (const bool do_fit : {true, false}) {
    ResidentSet residency(do_fit ? 1000 : 150, reports());
    std::atomic<int> running{0}, most{0};
    for (int i = 0; i < 2; ++i) {
      ResidencyItem slow = item(50, 50);
      slow.load = [&, load = slow.load](const LoadTerms& terms) {
        test::raise_to(most, ++running);
        for (int wait = 0; wait < 1000 && do_fit && most < 2; ++wait)
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
        if (!do_fit) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        --running;
        return load(terms);
      };
      residency.add(slow);
    }
    std::thread other([&] { EXPECT_NE(residency.acquire(1), nullptr); });
    EXPECT_NE(residency.acquire(0), nullptr);
    other.join();
    EXPECT_EQ(most, do_fit ? 2 : 1);
    EXPECT_EQ(residency.stats().peak_accounted_bytes, do_fit ? residency.stats().peak_accounted_bytes : 150u);
    EXPECT_EQ(residency.stats().accounted_bytes, 100u);
    EXPECT_GT(residency.stats().wait_seconds, 0.0);
  }
  EXPECT_TRUE(reports_.empty());
}

TEST_F(ResidencyTest, ALoadThatNeedsMoreThanItsPlanIsDoneAgainWithAllThatIsLeft) {
  ResidentSet residency(1000, reports());
  std::vector<uint64_t> most;
  const auto add_honest = [&](uint64_t needs) {  // fails where it may not take so much
    ResidencyItem honest = liar(100, needs);
    honest.load = [&, needs, load = honest.load](const LoadTerms& terms) -> Result<LoadedItem> {
      most.push_back(terms.most_bytes);
      if (terms.most_bytes < needs) return make_error(ErrorCode::OutOfBudget, "too much");
      return load(terms);
    };
    return residency.add(honest);
  };
  residency.acquire(residency.add(item(200, 0)));
  EXPECT_NE(residency.acquire(add_honest(300)), nullptr);
  EXPECT_EQ(most, (std::vector<uint64_t>{100, 800}));
  EXPECT_EQ(residency.acquire(add_honest(501)), nullptr);
  EXPECT_EQ(most, (std::vector<uint64_t>{100, 800, 100, 500}));
  EXPECT_EQ(reports_, std::vector<std::string>{"2: too much"});
  EXPECT_EQ(residency.stats().accounted_bytes, 500u);
}

TEST_F(ResidencyTest, WhatIsLoadedAheadIsSeenByNobodyUntilItIsAcquired) {
  ResidentSet residency(1000, reports());
  const size_t a = residency.add(item(100, 50, 7));
  residency.load_ahead(a);
  EXPECT_EQ(loads_, 0);  // no room was set aside
  residency.set_ahead_room(150);
  residency.load_ahead(a);
  residency.load_ahead(a);
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(residency.state(a), ItemState::Empty);
  EXPECT_EQ(residency.try_acquire(a), nullptr);
  EXPECT_EQ(residency.stats().loads, 0u);
  EXPECT_EQ(residency.stats().accounted_bytes, 100u);
  EXPECT_EQ(residency.stats().peak_accounted_bytes, 150u);
  const auto* object = static_cast<const Tracked*>(residency.acquire(a));
  ASSERT_NE(object, nullptr);
  EXPECT_EQ(object->value, 7u);
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(residency.stats().loads, 1u);
  EXPECT_EQ(residency.stats().accounted_bytes, 100u);
  residency.drop_ahead();
  EXPECT_EQ(alive_, 1);
}

TEST_F(ResidencyTest, LoadsAheadStayInTheirRoomAndGoWhereALoadIsNeeded) {
  ResidentSet residency(1000, reports());
  residency.set_ahead_room(500);
  const std::array ahead = {residency.add(item(200, 100)), residency.add(item(200, 101)),
                            residency.add(item(200, 100))};
  for (const size_t i : ahead) residency.load_ahead(i);
  EXPECT_EQ(loads_, 2);  // the second does not fit the room beside the first
  EXPECT_EQ(residency.stats().accounted_bytes, 400u);
  ASSERT_NE(residency.acquire(residency.add(item(500, 100))), nullptr);  // fits beside them
  EXPECT_EQ(alive_, 3);
  ASSERT_NE(residency.acquire(residency.add(item(450, 0))), nullptr);
  EXPECT_EQ(alive_, 2);
  EXPECT_EQ(residency.stats().accounted_bytes, 950u);
  EXPECT_EQ(residency.stats().peak_accounted_bytes, 1000u);
  EXPECT_TRUE(reports_.empty());
}

TEST_F(ResidencyTest, WhatFailsAheadIsSaidOnceAndNotBeforeItIsNeeded) {
  ResidentSet residency(1000, reports());
  residency.set_ahead_room(1000);
  const size_t bad = residency.add(broken("bad bytes")), lies = residency.add(liar(100, 60));
  for (int i = 0; i < 3; ++i) {
    residency.load_ahead(bad);
    residency.load_ahead(lies);
  }
  EXPECT_EQ(loads_, 2);  // once each
  EXPECT_TRUE(reports_.empty());
  EXPECT_EQ(alive_, 0);
  EXPECT_EQ(residency.state(bad), ItemState::Empty);
  EXPECT_EQ(residency.resident_bytes(lies), 100u);  // plans are the same as without
  EXPECT_EQ(residency.stats().accounted_bytes, 0u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(residency.acquire(bad), nullptr);
    residency.load_ahead(bad);
  }
  EXPECT_EQ(reports_, std::vector<std::string>{"0: bad bytes"});
  EXPECT_NE(residency.acquire(lies), nullptr);
  EXPECT_EQ(residency.resident_bytes(lies), 60u);
}

TEST_F(ResidencyTest, DroppingStopsALoadAheadButForThoseThatAreKept) {
  ResidentSet residency(1000, reports());
  residency.set_ahead_room(1000);
  std::atomic<bool> has_begun{false};
  ResidencyItem patient = item(10, 0);
  patient.load = [&, load = patient.load](const LoadTerms& terms) -> Result<LoadedItem> {
    has_begun = true;
    if (!terms.cancel) return load(terms);
    while (!terms.is_cancelled()) std::this_thread::yield();
    return make_error(ErrorCode::Cancelled, "as asked");
  };
  const size_t kept = residency.add(item(10, 0)), patient_item = residency.add(patient);
  residency.load_ahead(kept);
  std::thread ahead([&] { residency.load_ahead(patient_item); });
  while (!has_begun) std::this_thread::yield();
  residency.drop_ahead(std::array{kept});
  ahead.join();
  EXPECT_EQ(alive_, 1);
  EXPECT_EQ(residency.stats().accounted_bytes, 10u);
  EXPECT_NE(residency.acquire(patient_item), nullptr);
  EXPECT_NE(residency.acquire(kept), nullptr);
  EXPECT_EQ(loads_, 2);
  EXPECT_TRUE(reports_.empty());
}

/// Rays run as tasks of one parallel loop, and a load runs a parallel loop of its own. Were the loading thread to take
/// up a ray while it waits for its loop, that ray would wait for the load below it on the same stack, for ever.
/// RunIsolated.WaitingThreadTakesUpNoTasksFromOutside shows that TBB does so unless it is told not to.
TEST_F(ResidencyTest, LoadsThatUseTheThreadsOfTheCallersLoopDoNotDeadlock) {
  const auto nap = [] { std::this_thread::sleep_for(std::chrono::microseconds(100)); };
  constexpr size_t kItems = 20;
  ResidentSet residency(1u << 20);
  for (size_t i = 0; i < kItems; ++i) {
    ResidencyItem parallel = item(10, 10, i);
    parallel.load = [=, load = parallel.load](const LoadTerms& terms) {
      parallel_for(64, 1, [&](size_t, size_t) { nap(); });
      return load(terms);
    };
    residency.add(parallel);
  }
  std::atomic<size_t> hits{0};
  const auto trace_rays = [&] {
    parallel_for(5000, 1, [&](size_t begin, size_t) {
      nap();
      const size_t index = mix64(begin) % (50 * kItems);  // most rays need no item, so that threads are free to help
      if (index < kItems && residency.acquire(index) != nullptr) ++hits;
    });
  };
  const ThreadLimit more_threads_than_processors(8);
  tbb::task_arena(8).execute(trace_rays);
  EXPECT_EQ(residency.stats().loads, kItems);
  EXPECT_GT(hits, kItems);
}

}  // namespace
}  // namespace farfield
