// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/map/phase_fair_mutex.h"
#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/node/cloud_receiver.h"
#include "cuboid_mapping/ros/node/node_features.h"
#include "cuboid_mapping/ros/node/publishing_thread.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {

/// Second half of a cloud's way: takes the clouds of a CloudReceiver one by one, and puts them into the map, in a thread.
/// All functions are thread-safe.
class CloudMapper {
 public:
  /// All references must outlive this object. @param is_stopping  Ends work on a cloud; the cloud is dropped.
  CloudMapper(const NodeParameters& parameters, CloudReceiver& receiver, CloudLedger& ledger,
              GuardedMap& map, NodeFeatures& features, PublishingThread& publishing,
              CallbackGuard& guard, const std::atomic<bool>& is_stopping);

  void start();
  /// Waits for the end of the thread. @pre The receiver has stopped.
  void join() { thread_.join(); }

  /// Sets parameters that were changed while the node runs, here and in the receiver.
  void setParameters(const NodeParameters& parameters);
  void pause(bool is_paused) { is_paused_ = is_paused; }
  [[nodiscard]] bool isPaused() const { return is_paused_; }
  /// No cloud is in work while the lock lives.
  [[nodiscard]] std::unique_lock<FairMutex> hold() { return std::unique_lock(work_mutex_); }
  /// Drops clouds with an earlier stamp from now on: they have a frame before ~move_map. 0: none.
  void setFirstStamp(const ros::Time& stamp) { first_stamp_ns_ = stamp.toNSec(); }

  /// Counts a dropped cloud.
  void drop(std::size_t source, DropReason reason) noexcept;

 private:
  void mapClouds();
  /// Waits for a cloud and puts it into the map. @return false when the node ends.
  bool mapNextCloud();
  void onCloudInTurn(const PosedCloud& cloud);
  void integrate(const PosedCloud& posed);

  CloudReceiver& receiver_;
  CloudLedger& ledger_;
  GuardedMap& map_;
  NodeFeatures& features_;
  PublishingThread& publishing_;
  CallbackGuard& guard_;
  const std::atomic<bool>& is_stopping_;
  FairMutex work_mutex_;  ///< Guards sources_; held while a cloud is taken, and in work.
  std::vector<std::unique_ptr<Source>> sources_;  ///< With the current parameters.
  std::atomic<std::uint64_t> first_stamp_ns_{0};
  std::atomic<bool> is_paused_{false};
  std::thread thread_;
};

}  // namespace cuboid_mapping_ros
