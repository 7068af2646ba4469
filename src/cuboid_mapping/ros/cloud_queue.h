// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/cloud_pipeline.h"
#include "cuboid_mapping/ros/node_statistics.h"

#include <ros/callback_queue_interface.h>
#include <ros/duration.h>
#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>

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
};

/// Bytes that a waiting cloud takes.
[[nodiscard]] std::size_t countBytes(const sensor_msgs::PointCloud2& cloud);

/// Clouds that wait for tf, and then for their turn on a callback queue.
///
/// Each cloud knows why it waits. tf is asked when the cloud comes and with every update(); the poses
/// that it gave go with the cloud, whatever tf forgets before its turn. Clouds whose poses are there
/// pass others, and go in the order in which they came. Where too many wait, the oldest of them is
/// dropped; with too many bytes it is the oldest that waits for tf, and otherwise the oldest.
///
/// One turn handles one cloud, and the next turn comes after all that was in the callback queue
/// before: services are answered, and new clouds are received, between two clouds.
///
/// Thread rule: all calls run on the callback queue, one after the other.
class CloudQueue {
 public:
  using CloudPtr = sensor_msgs::PointCloud2::ConstPtr;

  struct Callbacks {
    std::function<PoseSearch(const std_msgs::Header& header)> find_poses;
    std::function<void(const CloudPtr& cloud, const CloudPoses& poses)> handle;  ///< In its turn.
    /// For each cloud that goes without being handled. Must not throw.
    std::function<void(DropReason reason, const std::string& text)> drop;
  };

  /// @param callback_queue  Must outlive this object.
  CloudQueue(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
             Callbacks callbacks);
  ~CloudQueue();
  CloudQueue(const CloudQueue&) = delete;
  CloudQueue& operator=(const CloudQueue&) = delete;

  /// Takes a cloud; drops it when it cannot be kept for want of memory. @param now  The node's time: simulated time that stands still lets none expire.
  void push(const CloudPtr& cloud, const ros::Time& now);

  /// Asks tf again for all that wait for it, and drops those that have waited too long.
  void update(const ros::Time& now);

  /// Asks tf again for all clouds, as after a change of the frames that are needed.
  void searchAnew(const ros::Time& now);

  [[nodiscard]] std::size_t size() const { return clouds_.size(); }
  [[nodiscard]] std::size_t numBytes() const { return num_bytes_; }
  /// Of them, those that wait for tf.
  [[nodiscard]] std::size_t numWaitingForTf() const;
  /// Of the oldest cloud that waits for tf: why; empty when none does.
  [[nodiscard]] std::string whyItWaits() const;

 private:
  struct Entry {
    CloudPtr cloud;
    ros::Time since;
    std::optional<CloudPoses> poses;
    std::string why;
  };
  using Entries = std::deque<Entry>;

  void insert(const CloudPtr& cloud, const ros::Time& now);
  /// @return false when tf has forgotten the cloud's time.
  [[nodiscard]] bool searchPoses(Entry& entry);
  [[nodiscard]] bool hasExpired(Entry& entry, const ros::Time& now) const;
  void makePlace();
  [[nodiscard]] Entries::iterator findWaiting();
  void drop(const Entries::iterator& entry, DropReason reason);
  [[nodiscard]] Entry take(const Entries::iterator& entry);
  [[nodiscard]] Entries::iterator findReady();
  void requestTurn();
  void takeTurn();

  ros::CallbackQueueInterface& callback_queue_;
  CloudLimits limits_;
  Callbacks callbacks_;
  Entries clouds_;  ///< In the order in which they came.
  std::size_t num_bytes_ = 0;
  bool has_turn_ = false;  ///< A turn waits in the callback queue.
};

}  // namespace cuboid_mapping_ros
