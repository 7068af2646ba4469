// SPDX-License-Identifier: BSD-3-Clause
// The node's parts in one thread, with a clock, a network and a disk that a seed decides on.
#pragma once

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/map_follower.h"
#include "cuboid_mapping/ros/clouds/cloud_inbox.h"
#include "cuboid_mapping/ros/clouds/cloud_intake.h"
#include "cuboid_mapping/ros/clouds/source.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/function_callback.h"

#include <ros/callback_queue.h>
#include <tf2/buffer_core.h>

#include <functional>
#include <memory>
#include <vector>

namespace cuboid_mapping_ros::test {

using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapDelta;
using cuboid_mapping::MapDetail;
using cuboid_mapping::MapFollower;
using cuboid_mapping::MapImage;

/// A map that is changed by one thing after the other: what a node's must be equal to.
class PlainReplay {
 public:
  explicit PlainReplay(const NodeParameters& parameters)
      : map_(makeMapConfig(parameters)), sources_(makeSources(parameters)) {}

  void insert(const SensorMessage& cloud, const CloudPoses& poses) {
    std::optional<CloudError> error;
    Source& source = *sources_.at(cloud.source);
    const auto* update = source.pipeline.compute(cloud, poses, statistics_, error);
    if (update != nullptr) (void)map_.apply(*update, source.pipeline.sensorModel());
  }
  void setParameters(const NodeParameters& parameters) {
    sources_ = makeSources(parameters);
    (void)map_.setSensorModel(parameters.map.sensor_model);
  }
  CuboidMap& map() { return map_; }

 private:
  CuboidMap map_;
  std::vector<std::unique_ptr<Source>> sources_;
  NodeStatistics statistics_;
};

/// What MappingNode makes of its parts, without roscpp around them.
class SimulatedNode {
 public:
  explicit SimulatedNode(const NodeParameters& parameters)
      : map_(makeMapConfig(parameters)),
        sources_(makeSources(parameters)),
        queue_(callbacks_, guard_, "simulated"),
        intake_(queue_, tf_, parameters,
                {[this](const SensorMessage& cloud, const CloudPoses& poses) {
                   countFailure([&] { handle(cloud, poses); });
                 },
                 [this](std::size_t, DropReason reason, const std::string&) {
                   ++statistics_.numDropped(reason);
                 }}),
        inbox_(queue_, makeCloudLimits(parameters),
               {[this](const SensorMessage& cloud) {
                  ++statistics_.num_received;
                  countFailure([&] { intake_.receive(cloud, now_); });
                },
                [this](std::size_t, std::size_t count) {
                  statistics_.num_received += count;
                  statistics_.numDropped(DropReason::kQueueFull) += count;
                }}),
        replay_(parameters) {
    inserted_.reserve(1000);
  }

  void receive(const SensorMessage& cloud) { inbox_.put(cloud); }
  void setTime(const ros::Time& now) {
    now_ = now;
    post(queue_, this, [this] { intake_.update(now_); });
  }
  void setTransform(const geometry_msgs::TransformStamped& transform, bool is_static) {
    tf_.setTransform(transform, "simulated", is_static);
    post(queue_, this, [this] { intake_.update(now_); });
  }
  /// Lets one callback run. @return false when there is none.
  bool callOne() { return callbacks_.callOne() == ros::CallbackQueue::Called; }

  void setParameters(const NodeParameters& parameters) {
    intake_.setParameters(parameters, now_);
    sources_ = makeSources(parameters);
    edit([&](CuboidMap& map) { return map.setSensorModel(parameters.map.sensor_model); });
    replay().setParameters(parameters);
  }
  /// Changes the map, and that of the replay.
  void editBoth(const std::function<ChangeSet(CuboidMap&)>& work) {
    edit(work);
    (void)work(replay().map());
  }
  void setPaused(bool is_paused) { is_paused_ = is_paused; }

  MapImage makeImage() {
    return map_.read([](const CuboidMap& map, const ros::Time&) {
      return cuboid_mapping::makeImage(map, kInstance, MapDetail::kValues);
    });
  }
  /// As MapPublisher::publish().
  MapDelta publish() {
    MapDelta delta;
    (void)map_.takeChanges([&](const CuboidMap& map, const ros::Time&, const ChangeSet& changes) {
      delta = cuboid_mapping::makeDelta(map, changes, kInstance, published_revision_,
                                        MapDetail::kValues);
    });
    published_revision_ = delta.revision;
    return delta;
  }

  GuardedMap& map() { return map_; }
  /// With all clouds that were counted as inserted.
  PlainReplay& replay() {
    for (const Inserted& inserted : inserted_) replay_.insert(inserted.cloud, inserted.poses);
    inserted_.clear();
    return replay_;
  }
  [[nodiscard]] const NodeStatistics& statistics() const { return statistics_; }
  [[nodiscard]] std::size_t numWaiting() const { return intake_.numWaiting(); }
  [[nodiscard]] const CallbackGuard& guard() const { return guard_; }

 private:
  static constexpr std::uint64_t kInstance = 7;

  struct Inserted {
    SensorMessage cloud;
    CloudPoses poses;
  };

  void edit(const std::function<ChangeSet(CuboidMap&)>& work) {
    map_.edit([&](CuboidMap& map, const ros::Time&) { return work(map); });
  }

  /// As MappingNode: a cloud whose work fails is counted.
  template <typename WorkT>
  void countFailure(const WorkT& work) {
    try {
      work();
    } catch (const std::exception&) {
      ++statistics_.numDropped(DropReason::kInternalError);
    }
  }

  void handle(const SensorMessage& cloud, const CloudPoses& poses) {
    if (is_paused_) {
      ++statistics_.numDropped(DropReason::kPaused);
      return;
    }
    std::optional<CloudError> error;
    Source& source = *sources_.at(cloud.source);
    const auto* update = source.pipeline.compute(cloud, poses, statistics_, error);
    if (update == nullptr) {
      ++statistics_.numDropped(toDropReason(error->defect));
      return;
    }
    map_.integrate(cloud.header().stamp, *update, source.pipeline.sensorModel(),
                   poses.T_map_sensor.translation());
    ++statistics_.num_inserted;
    inserted_.push_back({cloud, poses});
  }

  GuardedMap map_;
  std::vector<std::unique_ptr<Source>> sources_;
  NodeStatistics statistics_;
  ros::CallbackQueue callbacks_;
  CallbackGuard guard_;
  GuardedQueue queue_;
  tf2::BufferCore tf_;
  ros::Time now_{1000.0};
  bool is_paused_ = false;
  std::uint64_t published_revision_ = 0;
  CloudIntake intake_;
  CloudInbox inbox_;
  PlainReplay replay_;
  std::vector<Inserted> inserted_;  ///< That the replay does not have yet.
};

}  // namespace cuboid_mapping_ros::test
