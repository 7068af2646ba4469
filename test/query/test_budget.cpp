// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/budget.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

namespace cuboid_mapping {
namespace {

QueryLimits bricks(std::uint64_t count) {
  QueryLimits limits;
  limits.max_bricks = count;
  return limits;
}

TEST(Budget, isSpentWithTheBrickAfterTheLast) {
  for (const std::uint64_t count : {0U, 1U, 255U, 256U, 257U, 1000U, 100000U}) {
    Budget budget(bricks(count));
    std::uint64_t num_spent = 0;
    while (num_spent <= count && budget.spend()) ++num_spent;
    EXPECT_EQ(num_spent, count);
    EXPECT_EQ(budget.whyEnded(), BudgetLimit::kBricks);
    EXPECT_FALSE(budget.spend(0)) << "it stays spent";
    EXPECT_FALSE(budget.addEntries());
  }
}

TEST(Budget, withoutALimitIsOneForAllThreadsAndNeverWritten) {
  Budget* of_other_thread = nullptr;
  std::thread([&] { of_other_thread = &Budget::unlimited(); }).join();
  ASSERT_EQ(of_other_thread, &Budget::unlimited());
  const auto bytes = [](const Budget& budget) {
    std::string copy(sizeof(Budget), '\0');
    std::memcpy(copy.data(), static_cast<const void*>(&budget), sizeof(Budget));
    return copy;
  };
  Budget own;
  for (Budget* budget : {&own, &Budget::unlimited()}) {
    const std::string before = bytes(*budget);
    for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0}}) {
      EXPECT_TRUE(budget->spend(count));
      EXPECT_TRUE(budget->spendAndUnlock(count));
      EXPECT_TRUE(budget->addEntries(count));
    }
    EXPECT_TRUE(budget->checkClock());
    budget->end(BudgetLimit::kStopped);
    EXPECT_FALSE(budget->isSpent());
    EXPECT_EQ(bytes(*budget), before);
  }
}

TEST(Budget, countsBricksOfAnyNumberAtOnce) {
  Budget budget(bricks(1000));
  EXPECT_TRUE(budget.spend(10));
  EXPECT_TRUE(budget.spend(900));
  EXPECT_TRUE(budget.spendAndUnlock(90));
  EXPECT_TRUE(budget.spend(0));
  EXPECT_FALSE(budget.spend(1));
  Budget small(bricks(1000));
  EXPECT_FALSE(small.spend(std::numeric_limits<std::uint64_t>::max()));
}

TEST(Budget, takesEntriesAllOrNone) {
  QueryLimits limits;
  limits.max_entries = 5;
  Budget budget(limits);
  EXPECT_TRUE(budget.addEntries(3));
  EXPECT_TRUE(budget.addEntries(2));
  EXPECT_FALSE(budget.isSpent());
  EXPECT_FALSE(budget.addEntries(1));
  EXPECT_EQ(budget.whyEnded(), BudgetLimit::kEntries);
  EXPECT_TRUE(budget.isSpent());
  EXPECT_TRUE(budget.spend()) << "what is there already can be worked on";
  budget.end(BudgetLimit::kTime);
  EXPECT_FALSE(budget.spend());
}

TEST(Budget, endsWithItsTime) {
  Budget budget(QueryLimits{1e-3});
  std::uint64_t num_spent = 0;
  while (budget.spend()) ++num_spent;
  EXPECT_EQ(budget.whyEnded(), BudgetLimit::kTime);
  EXPECT_GE(num_spent, 255U) << "the clock is not read for every brick";
  Budget late(QueryLimits{0.0});
  EXPECT_FALSE(late.checkClock());
}

TEST(Budget, refusesATimeThatIsNaNAndEndsWithOneThatIsOver) {
  EXPECT_THROW(Budget(QueryLimits{std::nan("")}), std::invalid_argument);
  EXPECT_THROW(Budget({}, {[] {}, std::nan(""), nullptr}), std::invalid_argument);
  for (const double time_s : {-0.5, -1e300, -std::numeric_limits<double>::infinity()}) {
    Budget budget(QueryLimits{time_s});
    EXPECT_FALSE(budget.checkClock()) << time_s;
    EXPECT_EQ(budget.whyEnded(), BudgetLimit::kTime) << time_s;
  }
}

TEST(Budget, withoutLimitsIsNeverSpent) {
  Budget& budget = Budget::unlimited();
  EXPECT_TRUE(budget.spend(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_TRUE(budget.spend(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_TRUE(budget.addEntries(std::numeric_limits<std::uint64_t>::max()));
  budget.end(BudgetLimit::kBricks);
  EXPECT_TRUE(budget.spend());
}

TEST(Budget, letsOthersHaveTheirTurnNowAndThenAndOnlyWhereAsked) {
  int num_turns = 0;
  Budget budget({}, {[&] { ++num_turns; }, 1e-4, nullptr});
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(budget.spend());
  EXPECT_EQ(num_turns, 0);
  ASSERT_TRUE(budget.checkClock());
  EXPECT_EQ(num_turns, 1);
  const auto begin = std::chrono::steady_clock::now();
  while (num_turns < 4) ASSERT_TRUE(budget.spendAndUnlock());
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::microseconds(200));
}

/// A search reads hundreds of bricks between two places where others get their turn.
TEST(Budget, remembersATurnThatIsDueUntilOthersCanHaveIt) {
  int num_turns = 0;
  Budget budget({}, {[&] { ++num_turns; }, 1e-4, nullptr});
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(budget.spend());
  ASSERT_TRUE(budget.spendAndUnlock());
  EXPECT_EQ(num_turns, 1);
}

TEST(Budget, endsWhenToldTo) {
  std::atomic<bool> is_stopped{false};
  Budget budget({}, {[] {}, 1.0, &is_stopped});
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(budget.spendAndUnlock());
  is_stopped = true;
  int num_spent = 0;
  while (budget.spend()) ++num_spent;
  EXPECT_LE(num_spent, 256);
  EXPECT_EQ(budget.whyEnded(), BudgetLimit::kStopped);
}
}  // namespace
}  // namespace cuboid_mapping
