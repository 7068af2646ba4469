// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <string>

namespace cuboid_mapping_ros {

/// A cloud for the map, in the form that the history keeps.
struct KeptObservation {
  KeptCloud cloud;
  ObservationConfig config;
};

/// The history of a map. If it fails, for example on a full disk, the map goes on without it: the history is
/// lost until the whole map is replaced, since missed changes cannot be corrected. Thread-safe.
class KeptHistory {
 public:
  /// See MapHistory.
  KeptHistory(const MapConfig& config, double step_m, const HistoryLimits& limits)
      : history_(config, step_m, limits) {}

  /// Makes it whole again, see MapHistory::restart().
  void restart(const CuboidMap& map) noexcept;
  /// Changes it, unless it is lost. Exceptions lose it. @param work  (MapHistory&).
  template <typename WorkT>
  void change(const WorkT& work) noexcept {
    if (is_lost_) return;
    try {
      work(history_);
    } catch (const std::exception& exception) {
      lose(exception.what());
    }
  }

  [[nodiscard]] std::uint64_t numAdded() const { return history_.numAdded(); }
  /// Reason why it is lost; empty: it is whole.
  [[nodiscard]] std::string error() const;

  /// @throws std::runtime_error  if it is lost.
  [[nodiscard]] MapHistory& whole();
  [[nodiscard]] HistoryFigures figures() const { return history_.figures(); }

 private:
  void lose(const std::string& why) noexcept;

  MapHistory history_;
  std::atomic<bool> is_lost_{false};
  mutable std::mutex error_mutex_;
  std::string error_;
};

}  // namespace cuboid_mapping_ros
