// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "service_caller.h"

#include "cuboid_mapping/GetLocks.h"

#include <QString>

#include <chrono>
#include <string>

namespace cuboid_mapping_rviz {

/// The locked boxes of a node, asked for every 2 s. Thread rule: that of rviz.
class LockWatch {
 public:
  /// Takes an answer, and asks again in time. To be called often. @param server  Name of the node.
  /// @return Whether the boxes have changed; there are none while nobody answers.
  bool update(const std::string& server);
  /// The next update() asks.
  void askSoon() { last_asked_ = {}; }

  /// Boxes, and their frame.
  [[nodiscard]] const cuboid_mapping::GetLocks::Response& locks() const { return locks_; }
  /// The first ones, line by line; empty when there are none.
  [[nodiscard]] QString text() const;

 private:
  using Locks = cuboid_mapping::GetLocks::Response;
  using Clock = std::chrono::steady_clock;

  Locks locks_;
  Clock::time_point last_asked_;
  ServiceCaller<Locks> caller_;
};

}  // namespace cuboid_mapping_rviz
