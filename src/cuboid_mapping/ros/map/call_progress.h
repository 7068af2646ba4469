// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// Ends a long call when the node ends.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled, because the node ends: everything is as it was") {}
};

/// Reports the progress of a long call, and can end it.
class CallProgress {
 public:
  /// Gets a stage and the share of it that is done, 0 to 1. @throws Cancelled  to end the call.
  using Listener = std::function<void(const std::string& stage, double share)>;

  /// Progress of a call that nobody watches or ends.
  CallProgress() = default;
  explicit CallProgress(Listener listener) : listener_(std::move(listener)) {}
  /// Ends the call once a flag is set. @param is_stopping  Must outlive the call.
  explicit CallProgress(const std::atomic<bool>& is_stopping)
      : CallProgress([&is_stopping](const std::string& /*stage*/, double /*share*/) {
          if (is_stopping) throw Cancelled();
        }) {}

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
