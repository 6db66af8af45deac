// SPDX-License-Identifier: Apache-2.0
#include "cache/loader_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace farfield {
namespace {

TEST(LoaderThread, LoadsEachRequestedItemOnce) {
  std::vector<size_t> loaded;
  LoaderThread loader([&](size_t item) { loaded.push_back(item); });
  loader.resize(5);
  for (int i = 0; i < 100; ++i) {
    loader.request(3);
    loader.request(1);
  }
  loader.drain();
  EXPECT_EQ(loaded, (std::vector<size_t>{3, 1}));
}

TEST(LoaderThread, ManyThreadsMayRequestTheSame) {
  std::vector<int> counts(50, 0);
  LoaderThread loader([&](size_t item) { ++counts[item]; });
  loader.resize(50);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (size_t i = 0; i < 50; ++i) loader.request(i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  loader.drain();
  EXPECT_EQ(counts, std::vector<int>(50, 1));
}

TEST(LoaderThread, ForgettingDropsWhatWaitsAndAllowsNewRequests) {
  std::atomic<int> loads{0};
  LoaderThread loader([&](size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ++loads;
  });
  loader.resize(10);
  for (size_t i = 0; i < 10; ++i) loader.request(i);
  loader.forget();
  EXPECT_LT(loads, 10);
  const int before = loads;
  loader.request(9);
  loader.drain();
  EXPECT_EQ(loads, before + 1);
}

TEST(LoaderThread, EndsWithWorkWaiting) {
  LoaderThread loader([&](size_t) { std::this_thread::sleep_for(std::chrono::milliseconds(5)); });
  loader.resize(100);
  for (size_t i = 0; i < 100; ++i) loader.request(i);
}

TEST(LoaderThread, WithoutRequestsThereIsNothingToDo) {
  LoaderThread loader([](size_t) { FAIL(); });
  loader.drain();
  loader.forget();
}

}  // namespace
}  // namespace farfield
