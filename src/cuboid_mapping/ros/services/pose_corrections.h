// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/CorrectPoses.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// A history that starts from the current map, in memory and on disk. @throws As takeWholeSnapshot().
[[nodiscard]] std::unique_ptr<KeptHistory> makeHistory(const NodeParameters& parameters,
                                                       GuardedMap& map);

/// ~correct_poses, and the topic corrected_path: rebuilds the map with corrected poses.
///
/// Thread rule: one correction after the other, in its own thread; clouds, queries and edits go on beside it.
/// Of the paths that arrive meanwhile, the last one counts.
class PoseCorrections {
 public:
  /// @param map, guard  Must outlive this object; the map has a history. @param done  Called after each
  ///                    correction.
  PoseCorrections(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                  const NodeParameters& parameters, GuardedMap& map, CallbackGuard& guard,
                  std::function<void()> done);
  /// Ends the running correction.
  ~PoseCorrections();
  PoseCorrections(const PoseCorrections&) = delete;
  PoseCorrections& operator=(const PoseCorrections&) = delete;

 private:
  void answer(const CorrectPoses::Request& request, CorrectPoses::Response& response);
  void onPath(const nav_msgs::Path& path);
  /// Checks a path, and corrects unless it moves no cloud by more than a distance. Throws nothing, but logs.
  void correct(const nav_msgs::Path& path, const CorrectionRule& rule,
               std::optional<double> ignored_shift_m, CorrectPoses::Response& response);
  void correctMap(const PoseTrack& poses, const CorrectionRule& rule,
                  CorrectPoses::Response& response);
  [[nodiscard]] PoseTrack readPath(const nav_msgs::Path& path) const;

  GuardedMap& map_;
  std::string frame_id_;
  double tolerance_m_;
  std::function<void()> done_;
  std::atomic<bool> is_stopping_{false};
  GuardedThread thread_;
  ros::ServiceServer server_;
  ros::Subscriber subscriber_;
};

}  // namespace cuboid_mapping_ros
