// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/service_calls.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/sharing/observation_order.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

/// An observation, or the reason why it cannot be put into a map: it is damaged, or has another frame or
/// resolution.
[[nodiscard]] std::variant<RobotObservation, std::string> readObservation(
    const Observation& message, const NodeParameters& parameters);

[[nodiscard]] ros::Time stampOf(const RobotObservation& observation);

struct MergeParameters {
  double delay_s = 3.0;  ///< Wait for observations before they go into the map.
};

/// Builds a map from the observations of several robots, in the order of the stamps; see ObservationOrder. Asks
/// robots for lost observations.
///
/// Thread rule: the callbacks of both node handles may run side by side. report() and fillStatus() belong to the
/// thread of the diagnostics; stopAsking() is thread-safe.
class RobotMerger {
 public:
  struct Callbacks {
    std::function<bool()> is_paused;  ///< Observations due during a pause are left out.
    /// Called for each observation that has entered the map, or was left out.
    std::function<void(const RobotObservation&, bool is_in_map)> note;
  };

  /// @param nh  Handle of the thread that changes the map. @param asking_nh  Handle of threads that may wait
  /// for robots, one more than there are robots, so that a silent robot blocks no other. @param map  Must
  /// outlive this object. Continues from GuardedMap::progress(), which is the merger's from now on.
  /// @throws std::runtime_error  if that progress is invalid.
  RobotMerger(const ros::NodeHandle& nh, const ros::NodeHandle& asking_nh,
              const NodeParameters& parameters, GuardedMap& map, Callbacks callbacks);
  ~RobotMerger();
  RobotMerger(const RobotMerger&) = delete;
  RobotMerger& operator=(const RobotMerger&) = delete;

  /// Ends running questions, and asks no more: call it before the threads of asking_nh are stopped.
  void stopAsking() { calls_.stop(); }

  /// Adds its topics, such as "/robot1/observations /robot2/observations", and their publishers.
  void report(NodeReport& report) const;
  /// Figures, and a warning if a robot is not there, or observations are missing, came too late, or were refused since
  /// the last report.
  void fillStatus(diagnostic_updater::DiagnosticStatusWrapper& status);

 private:
  /// An observation that cannot be merged.
  struct Refusal {
    std::string text;  ///< Of the last one; empty: it has been reported.
    double log_again_s = 0.0;
  };

  void take(const std::string& robot, const Observation& message);
  void applyDue();
  void apply(const RobotObservation& observation);
  [[nodiscard]] std::string progress();
  void noteApplied(const RobotObservation& observation);
  void ask();
  void askFor(const ObservationQuestion& question);

  ros::NodeHandle asking_nh_;
  NodeParameters parameters_;
  GuardedMap& map_;
  Callbacks callbacks_;
  ServiceCalls calls_;
  std::mutex mutex_;  ///< Guards order_ to refusals_.
  ObservationOrder order_;
  std::set<std::string> asked_;  ///< Robots that have not answered yet.
  std::uint64_t num_refused_ = 0;
  std::uint64_t num_failed_ = 0;             ///< Observations kept out by an exception.
  std::uint64_t num_asked_for_ = 0;          ///< Observations that came as answers.
  std::map<std::string, Refusal> refusals_;  ///< By the robot.

  MergeCounts reported_;
  std::vector<ros::Subscriber> subscribers_;
  Timer apply_timer_;
  Timer ask_timer_;
};

}  // namespace cuboid_mapping_ros
