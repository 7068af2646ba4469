// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/budget.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Bricks between two readings of the clock, each of which takes the time of one or two bricks.
constexpr std::uint64_t kBricksPerLook = 256;
/// Longer times count as no limit: the clock cannot represent all of them.
constexpr double kForever_s = 1e9;

std::chrono::steady_clock::time_point after(double time_s) {
  using Clock = std::chrono::steady_clock;
  if (std::isnan(time_s)) {
    throw std::invalid_argument("a time of a budget is NaN: give seconds; infinity is no limit");
  }
  if (time_s >= kForever_s) return Clock::time_point::max();
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double>(std::max(time_s, 0.0)));
}

}  // namespace

Budget::Budget(const QueryLimits& limits, MapUnlock unlock)
    : bricks_left_(limits.max_bricks),
      entries_left_(limits.max_entries),
      deadline_(after(limits.time_s)),
      turn_end_(after(unlock.period_s)),
      unlock_(std::move(unlock)),
      is_limited_(true) {
  until_look_ = granted_ = std::min(kBricksPerLook, bricks_left_);
}

Budget& Budget::unlimited() {
  static auto& budget = *new Budget;  // Static objects may need it at the end of the program, too.
  return budget;
}

void Budget::end(BudgetLimit why) {
  if (!is_limited_ || (isSpent() && end_ != BudgetLimit::kEntries)) return;
  end_ = why;
  if (why != BudgetLimit::kEntries) until_look_ = 0;
}

bool Budget::look(std::uint64_t bricks) {
  if (isSpent() && end_ != BudgetLimit::kEntries) return false;
  bricks_left_ -= granted_ - until_look_;
  granted_ = until_look_ = 0;  // Counted.
  if (bricks > bricks_left_) end(BudgetLimit::kBricks);
  if (unlock_.is_stopped != nullptr && *unlock_.is_stopped) end(BudgetLimit::kStopped);
  const Clock::time_point now = Clock::now();
  if (now >= deadline_) end(BudgetLimit::kTime);
  if (isSpent() && end_ != BudgetLimit::kEntries) return false;
  is_yield_due_ = is_yield_due_ || now >= turn_end_;
  bricks_left_ -= bricks;
  until_look_ = granted_ = std::min(kBricksPerLook, bricks_left_);
  return true;
}

bool Budget::yieldIfDue() {
  if (!is_yield_due_) return true;
  is_yield_due_ = false;
  unlock_.yield();
  turn_end_ = after(unlock_.period_s);
  return true;
}

}  // namespace cuboid_mapping
