// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// Thrown when the caller of a long call has cancelled it.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled: everything is as it was") {}
};

/// Reports the progress of a long call to its caller, and ends the call when the caller cancels it.
class CallProgress {
 public:
  /// Gets a stage and the share of it that is done, 0 to 1. @throws Cancelled  to end the call.
  using Listener = std::function<void(const std::string& stage, double share)>;

  /// Progress of a call that nobody watches or cancels.
  CallProgress() = default;
  explicit CallProgress(Listener listener) : listener_(std::move(listener)) {}

  /// Begins a stage. @return Listener of its steps; copies ours. @throws Cancelled, as does the result.
  [[nodiscard]] ProgressListener stage(const std::string& name) const {
    if (!listener_) return {};
    listener_(name, 0.0);
    return [listener = listener_, name](std::uint64_t done, std::uint64_t total) {
      listener(name, static_cast<double>(done) / static_cast<double>(total));
    };
  }

 private:
  Listener listener_;
};

}  // namespace cuboid_mapping_ros
