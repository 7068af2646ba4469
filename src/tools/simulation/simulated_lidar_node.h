// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/simulated_drive.h"

#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Parameters of the node simulated_lidar.
struct SimulatedLidarParameters {
  /// ~seed ~rings ~columns ~min_elevation ~max_elevation ~noise ~max_range ~cloud_rate ~duration ~robot ~door
  /// ~head_start
  DriveConfig drive;
  bool publish_clock = false;  ///< ~publish_clock: the node is the source of ROS time.
  double rate = 1.0;           ///< ~rate: seconds of ROS time per second; needs ~publish_clock.
  /// ~follow_path: follows the nav_msgs/Path on `path`, not its own path.
  bool follow_path = false;
  double speed = 1.0;  ///< ~speed: metres per second of ROS time; needs ~follow_path.
};

/// Reads the private parameters.
///
/// @param[out] errors  A line for each parameter that is unknown, of the wrong type or out of range.
[[nodiscard]] SimulatedLidarParameters loadParameters(const ros::NodeHandle& private_node,
                                                      std::vector<std::string>& errors);

/// Publishes `cloud`, tf, and with publish_clock the clock, until the duration is over or ROS shuts down.
///
/// Cases:
///   - with publish_clock, stamps begin at kFirstStamp. No cloud is left out: on a slow machine, time goes
///     slower. Laps do not reset the time;
///   - else the clouds have stamps of ROS time from now on, and a slow machine leaves clouds out;
///   - with follow_path, the robot waits at its start for a path in the frame `map`, and follows the latest
///     one from then on. An empty one stops it; paths in other frames are ignored with a warning.
void runSimulatedLidar(ros::NodeHandle& node, const SimulatedLidarParameters& parameters);

}  // namespace cuboid_mapping_ros
