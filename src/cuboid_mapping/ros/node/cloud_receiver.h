// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "cuboid_mapping/ros/mapping/node_sources.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// First half of a cloud's way: receives the messages of all sources, and tf, in a thread. A cloud that has its poses
/// can be taken.
///
/// Thread rule: waitReady() and takeNext() in the mapping thread, report() and addStatus() in that of the diagnostics;
/// the rest from any.
class CloudReceiver {
 public:
  /// @param nh  In the node's namespace. @param guard, ledger  Must outlive this object.
  CloudReceiver(const ros::NodeHandle& nh, const NodeParameters& parameters, CallbackGuard& guard,
                CloudLedger& ledger);

  /// Begins to receive. Clouds only if they make the map, not observations of robots.
  void start();
  /// Ends waitReady(), and the thread.
  void stop();

  /// Waits for a cloud that has its poses. @return false after stop().
  [[nodiscard]] bool waitReady() { return queue_.waitReady(); }
  /// The next such cloud; nothing when there is none now.
  [[nodiscard]] std::optional<PosedCloud> takeNext() { return queue_.takeNext(); }
  /// Whether another cloud waits for its turn.
  [[nodiscard]] bool hasReady() const { return queue_.hasReady(); }
  [[nodiscard]] const TfBuffer& tf() const { return tf_; }
  /// The name of a source in the log: its own, or its topic after remapping.
  [[nodiscard]] std::string sourceName(std::size_t source) const;

  /// Sets parameters that were changed while the node runs. Slices and poses of clouds that were not taken are
  /// looked up again.
  void setParameters(const NodeParameters& parameters);

  /// Adds topics, publishers, and why clouds do not come, to the node's report.
  void report(const CloudLedger::Figures& figures, NodeReport& report);
  /// Adds a status for each source of a list.
  void addStatus(diagnostic_updater::Updater& diagnostics) { sources_.addDiagnostics(diagnostics); }

 private:
  /// What the clouds need, by source.
  struct Needs {
    std::vector<PoseFrames> frames;
    std::vector<SensorSteps> steps;  ///< For findSlices().

    explicit Needs(const NodeParameters& parameters);
  };

  [[nodiscard]] CloudQueue::Callbacks queueCallbacks();
  [[nodiscard]] PoseSearch search(std::size_t source, const std_msgs::Header& header,
                                  const Slices& slices) const;

  GuardedThread thread_;
  ros::NodeHandle nh_;  ///< Callbacks come from the thread.
  bool has_clouds_;
  CloudLedger& ledger_;
  NodeSources sources_;
  mutable std::mutex needs_mutex_;
  Needs needs_;  ///< With the current parameters. Guarded.
  TfBuffer tf_;
  CloudQueue queue_;
  std::optional<TfReceiver> tf_receiver_;
};

}  // namespace cuboid_mapping_ros
