// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_node.h"

#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Number of service calls that run in parallel: four queries, and as many edits.
constexpr std::uint32_t kServiceThreads = 8;
/// tf keeps this more than tf_wait: a cloud that has waited so long still has its transforms.
constexpr double kTfMargin_s = 10.0;

std::vector<PoseFrames> framesOf(const NodeParameters& parameters) {
  std::vector<PoseFrames> frames;
  for (const SourceParameters& source : sourcesOf(parameters)) {
    frames.emplace_back(parameters, source);
  }
  return frames;
}

}  // namespace

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters,
                         const std::optional<MapSnapshot>& start_map)
    : node_callbacks_(*nh.getCallbackQueue(), guard_, "node"),
      receiving_thread_(guard_, "receiving"),
      service_threads_(guard_, "services", kServiceThreads),
      publish_thread_(guard_, "publishing"),
      slow_thread_(guard_, "slow work"),
      nh_(withQueue(nh, node_callbacks_)),
      private_nh_(withQueue(private_nh, node_callbacks_)),
      parameters_(parameters),
      ledger_(parameters),
      sources_(parameters, ledger_),
      inputs_(makeSources(parameters)),
      frames_(framesOf(parameters)),
      map_(makeMapConfig(parameters)),
      diagnostics_(nh_, private_nh_, private_nh_.getNamespace()),
      tf_buffer_(ros::Duration(parameters.tf_wait_s + kTfMargin_s), parameters.tf_gap_s),
      map_in_frame_{map_, parameters.frame_id, tf_buffer_, parameters.service_limits,
                    &is_stopping_},
      clouds_(makeCloudLimits(parameters), queueCallbacks()),
      host_(makeHost()) {
  if (start_map) restore(*start_map);
  features_ = makeFeatures(host_);
  is_behind_.resize(features_.size());
  advertiseServices();
  reconfigure_server_.emplace(host_.services_nh, parameters,
                              [this](const NodeParameters& changed) { reconfigure(changed); });
  publish_timer_ = startTimer(host_.nh, 1.0 / parameters_.publish_rate_hz, [this] { publish(); });
  subscribe();
  startDiagnostics();  // Reads what subscribe() has made.
  service_threads_.start();
  publish_thread_.start();
  slow_thread_.start();
  for (const auto& feature : features_) feature->start();
  mapping_thread_ = std::thread([this] { mapClouds(); });
}

MapHost MappingNode::makeHost() {
  return {withQueue(nh_, publish_thread_.queue()),
          withQueue(private_nh_, publish_thread_.queue()),
          withQueue(private_nh_, service_threads_.queue()),
          withQueue(nh_, service_threads_.queue()),
          parameters_,
          map_,
          map_in_frame_,
          tf_buffer_,
          guard_,
          slow_thread_.queue(),
          is_stopping_,
          is_paused_,
          [this] { publishSoon(); },
          [this] {
            const std::lock_guard<FairMutex> lock(work_mutex_);
            noteReplaced();
          },
          [this](const std_msgs::Header& header) { return ledger_.noteReceived(0, header); },
          [this](const MappedCloud* cloud) {
            if (cloud == nullptr) return drop(0, DropReason::kPaused);
            ledger_.noteInserted(0, {}, {});
            noteMapped(*cloud);
          }};
}

void MappingNode::restore(const MapSnapshot& start_map) {
  map_.edit([&](CuboidMap& map) {
    map_.setProgress(start_map.progress);
    return restoreSnapshot(start_map, map);
  });
}

/// Stops the threads first: no member may be destroyed while a callback uses it.
MappingNode::~MappingNode() {
  is_stopping_ = true;
  sources_.stopListening();
  clouds_.stop();
  mapping_thread_.join();
  for (const auto& feature : features_) feature->stop();
  for (GuardedThread* thread :
       {&receiving_thread_, &service_threads_, &publish_thread_, &slow_thread_}) {
    thread->stop();
  }
  while (!features_.empty()) features_.pop_back();  // The last one first.
}

