// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/rate_limit.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;

TEST(ByteBudget, KeepsTheRateInAnyTime) {
  constexpr double kRate = 1000.0;
  constexpr int kMaxMessage = 3000;
  for (std::size_t i = 0; i < 20; ++i) {
    Random random(i);
    ByteBudget budget(kRate);
    std::vector<std::pair<double, double>> sent{{0.0, 0.0}};  // Times, and bytes up to then.
    double now_s = 1e5;
    while (sent.size() < 200) {
      now_s += random.chance(0.02) ? 10.0 : random.real(0.0, 0.3);
      if (!budget.isFree(now_s)) continue;
      const int num_bytes = random.integer(1, kMaxMessage);
      budget.spend(static_cast<std::size_t>(num_bytes));
      sent.emplace_back(now_s, sent.back().second + num_bytes);
    }
    for (std::size_t from = 1; from < sent.size(); ++from) {
      for (std::size_t to = from; to < sent.size(); ++to) {
        const double time_s = sent[to].first - sent[from].first;
        EXPECT_LE(sent[to].second - sent[from - 1].second, kRate * (time_s + 1.0) + kMaxMessage)
            << seedNote(i);
      }
    }
    // The budget is also used up: there is always more to send, except for some pauses.
    EXPECT_GT(sent.back().second, 0.4 * kRate * (now_s - 1e5)) << seedNote(i);
  }
}

TEST(ByteBudget, IsFreeWithoutARate) {
  ByteBudget budget(0.0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(budget.isFree(5.0));
    budget.spend(1000000);
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
