// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_queue.h"
#include "cuboid_mapping/ros/middleware/time_jump.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/callback_queue_interface.h>
#include <tf2/buffer_core.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Limits of the parameters, for the inbox and the queue of clouds each: half of the memory, and the number
/// of clouds times that of the sources.
[[nodiscard]] CloudLimits makeCloudLimits(const NodeParameters& parameters);

/// What clouds go through before they are worked on: jumps of time are told from clouds that are late,
/// and clouds wait for tf and for their turn. Needs no master.
///
/// Thread rule: all calls run on the callback queue, one after the other; tf is thread-safe.
class CloudIntake {
 public:
  struct Callbacks {
    std::function<void(const SensorMessage& cloud, const CloudPoses& poses)> handle;
    std::function<void(std::size_t source, DropReason reason, const std::string& text)> drop;
  };

  /// @param callback_queue, tf  Must outlive this object.
  CloudIntake(ros::CallbackQueueInterface& callback_queue, tf2::BufferCore& tf,
              const NodeParameters& parameters, Callbacks callbacks);

  /// Takes a cloud; forgets all transforms when it shows that time has jumped back.
  void receive(const SensorMessage& cloud, const ros::Time& now);

  /// To be called when tf or the time has changed.
  void update(const ros::Time& now);

  /// Takes other parameters, also for the clouds that wait already.
  void setParameters(const NodeParameters& parameters, const ros::Time& now);

  /// Clouds that have neither been handled nor dropped.
  [[nodiscard]] std::size_t numWaiting() const;
  /// Whether one of them is about to be handled.
  [[nodiscard]] bool hasTurn() const { return queue_.hasTurn(); }
  /// See CloudQueue.
  ///@{
  [[nodiscard]] std::uint64_t numOutOfOrder() const { return queue_.numOutOfOrder(); }
  [[nodiscard]] std::string whyItWaits() const { return queue_.whyItWaits(); }
  ///@}
  /// Whether one of them would go on with a change of tf.
  [[nodiscard]] bool awaitsTf() const;

 private:
  [[nodiscard]] PoseSearch findPoses(const SensorMessage& cloud) const;
  /// Whether the newest transform is later than a cloud by more than tf keeps.
  [[nodiscard]] bool isTfOutdated(const std::string& frame_id, const ros::Time& stamp) const;
  [[nodiscard]] bool isHeldInVain(const ros::Time& now);
  void releaseHeldCloud(const ros::Time& now);

  tf2::BufferCore& tf_;
  std::vector<NodeParameters> sources_;
  ros::Duration tf_history_;  ///< How long tf keeps transforms.
  TimeJumpDetector time_jump_detector_;
  std::optional<SensorMessage>
      held_cloud_;  ///< Older than tf goes back: too late, or the first after a jump.
  ros::Time held_since_;
  CloudQueue queue_;
};

}  // namespace cuboid_mapping_ros
