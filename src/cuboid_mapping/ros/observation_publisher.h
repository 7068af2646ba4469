// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/parameters.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <Eigen/Core>

#include <cstdint>

namespace cuboid_mapping_ros {

/// The topic observations: what each cloud says about the map, for maps of several robots.
///
/// Clouds are counted in any case; bytes are made while somebody listens.
/// Thread rule: all calls one after the other.
class ObservationPublisher {
 public:
  /// @param private_nh  Its namespace is the name of the robot.
  ObservationPublisher(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                       const NodeParameters& parameters);

  /// Tells of a cloud that is in the map.
  /// @param origin_map  Where its beams start. @param model  That it was put into the map with.
  void publish(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
               const cuboid_mapping::SensorModelConfig& model,
               const cuboid_mapping::ScanUpdate& update);

 private:
  cuboid_mapping::Observation next_;  ///< With what all have in common; without data.
  ros::Publisher publisher_;
};

}  // namespace cuboid_mapping_ros
