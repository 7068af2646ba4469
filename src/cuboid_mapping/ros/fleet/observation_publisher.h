// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/GetObservations.h"
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>

namespace cuboid_mapping_ros {

struct ObservationParameters {
  double max_kb_s = 0.0;  ///< Rate limit for each subscriber; 0: none.
  int memory_mb = 0;      ///< For subscribers that missed observations; 0: none is kept.
};

/// The topic observations, with the voxels that each cloud observes, for maps of several robots; and
/// ~get_observations, for subscribers that have missed some.
///
/// All observations are counted. They are encoded only for subscribers, or to be kept. The excess over
/// observation_rate waits, or is left out. Thread-safe.
class ObservationPublisher : public MapFeature {
 public:
  /// The private namespace of the node is the name of the robot.
  explicit ObservationPublisher(const MapHost& host);
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  /// A node that merges robots observes nothing itself.
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return parameters.robots.empty();
  }
  [[nodiscard]] std::string name() const override;
  /// Publishes a cloud.
  void onCloud(const MappedCloud& cloud) override;
  void addStatus(diagnostic_updater::Updater& diagnostics) override;

  /// Figures, and a warning when clouds were left out since the last report.
  void fillStatus(diagnostic_updater::DiagnosticStatusWrapper& status);

 private:
  using Message = Observation::ConstPtr;

  [[nodiscard]] Message makeMessage(const MappedCloud& cloud) const;
  void keep(const Message& message);
  /// Sends messages that are due. @pre mutex_ is held.
  void sendDue();
  void answer(const GetObservations::Request& request, GetObservations::Response& response);

  std::mutex mutex_;  ///< Guards the members below.
  bool is_limited_;   ///< There is a rate.
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
  Timer timer_;
};

}  // namespace cuboid_mapping_ros