void MappingNode::startDiagnostics() {
  diagnostics_.setHardwareID("none");
  diagnostics_.add("mapping", this, &MappingNode::reportDiagnostics);
  sources_.addDiagnostics(diagnostics_);
  for (const auto& feature : features_) feature->addStatus(diagnostics_);
  diagnostics_timer_ = startTimer(nh_, std::max(0.1, diagnostics_.getPeriod()),
                                  [this] { diagnostics_.force_update(); });
}

void MappingNode::subscribe() {
  receiving_thread_.start();
  tf_receiver_.emplace(withQueue(nh_, receiving_thread_.queue()), tf_buffer_);
  if (!parameters_.fleet.robots.empty()) return;  // Their observations make the map.
  SourceSubscriber::Callbacks callbacks;
  callbacks.arrived = [this](std::size_t source, const std_msgs::Header& header) {
    return ledger_.noteReceived(source, header);
  };
  callbacks.take = [this](const SensorMessage& cloud) { clouds_.put(cloud); };
  callbacks.drop = [this](std::size_t source, const std::string& why) {
    ledger_.noteDropped(source, DropReason::kNoCameraInfo, why);
  };
  sources_.listen(withQueue(nh_, receiving_thread_.queue()), callbacks);
}

CloudQueue::Callbacks MappingNode::queueCallbacks() {
  CloudQueue::Callbacks callbacks;
  callbacks.find_poses = makeSearch(parameters_);
  std::vector<std::shared_ptr<const SensorSteps>> steps;
  for (const SourceParameters& source : sourcesOf(parameters_)) {
    steps.push_back(std::make_shared<const SensorSteps>(makeSteps(parameters_, source)));
  }
  callbacks.find_slices = [steps](const SensorMessage& cloud) {
    return findSlices(*steps.at(cloud.source), cloud);
  };
  callbacks.drop = [this](std::size_t source, DropReason reason, const std::string& text) {
    ledger_.noteDropped(source, reason, text);
  };
  std::vector<std::string> names;
  for (const SourceParameters& source : sourcesOf(parameters_)) {
    names.push_back(source.name.empty() ? nh_.resolveName(source.topic) : source.name);
  }
  callbacks.say_waiting = [names](std::size_t source, const std::string& why) {
    ROS_WARN_STREAM_NAMED(kNodeName, "clouds of " << names.at(source) << " wait for tf: " << why);
  };
  return callbacks;
}

CloudQueue::FindPoses MappingNode::makeSearch(const NodeParameters& parameters) const {
  return [this, frames = framesOf(parameters)](const SensorMessage& cloud, const Slices& slices) {
    return findPoses(tf_buffer_, frames.at(cloud.source), cloud.header(), slices);
  };
}

void MappingNode::mapClouds() {
  for (bool goes_on = true; goes_on;) {
    const bool is_done = guard_.run("clouds", [&] { goes_on = mapNextCloud(); });
    if (!is_done) ros::WallDuration(0.01).sleep();
  }
}

bool MappingNode::mapNextCloud() {
  const auto cloud = clouds_.waitNext();
  if (!cloud) return false;
  const std::lock_guard<FairMutex> lock(work_mutex_);
  onCloudInTurn(*cloud);
  return true;
}

void MappingNode::onCloudInTurn(const PosedCloud& cloud) {
  const std::size_t source = cloud.message.source;
  if (is_paused_.load()) return drop(source, DropReason::kPaused);
  const ros::Time& stamp = cloud.message.header().stamp;
  if (!stamp.isZero() && stamp.toNSec() < first_stamp_ns_) {
    return drop(source, DropReason::kBeforeJump);
  }
  try {
    integrate(cloud);
  } catch (const std::exception& exception) {
    ledger_.noteDropped(source, DropReason::kInternalError, exception.what());
  } catch (...) {
    drop(source, DropReason::kInternalError);
  }
}

