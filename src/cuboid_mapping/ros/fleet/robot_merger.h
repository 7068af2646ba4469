// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/service_calls.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/sharing/observation_order.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

/// An observation, or why it cannot be put into a map: it is damaged, or of a map of another frame or resolution.
[[nodiscard]] std::variant<cuboid_mapping::RobotObservation, std::string> readObservation(
    const cuboid_mapping::Observation& message, const NodeParameters& parameters);

[[nodiscard]] ros::Time stampOf(const cuboid_mapping::RobotObservation& observation);

/// Makes a map of what several robots say, in the order of the stamps; see ObservationOrder. Asks robots for
/// what was lost on the way.
///
/// Thread rule: the callbacks of both node handles may run side by side; all other calls in the
/// thread of the first.
class RobotMerger {
 public:
  struct Callbacks {
    std::function<bool()> is_paused;  ///< Observations due during a pause are left out.
    /// One has gone into the map, or was left out.
    std::function<void(const cuboid_mapping::RobotObservation&, bool is_in_map)> note;
  };

  /// @param nh  Of the thread that changes the map. @param asking_nh  Of threads that may wait for robots, one more
  /// than there are robots: one that is silent then keeps nobody from asking the others. @param map  Must outlive
  /// this object. Goes on where GuardedMap::progress() says that it is.
  /// @throws std::runtime_error  when it says something else.
  RobotMerger(const ros::NodeHandle& nh, const ros::NodeHandle& asking_nh,
              const NodeParameters& parameters, GuardedMap& map, Callbacks callbacks);
  ~RobotMerger();
  RobotMerger(const RobotMerger&) = delete;
  RobotMerger& operator=(const RobotMerger&) = delete;

  /// Ends the questions under way, and asks no more: before the threads of asking_nh are stopped.
  void stopAsking() { calls_.stop(); }

  /// "/robot1/observations /robot2/observations".
  [[nodiscard]] std::string topics() const;
  [[nodiscard]] std::size_t numPublishers() const;

  /// Figures, and a warning when observations are missing, came too late, or were refused since the last report.
  void report(diagnostic_updater::DiagnosticStatusWrapper& status);

 private:
  void take(const cuboid_mapping::Observation& message);
  void applyDue();
  void apply(const cuboid_mapping::RobotObservation& observation);
  std::string noteApplied(const cuboid_mapping::RobotObservation& observation);
  void ask();
  void askFor(const cuboid_mapping::ObservationQuestion& question);

  ros::NodeHandle nh_;
  ros::NodeHandle asking_nh_;
  NodeParameters parameters_;
  GuardedMap& map_;
  Callbacks callbacks_;
  ServiceCalls calls_;
  std::mutex mutex_;  ///< Guards order_ to last_refusal_.
  cuboid_mapping::ObservationOrder order_;
  std::set<std::string> asked_;  ///< Robots that have not answered yet.
  std::uint64_t num_refused_ = 0;
  std::uint64_t num_failed_ = 0;     ///< Could not be put into the map, for want of memory.
  std::uint64_t num_asked_for_ = 0;  ///< Came as answers.
  std::string last_refusal_;

  cuboid_mapping::MergeCounts reported_;
  std::uint64_t num_reported_refused_ = 0;
  std::vector<ros::Subscriber> subscribers_;
  ros::WallTimer apply_timer_;
  ros::WallTimer ask_timer_;
};

}  // namespace cuboid_mapping_ros
