// SPDX-License-Identifier: BSD-3-Clause
// The node's parts in one thread, with a clock, a network and a disk that a seed controls.
#pragma once

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <cmath>
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

/// A map that gets one change after the other: the node's map must be equal to it.
class PlainReplay {
 public:
  explicit PlainReplay(const NodeParameters& parameters)
      : map_(makeMapConfig(parameters)), sources_(makeSources(parameters)) {}

  void insert(const SensorMessage& cloud, const CloudPoses& poses) {
    Source& source = *sources_.at(cloud.source);
    const Observed observed = source.input.compute(cloud, poses);
    const auto* update = observed.update;
    if (update != nullptr) (void)map_.apply(*update, source.input.sensorModel());
  }
  void setParameters(const NodeParameters& parameters) {
    sources_ = makeSources(parameters);
    (void)map_.setSensorModel(parameters.source.sensor_model);
  }
  CuboidMap& map() { return map_; }

 private:
  CuboidMap map_;
  std::vector<std::unique_ptr<Source>> sources_;
};

/// The work of MappingNode on its parts, without roscpp.
class SimulatedNode {
 public:
  explicit SimulatedNode(const NodeParameters& parameters)
      : parameters_(parameters),
        map_(makeMapConfig(parameters)),
        sources_(makeSources(parameters)),
        clouds_(makeCloudLimits(parameters), makeCallbacks()),
        replay_(parameters) {
    inserted_.reserve(1000);
  }

  void receive(const SensorMessage& cloud) {
    ++statistics_.num_received;
    clouds_.put(cloud);
  }
  void setTime(const ros::Time& now) {
    clock_s_ += std::abs(now.toSec() - now_.toSec());
    if (now < now_ - ros::Duration(TfReceiver::kMinJump_s)) tf_.clear();  // TfReceiver does this.
    now_ = now;
  }
  void setTransform(const geometry_msgs::TransformStamped& transform, bool is_static) {
    tf_.setTransform(transform, "simulated", is_static);
  }
  /// Maps one cloud. @return false if there is none.
  bool mapOne() {
    const auto next = clouds_.takeNext();
    if (next) countFailure([&] { handle(next->message, next->poses); });
    return next.has_value();
  }

  void setParameters(const NodeParameters& parameters) {
    parameters_ = parameters;
    clouds_.searchAgain();
    sources_ = makeSources(parameters);
    edit([&](CuboidMap& map) { return map.setSensorModel(parameters.source.sensor_model); });
    replay().setParameters(parameters);
  }
  /// Changes the map, and the replay's map.
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
  /// Publishes as MapPublisher::publish() does.
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
  /// The replay with all clouds that were counted as inserted.
  PlainReplay& replay() {
    for (const Inserted& inserted : inserted_) replay_.insert(inserted.cloud, inserted.poses);
    inserted_.clear();
    return replay_;
  }
  [[nodiscard]] const NodeStatistics& statistics() const { return statistics_; }
  [[nodiscard]] std::size_t numWaiting() const { return clouds_.size(); }

 private:
  static constexpr std::uint64_t kInstance = 7;

  struct Inserted {
    SensorMessage cloud;
    CloudPoses poses;
  };

  CloudQueue::Callbacks makeCallbacks() {
    CloudQueue::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud, const Slices& slices) {
      return findPoses(tf_, PoseFrames(parameters_, parameters_.source), cloud.header(), slices);
    };
    callbacks.drop = [this](std::size_t, DropReason reason, const std::string&) {
      ++statistics_.numDropped(reason);
    };
    callbacks.clock_s = [this] { return clock_s_; };
    callbacks.now = [this] { return now_; };
    return callbacks;
  }

  void edit(const std::function<ChangeSet(CuboidMap&)>& work) {
    map_.edit([&](CuboidMap& map, const ros::Time&) { return work(map); });
  }

  /// Runs work as CloudMapper does: a cloud whose work fails is counted.
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
    Source& source = *sources_.at(cloud.source);
    const Observed observed = source.input.compute(cloud, poses);
    const auto* update = observed.update;
    if (update == nullptr) {
      ++statistics_.numDropped(observed.error->defect);
      return;
    }
    map_.integrate(cloud.header().stamp, *update, source.input.sensorModel(),
                   poses.T_map_sensor.translation());
    statistics_.addInserted(observed.figures);
    inserted_.push_back({cloud, poses});
  }

  NodeParameters parameters_;
  GuardedMap map_;
  std::vector<std::unique_ptr<Source>> sources_;
  NodeStatistics statistics_;
  TfBuffer tf_{ros::Duration(20.0), 1.0};
  ros::Time now_{1000.0};
  double clock_s_ = 0.0;
  bool is_paused_ = false;
  std::uint64_t published_revision_ = 0;
  CloudQueue clouds_;
  PlainReplay replay_;
  std::vector<Inserted> inserted_;  ///< Clouds that the replay does not have yet.
};

}  // namespace cuboid_mapping_ros::test
