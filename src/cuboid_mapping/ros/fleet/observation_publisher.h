// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/GetObservations.h"
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/wall_timer.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>

namespace cuboid_mapping_ros {

/// The topic observations, with the voxels that each cloud observes, for maps of several robots; and
/// ~get_observations, for subscribers that have missed some.
///
/// All observations are counted. They are encoded only for subscribers, or to be kept. The excess over
/// observation_rate waits, or is left out. Thread-safe.
class ObservationPublisher {
 public:
  /// @param private_nh  Its namespace is the name of the robot.
  ObservationPublisher(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                       const NodeParameters& parameters);
  ObservationPublisher(const ObservationPublisher&) = delete;
  ObservationPublisher& operator=(const ObservationPublisher&) = delete;

  /// Publishes a cloud that is in the map.
  /// @param origin_map  Start of its beams. @param model  Sensor model of the cloud.
  void publish(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
               const SensorModelConfig& model, const ScanUpdate& update);

  /// Figures, and a warning when clouds were left out since the last report.
  void report(diagnostic_updater::DiagnosticStatusWrapper& status);

 private:
  using Message = Observation::ConstPtr;

  [[nodiscard]] Message makeMessage(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
                                    const SensorModelConfig& model, const ScanUpdate& update) const;
  void keep(const Message& message);
  /// Sends messages that are due. @pre mutex_ is held.
  void sendDue();
  void answer(const GetObservations::Request& request, GetObservations::Response& response);

  std::mutex mutex_;  ///< Guards the members below.
  bool leaves_out_;   ///< Drops the excess; else the excess waits.
  ByteBudget budget_;
  std::size_t max_kept_bytes_;
  std::deque<Message> kept_;  ///< Kept messages by sequence; those beyond the memory are missing.
  std::size_t num_kept_bytes_ = 0;
  std::deque<Message> waiting_;  ///< Messages by sequence.
  Observation last_;             ///< Common fields of all observations, without data.
  std::uint64_t num_sent_ = 0;
  std::uint64_t num_sent_bytes_ = 0;
  std::uint64_t num_overtaken_ = 0;  ///< Observations that gave up waiting.
  std::uint64_t num_reported_losses_ = 0;
  ros::Publisher publisher_;
  ros::ServiceServer server_;
  ros::WallTimer timer_;
};

}  // namespace cuboid_mapping_ros
