// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/map_history.h"

#include <atomic>
#include <mutex>
#include <string>

namespace cuboid_mapping_ros {

/// A cloud for the map, in the form that the history keeps.
struct KeptObservation {
  cuboid_mapping::KeptCloud cloud;
  cuboid_mapping::ObservationConfig config;
};

/// The history of a map, which may fail, for example on a full disk, while the map goes on: missed changes cannot be corrected, so
/// the history is lost until the whole map is replaced. Thread-safe.
class KeptHistory {
 public:
  /// See MapHistory.
  KeptHistory(const cuboid_mapping::MapConfig& config, double step_m,
              const cuboid_mapping::HistoryLimits& limits)
      : history_(config, step_m, limits) {}

  // As in MapHistory, but these throw nothing.
  ///@{
  void restart(const cuboid_mapping::CuboidMap& map) noexcept;
  void add(const KeptObservation& observation) noexcept;
  void addEdit(const cuboid_mapping::CellBox& box, const cuboid_mapping::CuboidMap& map,
               const cuboid_mapping::CellBox& whole = {}) noexcept;
  ///@}

  /// Reason why it is lost; empty: it is whole.
  [[nodiscard]] std::string error() const;

  /// @throws std::runtime_error  if it is lost.
  [[nodiscard]] cuboid_mapping::MapHistory& whole();
  [[nodiscard]] cuboid_mapping::HistoryFigures figures() const { return history_.figures(); }

 private:
  template <typename WorkT>
  void guard(const WorkT& work) noexcept;
  void lose(const std::string& why) noexcept;

  cuboid_mapping::MapHistory history_;
  std::atomic<bool> is_lost_{false};
  mutable std::mutex error_mutex_;
  std::string error_;
};

}  // namespace cuboid_mapping_ros
