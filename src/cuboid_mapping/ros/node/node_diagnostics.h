// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <cstdint>
#include <functional>

namespace cuboid_mapping_ros {

/// The node's report in /diagnostics, and its warning that nobody publishes clouds. Works in the queue of the node
/// handle, which must have one thread.
class NodeDiagnostics {
 public:
  /// Adds the facts of others to a report that has those of the map and of the ledger.
  using AddTo = std::function<void(const CloudLedger::Figures& figures, NodeReport& report)>;

  /// @param guard, ledger, map  Must outlive this object.
  NodeDiagnostics(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                  const CallbackGuard& guard, const CloudLedger& ledger, const GuardedMap& map,
                  AddTo add_others);

  /// For statuses beside that of the node; before start().
  [[nodiscard]] diagnostic_updater::Updater& updater() { return updater_; }
  void start(const ros::NodeHandle& nh);

 private:
  [[nodiscard]] NodeReport makeReport(const CloudLedger::Figures& figures);
  void report(diagnostic_updater::DiagnosticStatusWrapper& status);
  /// Logs once that nobody publishes clouds, after kMaxSilence_s.
  void warnOfSilence(const NodeReport& report);

  const CallbackGuard& guard_;
  const CloudLedger& ledger_;
  const GuardedMap& map_;
  AddTo add_others_;
  MapWatch map_watch_;
  // Of the last report.
  NodeStatistics statistics_;
  std::uint64_t num_failures_ = 0;
  bool has_warned_of_silence_ = false;
  diagnostic_updater::Updater updater_;
  Timer timer_;
};

}  // namespace cuboid_mapping_ros
