// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "service_caller.h"

#include "cuboid_mapping/GetLocks.h"

#include <QString>

#include <chrono>
#include <string>

namespace cuboid_mapping_rviz {

/// The locked boxes of a node, requested every 2 s. Thread rule: that of rviz.
class LockWatch {
 public:
  /// Takes an answer, and requests the next one when it is due. To be called often. @param server  Name of the
  /// node.
  /// @return Whether the boxes have changed. Without an answer there are none.
  bool update(const std::string& server);
  /// Makes the next update() request the boxes.
  void askSoon() { last_asked_ = {}; }

  /// Boxes, and their frame.
  [[nodiscard]] const cuboid_mapping::GetLocks::Response& locks() const { return locks_; }
  /// The first boxes, a line each; empty without boxes.
  [[nodiscard]] QString text() const;

 private:
  using Locks = cuboid_mapping::GetLocks::Response;
  using Clock = std::chrono::steady_clock;

  Locks locks_;
  Clock::time_point last_asked_;
  ServiceCaller<Locks> caller_;
};

}  // namespace cuboid_mapping_rviz
