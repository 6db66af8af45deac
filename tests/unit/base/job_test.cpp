// SPDX-License-Identifier: Apache-2.0
#include "base/job.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace farfield {
namespace {

TEST(Job, AnEmptyOneNeitherReportsNorStops) {
  const Job job;
  job.report(0.5, "x");
  EXPECT_FALSE(job.is_cancelled());
  EXPECT_FALSE(job.step("part", 0, 1).progress);
}

TEST(Job, AStepReportsItsShareOfTheWholeUnderItsName) {
  std::vector<std::pair<double, std::string>> reports;
  const Job job{[&](double done, const std::string& stage) { reports.emplace_back(done, stage); }};
  const Job outer = job.step("outer", 0.2, 0.6);
  outer.step("inner", 0.5, 1.0).report(0.5, "ignored");
  job.quiet().report(1, "quiet");
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_DOUBLE_EQ(reports[0].first, 0.2 + 0.75 * 0.4);
  EXPECT_EQ(reports[0].second, "outer");
}

TEST(Job, EveryStepSeesTheCancel) {
  std::atomic<bool> cancel{false};
  const Job job{{}, &cancel};
  const Job step = job.step("part", 0, 1), quiet = job.quiet();
  EXPECT_FALSE(step.is_cancelled() || quiet.is_cancelled());
  cancel = true;
  EXPECT_TRUE(job.is_cancelled() && step.is_cancelled() && quiet.is_cancelled());
}

}  // namespace
}  // namespace farfield
