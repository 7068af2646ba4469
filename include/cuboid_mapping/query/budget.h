// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});  // All queries that it is given to end after 10 ms.
//     const Eigen::Vector3d size_m(0.4, 0.4, 0.4);
//     const auto stop = UnknownPolicy::kObstacle;
//     const bool is_free = isPathFree(map, {{0.5, 1, 0.5}, {1.5, 1, 0.5}}, size_m, stop, budget);
//     if (!is_free && budget.isSpent()) std::cout << "not known after 10 ms\n";
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>

namespace cuboid_mapping {

/// Limits of a query; none by default.
struct QueryLimits {
  /// From the budget's construction on; a time <= 0 is over at the first look at the clock.
  double time_s = std::numeric_limits<double>::infinity();
  /// Bricks of 8 x 8 x 8 voxels, cuboids and similar items that the query reads. Items that a search keeps
  /// count several times, so that this limits memory, too.
  std::uint64_t max_bricks = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t max_entries = std::numeric_limits<std::uint64_t>::max();  ///< Limit of the answer.
};

/// Limit that a budget has reached.
enum class BudgetLimit : unsigned char {
  kNone,     ///< It is not spent.
  kTime,     ///< QueryLimits::time_s.
  kBricks,   ///< QueryLimits::max_bricks.
  kEntries,  ///< QueryLimits::max_entries.
  kStopped   ///< MapUnlock::is_stopped.
};

/// Lets a long query release the lock of the map that it reads now and then, so that others may change the map.
/// Boxes and ways of an answer are of one revision even then; a check of a path, a motion, rays or distances takes each
/// brick as it is when it gets there.
struct MapUnlock {
  /// Releases the map and takes it back, perhaps changed.
  std::function<void()> yield;
  double period_s = std::numeric_limits<double>::infinity();  ///< Time between two calls.
  const std::atomic<bool>* is_stopped = nullptr;              ///< true ends the query.
};

/// Remaining limits of a query. Queries that take one end soon after it is spent: the answer has the status
/// kBudgetSpent, and its value is what the query says. A spent budget stays spent.
///
/// It costs a subtraction for each brick; the clock is read once in 256 bricks. One budget may serve several
/// queries, one after the other. Not thread-safe, but for one without a limit: that is never written.
class Budget {
 public:
  /// Without a limit: never spent.
  Budget() = default;
  /// Its time begins now. @pre unlock.yield is set if unlock.period_s is finite.
  /// @throws std::invalid_argument  A time is NaN.
  explicit Budget(const QueryLimits& limits, MapUnlock unlock = {});

  /// A budget without a limit, for all threads.
  [[nodiscard]] static Budget& unlimited();

  /// Deducts bricks. @return false: the budget is spent, and the query has to end.
  [[nodiscard]] bool spend(std::uint64_t bricks = 1) {
    if (!is_limited_) return true;
    if (bricks < until_look_) {
      until_look_ -= bricks;
      return true;
    }
    return look(bricks);
  }

  /// As spend(), for places where a query holds no reference into the map: others may get their turn, and the
  /// map may have changed afterwards.
  [[nodiscard]] bool spendAndUnlock(std::uint64_t bricks = 1) {
    if (!is_limited_) return true;
    if (bricks < until_look_ && !is_yield_due_) {
      until_look_ -= bricks;
      return true;
    }
    return look(bricks) && yieldIfDue();
  }

  /// Deducts entries of the answer, all or none. @return false: fewer are left, and the budget is spent.
  /// spend() then still succeeds, so that the query can finish the entries that it has.
  [[nodiscard]] bool addEntries(std::uint64_t entries = 1) {
    if (!is_limited_) return true;
    if (entries > entries_left_) end(BudgetLimit::kEntries);
    if (isSpent()) return false;
    entries_left_ -= entries;
    return true;
  }

  /// Reads the clock now, for loops with long steps. Others get their turn as in spendAndUnlock().
  /// @return false: the budget is spent.
  [[nodiscard]] bool checkClock() { return !is_limited_ || (look(0) && yieldIfDue()); }

  /// Ends the budget before its limits are reached; does nothing to one without limits.
  void end(BudgetLimit why);

  /// Whether a limit was reached, or end() was called. Does not read the clock.
  [[nodiscard]] bool isSpent() const { return end_ != BudgetLimit::kNone; }
  /// The reached limit; kNone while the budget is not spent.
  [[nodiscard]] BudgetLimit whyEnded() const { return end_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool look(std::uint64_t bricks);
  bool yieldIfDue();

  std::uint64_t until_look_ = 0;
  std::uint64_t granted_ = 0;  ///< Value of until_look_ after the last look.
  std::uint64_t bricks_left_ = 0;
  std::uint64_t entries_left_ = 0;
  Clock::time_point deadline_ = Clock::time_point::max();
  Clock::time_point turn_end_ = Clock::time_point::max();
  MapUnlock unlock_;
  bool is_limited_ = false;
  bool is_yield_due_ = false;
  BudgetLimit end_ = BudgetLimit::kNone;
};

}  // namespace cuboid_mapping