void MappingNode::integrate(const PosedCloud& posed) {
  const SensorMessage& cloud = posed.message;
  const CloudPoses& poses = posed.poses;
  Stopwatch whole;
  Source& source = *inputs_.at(cloud.source);
  Observed observed = source.input.compute(cloud, poses);
  for (const std::string& warning : source.input.takeWarnings()) {
    ROS_WARN_STREAM_NAMED(kNodeName, nameOf(source.parameters) << ": " << warning);
  }
  if (observed.error) {
    return ledger_.noteDropped(cloud.source, observed.error->defect, observed.error->text);
  }
  Stopwatch stopwatch;
  const ros::Time& stamp = cloud.header().stamp;
  const ScanUpdate& mapped =
      filter(*observed.update, {source.input.scans(), stamp, poses.window_center_map});
  map_.integrate(stamp, mapped, source.input.sensorModel(), poses.window_center_map,
                 source.input.takeKept(cloud, poses));
  observed.figures.apply_ms = stopwatch.lap();
  ledger_.noteInserted(cloud.source, observed.figures,
                       {1e-3 * whole.lap(), steadySeconds() - posed.arrival_s});
  // The cloud is in the map: later failures do not count against it.
  guard_.run("after a cloud", [&] { ledger_.giveAdvice(clouds_.hasReady()); });
  noteMapped({cloud.source, stamp, poses.T_map_sensor.translation(), source.parameters.sensor_model,
              *observed.update, mapped});
}

void MappingNode::noteMapped(const MappedCloud& cloud) {
  for (const auto& feature : features_) {
    guard_.run(feature->name(), [&] { feature->onCloud(cloud); });
  }
}

const ScanUpdate& MappingNode::filter(const ScanUpdate& update, const CloudInWork& cloud) {
  const ScanUpdate* left = &update;
  for (const auto& feature : features_) left = &feature->filter(*left, cloud);
  return *left;
}

void MappingNode::noteReplaced() {
  for (const auto& feature : features_) {
    guard_.run(feature->name(), [&] { feature->onReplaced(); });
  }
}

void MappingNode::reconfigure(const NodeParameters& parameters) {
  ledger_.setParameters(parameters);
  {
    const std::lock_guard<FairMutex> lock(work_mutex_);
    inputs_ = makeSources(parameters);
  }
  {
    const std::lock_guard<std::mutex> lock(frames_mutex_);
    frames_ = framesOf(parameters);
  }
  clouds_.setSearch(makeSearch(parameters));
  map_.edit([&](CuboidMap& map) { return map.setSensorModel(parameters.source.sensor_model); });
  map_.saveHead();
  post(publish_thread_.queue(), this, [this, parameters] {
    for (const auto& feature : features_) feature->setParameters(parameters);
  });
  publish_timer_.setPeriod(ros::WallDuration(1.0 / parameters.publish_rate_hz), false);
}

void MappingNode::publishSoon() {
  if (is_publish_due_.exchange(true)) return;
  post(publish_thread_.queue(), this, [this] {
    is_publish_due_ = false;
    publish();
  });
}

void MappingNode::publish() {
  map_.takeChanges([&](const CuboidMap& map, const ros::Time& stamp, const ChangeSet& changed) {
    const ChangeSet everything{changed.revision, true, {}};
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const MapChanges changes{is_behind_[i] ? everything : changed, map, stamp};
      is_behind_[i] = !guard_.run(features_[i]->name(), [&] { features_[i]->onChanges(changes); });
    }
  });
  for (std::size_t i = 0; i < features_.size(); ++i) {
    if (!guard_.run(features_[i]->name(), [&] { features_[i]->publish(); })) is_behind_[i] = true;
  }
}

void MappingNode::drop(std::size_t source, DropReason reason) noexcept {
  guard_.run("counting", [&] { ledger_.noteDropped(source, reason, toAdvice(reason)); });
}

}  // namespace cuboid_mapping_ros
