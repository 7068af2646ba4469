// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_pipeline.h"
#include "cuboid_mapping/ros/conversions/sensor_message.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"

#include <ros/callback_queue_interface.h>
#include <ros/duration.h>
#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// What tf says of a cloud.
struct PoseSearch {
  std::optional<CloudPoses> poses;  ///< Found.
  std::string why;                  ///< If not: what is missing, with the frames.
  bool is_too_old = false;          ///< If not: tf has forgotten that time already.
};

/// How many clouds may wait, and how long.
struct CloudLimits {
  std::size_t max_clouds = 10;        ///< > 0; of those that wait for tf, and for their turn.
  std::size_t max_bytes = 256000000;  ///< Of all. One cloud may wait, whatever its size.
  ros::Duration max_wait{10.0};       ///< For tf.
  std::size_t num_sources = 1;        ///< > 0.
  double order_wait_s = 0.2;          ///< For earlier clouds of other sources, in wall time.
};

/// Seconds of std::chrono::steady_clock.
[[nodiscard]] double steadySeconds();

/// Clouds that wait for tf, and then for their turn on a callback queue. A cloud is a message of any
/// source.
///
/// Each cloud knows why it waits. tf is asked when the cloud comes and with every update(); the poses
/// that it gave go with the cloud, whatever tf forgets before its turn. Of one source, clouds whose poses
/// are there pass others, and go in the order in which they came.
///
/// Clouds of several sources go in the order of (stamp, source): each has to wait until every other source
/// has sent one that is not earlier, and until tf has the poses of those before it; but no longer than
/// order_wait_s from when its own poses are there. One that comes after that goes too late, and is counted.
///
/// Where too many wait, the oldest of them is dropped. Where they have too many bytes, the oldest that waits for tf is
/// dropped, or the oldest if none does.
///
/// One turn handles one cloud, and the next turn comes after all that was in the callback queue
/// before: services are answered, and new clouds are received, between two clouds.
///
/// Thread rule: all calls run on the callback queue, one after the other.
class CloudQueue {
 public:
  struct Callbacks {
    std::function<PoseSearch(const SensorMessage& cloud)> find_poses;
    std::function<void(const SensorMessage& cloud, const CloudPoses& poses)>
        handle;  ///< In its turn.
    /// For each cloud that goes without being handled. Must not throw.
    std::function<void(std::size_t source, DropReason reason, const std::string& text)> drop;
    /// Seconds, of a clock that does not jump.
    std::function<double()> clock_s = steadySeconds;
  };

  /// @param callback_queue  Must outlive this object.
  CloudQueue(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
             Callbacks callbacks);
  ~CloudQueue();
  CloudQueue(const CloudQueue&) = delete;
  CloudQueue& operator=(const CloudQueue&) = delete;

  /// Takes a cloud; drops it when it cannot be kept for want of memory. @param now  The node's time: simulated time that stands still lets none expire.
  void push(const SensorMessage& cloud, const ros::Time& now);

  /// Asks tf again for all that wait for it, and drops those that have waited too long.
  void update(const ros::Time& now);

  /// Asks tf again for all clouds, as after a change of the frames that are needed.
  void searchAnew(const ros::Time& now);

  /// Stamps begin anew: what the sources have sent so far says nothing of the clouds to come.
  void forgetOrder();

  [[nodiscard]] std::size_t size() const { return clouds_.size(); }
  [[nodiscard]] std::size_t numBytes() const { return num_bytes_; }
  /// Clouds that had their turn after one with a later stamp; 0 with one source.
  [[nodiscard]] std::uint64_t numOutOfOrder() const { return num_out_of_order_; }
  /// Of those that wait, the ones that wait for tf.
  [[nodiscard]] std::size_t numWaitingForTf() const;
  /// Whether a turn is on the callback queue.
  [[nodiscard]] bool hasTurn() const { return has_turn_; }
  /// Of the oldest cloud that waits for tf: why; empty when none does.
  [[nodiscard]] std::string whyItWaits() const;

 private:
  struct Entry {
    SensorMessage cloud;
    ros::Time since;
    std::optional<CloudPoses> poses;
    std::string why;
    double ready_since_s = 0.0;  ///< When its poses were found.
  };
  using Entries = std::deque<Entry>;

  void insert(const SensorMessage& cloud, const ros::Time& now);
  [[nodiscard]] Entries::iterator placeOf(const SensorMessage& cloud);
  /// @return false when tf has forgotten the cloud's time.
  [[nodiscard]] bool searchPoses(Entry& entry);
  [[nodiscard]] bool hasExpired(Entry& entry, const ros::Time& now) const;
  void makePlace();
  [[nodiscard]] Entries::iterator findWaiting();
  void drop(const Entries::iterator& entry, DropReason reason);
  [[nodiscard]] Entry take(const Entries::iterator& entry);
  [[nodiscard]] Entries::iterator findReady();
  [[nodiscard]] Entries::iterator findNext();
  [[nodiscard]] bool haveOthersGoneOn(const SensorMessage& cloud) const;
  void requestTurn();
  void takeTurn();

  ros::CallbackQueueInterface& callback_queue_;
  CloudLimits limits_;
  Callbacks callbacks_;
  Entries clouds_;  ///< In the order in which they came; of several sources, by stamp.
  std::vector<ros::Time> newest_;  ///< Last stamp of each source.
  ros::Time last_handled_;
  std::uint64_t num_out_of_order_ = 0;
  std::size_t num_bytes_ = 0;
  bool has_turn_ = false;  ///< A turn waits in the callback queue.
};

}  // namespace cuboid_mapping_ros
