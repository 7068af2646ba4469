// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/progress_listener.h"

#include <cstdint>

namespace cuboid_mapping {

/// Counts the steps of some work, and reports the start, the last and every 1024th to a listener.
class ProgressCounter {
 public:
  /// @param listener  Must outlive the counter. @param total  Steps; with 0 nothing is reported.
  ProgressCounter(const ProgressListener& listener, std::uint64_t total)
      : listener_(listener), total_(total) {
    if (total_ > 0) tell();
  }

  /// Counts one more step.
  void advance() {
    if (++done_ % kStepsBetween == 0 || done_ == total_) tell();
  }

 private:
  static constexpr std::uint64_t kStepsBetween = 1024;

  void tell() const {
    if (listener_) listener_(done_, total_);
  }

  const ProgressListener& listener_;
  std::uint64_t total_;
  std::uint64_t done_ = 0;
};

}  // namespace cuboid_mapping
