// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});  // Seconds.
//     const auto ray = castRay(map, {1, 1, 0.5}, {1, 0, 0}, 30.0, UnknownPolicy::kFree, budget);
//     if (ray.isFound()) std::cout << ray->distance_m << " m\n";
//     if (ray.status == AnswerStatus::kInvalid) std::cout << "wrong: " << ray.fault << '\n';
//     if (ray.status == AnswerStatus::kBudgetSpent) std::cout << "not known after 10 ms\n";
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// How a query ended.
enum class AnswerStatus : unsigned char {
  kFound,        ///< There is what the query looks for.
  kNotFound,     ///< There is none: the query has looked everywhere.
  kInvalid,      ///< The question is wrong: Answer::fault says why, and what to do.
  kBudgetSpent,  ///< The budget was spent before the query knew.
};

/// Answer of a query.
///
/// There is no conversion to bool, because it would be mistaken: findCorridor() looks for a way, checkPath() for
/// an obstacle.
template <typename T>
struct [[nodiscard]] Answer {
  AnswerStatus status = AnswerStatus::kInvalid;  ///< How the query ended.
  /// What was found. After another status than kFound it is as made, or as the query documents.
  T value = T();
  std::string fault;  ///< Reason of kInvalid, and the cure; else empty.

  Answer() = default;
  /// kFound.
  Answer(T found)  // NOLINT(google-explicit-constructor): queries return values.
      : status(AnswerStatus::kFound), value(std::move(found)) {}
  /// Another status than kFound.
  Answer(AnswerStatus why, T so_far = T())  // NOLINT(google-explicit-constructor)
      : status(why), value(std::move(so_far)) {}
  /// kInvalid.
  // NOLINTNEXTLINE(performance-unnecessary-value-param): it is moved.
  static Answer invalid(std::string fault) {
    Answer answer;
    answer.fault = std::move(fault);
    return answer;
  }

  /// Whether the status is kFound.
  [[nodiscard]] bool isFound() const { return status == AnswerStatus::kFound; }
  /// Whether the status is kNotFound: a path that checkPath() has checked, and that is free, for instance.
  [[nodiscard]] bool isNotFound() const { return status == AnswerStatus::kNotFound; }

  /// The value. @pre isFound().
  ///@{
  const T& operator*() const {
    assert(isFound());
    return value;
  }
  const T* operator->() const {
    assert(isFound());
    return &value;
  }
  ///@}
  /// The value of kFound, else another one.
  [[nodiscard]] T valueOr(T other) const { return isFound() ? value : std::move(other); }
};

/// Answer of a query for all of some kind. @param is_complete  Else kBudgetSpent, with some of them.
template <typename T>
Answer<std::vector<T>> answerWithAll(std::vector<T> found, bool is_complete) {
  const AnswerStatus status = !is_complete    ? AnswerStatus::kBudgetSpent
                              : found.empty() ? AnswerStatus::kNotFound
                                              : AnswerStatus::kFound;
  return {status, std::move(found)};
}

}  // namespace cuboid_mapping
