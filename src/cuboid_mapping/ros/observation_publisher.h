// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/GetObservations.h"
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/parameters.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <deque>

namespace cuboid_mapping_ros {

/// The topic observations: what each cloud says about the map, for maps of several robots; and
/// ~get_observations, for those who have missed some.
///
/// Clouds are counted in any case; bytes are made while somebody listens, or they are to be
/// kept. Thread rule: all calls, and the callbacks of the private handle, one after the other.
class ObservationPublisher {
 public:
  /// @param private_nh  Its namespace is the name of the robot.
  ObservationPublisher(ros::NodeHandle nh, ros::NodeHandle private_nh,
                       const NodeParameters& parameters);
  ObservationPublisher(const ObservationPublisher&) = delete;
  ObservationPublisher& operator=(const ObservationPublisher&) = delete;

  /// Tells of a cloud that is in the map.
  /// @param origin_map  Where its beams start. @param model  That it was put into the map with.
  void publish(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
               const cuboid_mapping::SensorModelConfig& model,
               const cuboid_mapping::ScanUpdate& update);

 private:
  void keep(const cuboid_mapping::Observation::ConstPtr& message);
  void answer(const cuboid_mapping::GetObservations::Request& request,
              cuboid_mapping::GetObservations::Response& response) const;

  std::size_t max_kept_bytes_;
  std::deque<cuboid_mapping::Observation::ConstPtr> kept_;  ///< By sequence, without gaps.
  std::size_t num_kept_bytes_ = 0;
  cuboid_mapping::Observation next_;  ///< With what all have in common; without data.
  ros::Publisher publisher_;
  ros::ServiceServer server_;
};

}  // namespace cuboid_mapping_ros
