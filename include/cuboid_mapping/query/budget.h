// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>

namespace cuboid_mapping {

/// How much a query may do; by default as much as it takes.
struct QueryLimits {
  double time_s = std::numeric_limits<double>::infinity();  ///< Counts from the construction on.
  /// Bricks of 8 x 8 x 8 voxels, cuboids, and the like, that are looked at; what is kept for the
  /// search counts several times, so that this bounds memory, too.
  std::uint64_t max_bricks = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t max_entries = std::numeric_limits<std::uint64_t>::max();  ///< Limit of the answer.
};

/// Limit that a budget has reached.
enum class BudgetEnd : unsigned char {
  kNone,     ///< It is not spent.
  kTime,     ///< QueryLimits::time_s.
  kBricks,   ///< QueryLimits::max_bricks.
  kEntries,  ///< QueryLimits::max_entries.
  kStopped   ///< MapTurns::is_stopped.
};

/// How others get their turn at a map that a long query reads.
struct MapTurns {
  /// Gives the map away and takes it back, perhaps changed.
  std::function<void()> yield;
  double period_s = std::numeric_limits<double>::infinity();  ///< Time between two calls.
  const std::atomic<bool>* is_stopped = nullptr;              ///< true ends the query.
};

/// Remaining limits of a query. Every query takes one, and ends soon after it is spent;
/// each query documents its answer in that case. A spent budget stays spent.
///
/// It costs a query a subtraction a brick; the clock is read once in some hundred bricks. One budget
/// may serve several queries, one after the other. Not thread-safe.
class Budget {
 public:
  /// Without a limit: never spent.
  Budget() = default;
  /// Its time begins now. @pre turns.yield is set if turns.period_s is finite.
  explicit Budget(const QueryLimits& limits, MapTurns turns = {});

  /// One without a limit, for each thread its own.
  [[nodiscard]] static Budget& unlimited();

  /// Takes bricks off. @return false: the budget is spent, the query has to end.
  [[nodiscard]] bool spend(std::uint64_t bricks = 1) {
    if (bricks < until_look_) {
      until_look_ -= bricks;
      return true;
    }
    return look(bricks);
  }

  /// As spend(), for places where a query holds no reference into the map: now and then others get
  /// their turn here, and the map may be another one afterwards.
  [[nodiscard]] bool spendAndYield(std::uint64_t bricks = 1) {
    if (bricks < until_look_ && !is_yield_due_) {
      until_look_ -= bricks;
      return true;
    }
    return look(bricks) && yieldIfDue();
  }

  /// Takes entries of the answer off, all or none. @return false: fewer are left, and the
  /// budget is spent; spend() goes on, for the work on the entries that there are.
  [[nodiscard]] bool addEntries(std::uint64_t entries = 1) {
    if (entries > entries_left_) end(BudgetEnd::kEntries);
    if (isSpent()) return false;
    entries_left_ -= entries;
    return true;
  }

  /// Looks at the clock now; for loops whose steps are long. Others get their turn as in
  /// spendAndYield(). @return false: spent.
  [[nodiscard]] bool lookNow() { return look(0) && yieldIfDue(); }

  /// Ends it before its limits are reached; one without a limit goes on.
  void end(BudgetEnd why);

  /// Whether a limit was met, or end() has ended it. Does not look at the clock.
  [[nodiscard]] bool isSpent() const { return end_ != BudgetEnd::kNone; }
  /// The limit that ended it; kNone while it is not spent.
  [[nodiscard]] BudgetEnd whyEnded() const { return end_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool look(std::uint64_t bricks);
  bool yieldIfDue();

  std::uint64_t until_look_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t granted_ = until_look_;  ///< Value of until_look_ after the last look.
  std::uint64_t bricks_left_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t entries_left_ = std::numeric_limits<std::uint64_t>::max();
  Clock::time_point deadline_ = Clock::time_point::max();
  Clock::time_point turn_end_ = Clock::time_point::max();
  MapTurns turns_;
  bool is_limited_ = false;
  bool is_yield_due_ = false;
  BudgetEnd end_ = BudgetEnd::kNone;
};

}  // namespace cuboid_mapping
