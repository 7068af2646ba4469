// SPDX-License-Identifier: BSD-3-Clause
// Fails every call that can fail, one after the other, and checks the state afterwards.
//
// CUBOID_MAPPING_FAULTS limits the number of repetitions of a trial, evenly spread; 0: no limit.
#pragma once

#include "fault_injection.h"
#include "isolated.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <string>

namespace cuboid_mapping::campaign {

/// Does work with an armed fault. @return Whether an exception has left it.
using Act = std::function<bool(const std::function<void()>& work)>;

/// One trial: sets up, does its work by `act`, and checks the state.
/// @return Description of the error; empty: none.
using Trial = std::function<std::string(const Act& act)>;

/// A fault in a trial, and its outcome.
struct TrialResult {
  std::size_t num_calls = 0;
  bool has_failed = false;
  bool has_thrown = false;
  std::string wrong;
};

/// Runs a trial in its own process.
inline TrialResult tryOnce(FaultKind kind, std::size_t number, FaultDuration duration,
                           const Trial& trial) {
  const std::string said = runIsolated([&] {
    TrialResult result;
    result.wrong = trial([&](const std::function<void()>& work) {
      const FaultScope scope(kind, number, duration);
      try {
        work();
      } catch (const std::exception&) {
        result.has_thrown = true;
      }
      result.has_failed = scope.hasFailed();
      result.num_calls = scope.numCalls();
      return result.has_thrown;
    });
    if (!result.wrong.empty()) result.wrong += ", failed call: " + describeFailedCall();
    std::ostringstream text;
    text << "result " << result.num_calls << ' ' << result.has_failed << ' ' << result.has_thrown
         << ' ' << result.wrong;
    return text.str();
  });
  TrialResult result;
  std::istringstream text(said);
  std::string head;
  if (text >> head >> result.num_calls >> result.has_failed >> result.has_thrown &&
      head == "result") {
    std::getline(text >> std::ws, result.wrong);
  } else {
    result.wrong = said;
    result.has_failed = true;
  }
  return result;
}

/// Maximum number of calls to try.
inline std::size_t maxTrials() {
  const char* text = std::getenv("CUBOID_MAPPING_FAULTS");
  const std::size_t most = text == nullptr ? 12 : std::strtoull(text, nullptr, 10);
  return most == 0 ? std::numeric_limits<std::size_t>::max() : most;
}

/// Fails the first, second, third call of a trial, once and from then on, until none is
/// reached; prints a row for each and expects no error.
/// @param min_trials  Tries as many calls at least, if there are.
/// @return Number of failed calls.
inline std::size_t expectNothingWrong(const std::string& name, FaultKind kind, const Trial& trial,
                                      std::size_t min_trials = 0) {
  (void)test::testSeed();  // Prints it here, and not in every process again.
  constexpr auto kNever = std::numeric_limits<std::size_t>::max();
  const TrialResult plain = tryOnce(kind, kNever, FaultDuration::kOnce, trial);
  EXPECT_EQ(plain.wrong, "") << name << " without a fault";
  const std::size_t step =
      std::max<std::size_t>(1, plain.num_calls / std::max(maxTrials(), min_trials));
  std::size_t num_all = 0;
  for (const FaultDuration duration : {FaultDuration::kOnce, FaultDuration::kLasting}) {
    std::map<std::string, std::size_t> wrong;
    std::size_t num_trials = 0;
    std::size_t num_thrown = 0;
    for (std::size_t number = 0; number < plain.num_calls; number += step) {
      const TrialResult result = tryOnce(kind, number, duration, trial);
      if (!result.wrong.empty()) ++wrong[result.wrong];
      ++num_trials;
      num_thrown += result.has_thrown ? 1 : 0;
    }
    std::cout << name << ", " << toString(kind)
              << (duration == FaultDuration::kOnce ? " fails once: " : " fails from then on: ")
              << num_trials << " of " << plain.num_calls << " calls, " << num_thrown
              << " exceptions, " << wrong.size() << " kinds of wrong results" << std::endl;
    for (const auto& [what, count] : wrong) {
      ADD_FAILURE() << name << ": " << count << " times: " << what;
    }
    num_all += num_trials;
  }
  return num_all;
}

}  // namespace cuboid_mapping::campaign
