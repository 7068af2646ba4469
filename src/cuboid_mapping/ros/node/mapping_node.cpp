// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_node.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Number of service calls that run in parallel, so that a long call does not block the others.
constexpr std::uint32_t kQueryThreads = 4;
/// tf keeps this more than tf_wait: a cloud that has waited so long still has its transforms.
constexpr double kTfMargin_s = 10.0;

}  // namespace

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters,
                         const std::optional<MapSnapshot>& start_map)
    : node_callbacks_(*nh.getCallbackQueue(), guard_, "node"),
      receiving_thread_(guard_, "receiving"),
      tf_thread_(guard_, "tf"),
      query_threads_(guard_, "queries", kQueryThreads),
      edit_threads_(guard_, "edits", 4),
      asking_threads_(guard_, "asking robots",
                      static_cast<std::uint32_t>(parameters.fleet.robots.size()) + 1),
      publish_thread_(guard_, "publishing"),
      nh_(withQueue(nh, node_callbacks_)),
      private_nh_(withQueue(private_nh, node_callbacks_)),
      parameters_(parameters),
      ledger_(parameters),
      sources_(parameters, ledger_),
      forgetting_(parameters),
      moving_filter_(parameters.map.resolution_m, parameters.moving_points, parameters.window),
      map_(makeMapConfig(parameters)),
      has_color_span_(parameters.color_period_m == 0.0),
      map_publisher_(withQueue(nh_, publish_thread_.queue()),
                     withQueue(private_nh_, publish_thread_.queue()), parameters, map_),
      observation_publisher_(nh_, private_nh_, parameters),
      occupied_publisher_(withQueue(nh_, publish_thread_.queue()), CuboidFilter::kOccupied,
                          parameters, map_),
      free_publisher_(withQueue(nh_, publish_thread_.queue()), CuboidFilter::kFree, parameters,
                      map_),
      octomap_server_(nh_, private_nh_, parameters, map_,
                      {publish_thread_.queue(), query_threads_.queue()}),
      diagnostics_(nh_, private_nh_, private_nh_.getNamespace()),
      tf_buffer_(ros::Duration(parameters.tf_wait_s + kTfMargin_s), parameters.tf_gap_s),
      map_in_frame_{map_, parameters.frame_id, tf_buffer_, parameters.service_limits,
                    &is_stopping_},
      clouds_(makeCloudLimits(parameters), queueCallbacks()),
      mapping_thread_(guard_, "clouds") {
  beginWith(start_map);
  advertiseServices();
  map_files_.emplace(private_nh_, parameters, map_, guard_);
  reconfigure_server_.emplace(private_nh_, parameters,
                              [this](const NodeParameters& changed) { reconfigure(changed); });
  if (parameters.keep.isOn()) {
    corrections_.emplace(nh_, private_nh_, parameters, map_, guard_, [this] { onCorrected(); });
  }
  preparePublishing();
  subscribe();
  startDiagnostics();  // Reads what subscribe() has made.
  query_threads_.start();
  edit_threads_.start();
  publish_thread_.start();
  post(mapping_thread_.queue(), this, [this] { mapClouds(); });
  mapping_thread_.start();
}

void MappingNode::preparePublishing() {
  const ros::NodeHandle nh = withQueue(nh_, publish_thread_.queue());
  if (!parameters_.robot_grid.frame_id.empty()) {
    const GridPublisher::Options options{kRobotGridTopic, kRobotGridUpdatesTopic, parameters_.latch,
                                         parameters_.keyframe_period_s};
    robot_grid_.emplace(nh, options,
                        [this] { return findRobotGrid(map_, tf_buffer_, parameters_); });
  }
  publish_timer_ = startTimer(nh, 1.0 / parameters_.publish_rate_hz, [this] { publish(); });
}

void MappingNode::beginWith(const std::optional<MapSnapshot>& start_map) {
  if (start_map) restore(*start_map);
  if (parameters_.window.keeps() && !hasMap(parameters_.window.file)) {
    std::filesystem::remove(locksFile(parameters_.window.file));  // Of a map that is gone.
  } else if (parameters_.window.keeps()) {
    ROS_INFO_STREAM_NAMED(kNodeName, "goes on with the map of " << parameters_.window.file);
  }
  map_.setWindow([&](CuboidMap& map) { return makeWindow(parameters_, map); });
  if (parameters_.window.keeps()) lockAsSaved(parameters_.window.file);
  if (parameters_.is_autosave_read) lockAsSaved(parameters_.autosave_file);
  if (parameters_.keep.isOn()) map_.setHistory(makeHistory(parameters_, map_));
}

void MappingNode::restore(const MapSnapshot& start_map) {
  map_.edit([&](CuboidMap& map) {
    map_.setProgress(start_map.progress);
    return restoreSnapshot(start_map, map);
  });
}

void MappingNode::lockAsSaved(const std::string& map_file) {
  const std::vector<CellBox> boxes = readLocks(map_file);
  map_.edit([&](CuboidMap& map) {
    for (const CellBox& box : boxes) map.lock(box);
    return ChangeSet{map.revision(), false, {}};
  });
}

/// Stops the threads first: no member may be destroyed while a callback uses it.
MappingNode::~MappingNode() {
  is_stopping_ = true;
  sources_.stopListening();
  if (merger_) merger_->stopAsking();
  clouds_.stop();
  mapping_thread_.stop();
  corrections_.reset();
  for (GuardedThread* thread : {&receiving_thread_, &tf_thread_, &query_threads_, &edit_threads_,
                                &asking_threads_, &publish_thread_}) {
    thread->stop();
  }
}

void MappingNode::startDiagnostics() {
  diagnostics_.setHardwareID("none");
  diagnostics_.add("mapping", this, &MappingNode::reportDiagnostics);
  sources_.addDiagnostics(diagnostics_);
  if (parameters_.fleet.observation_max_kb_s > 0.0) {
    diagnostics_.add("observations", &observation_publisher_, &ObservationPublisher::report);
  }
  diagnostics_timer_ = startTimer(nh_, std::max(0.1, diagnostics_.getPeriod()),
                                  [this] { diagnostics_.force_update(); });
}

void MappingNode::subscribe() {
  tf_receiver_.emplace(withQueue(nh_, tf_thread_.queue()), tf_buffer_);
  tf_thread_.start();
  if (!parameters_.fleet.robots.empty()) return mergeRobots();
  if (parameters_.moving_points != MovingPoints::kIgnore) {
    moving_points_ = nh_.advertise<sensor_msgs::PointCloud2>(kMovingPointsTopic, 10);
  }
  SourceSubscriber::Callbacks callbacks;
  callbacks.arrived = [this](std::size_t source, const std_msgs::Header& header) {
    return ledger_.noteReceived(source, header);
  };
  callbacks.take = [this](const SensorMessage& cloud) { clouds_.put(cloud); };
  callbacks.drop = [this](std::size_t source, const std::string& why) {
    ledger_.noteDropped(source, DropReason::kNoCameraInfo, why);
  };
  sources_.listen(withQueue(nh_, receiving_thread_.queue()), callbacks);
  receiving_thread_.start();
}

void MappingNode::mergeRobots() {
  RobotMerger::Callbacks callbacks;
  callbacks.is_paused = [this] { return is_paused_.load(); };
  callbacks.note = [this](const RobotObservation& observation, bool is_in_map) {
    std_msgs::Header header;
    header.frame_id = withoutSlash(parameters_.frame_id);
    header.stamp = stampOf(observation);
    if (!ledger_.noteReceived(0, header)) return;
    if (!is_in_map) return drop(0, DropReason::kPaused);
    ledger_.noteInserted(0, work_, {});
    forget(observation.update, header.stamp, 0);
  };
  merger_.emplace(nh_, withQueue(nh_, asking_threads_.queue()), parameters_, map_,
                  std::move(callbacks));
  diagnostics_.add("merging", &*merger_, &RobotMerger::report);
  asking_threads_.start();
}

CloudQueue::Callbacks MappingNode::queueCallbacks() {
  CloudQueue::Callbacks callbacks;
  callbacks.find_poses = makeSearch(parameters_);
  callbacks.read_slices = [sources = sourcesOf(parameters_)](const SensorMessage& cloud) {
    return readSlices(cloud, sources.at(cloud.source));
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

CloudQueue::FindPoses MappingNode::makeSearch(const NodeParameters& parameters) {
  std::vector<PoseFrames> frames;
  for (const SourceParameters& source : sourcesOf(parameters)) {
    frames.emplace_back(parameters, source);
  }
  return [this, frames](const SensorMessage& cloud, const Slices& slices) {
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
  Source& source = sources_.at(cloud.source);
  std::optional<CloudError> error;
  const auto* update = source.pipeline.compute(cloud, poses, work_, error);
  for (const std::string& warning : source.pipeline.takeWarnings()) {
    ROS_WARN_STREAM_NAMED(kNodeName, nameOf(source.parameters) << ": " << warning);
  }
  if (update == nullptr) {
    return ledger_.noteDropped(cloud.source, error->defect, error->text);
  }
  Stopwatch stopwatch;
  const auto& taken = takeMoving(*update, poses, source, cloud.header().stamp);
  map_.integrate(cloud.header().stamp, taken, source.pipeline.sensorModel(),
                 poses.window_center_map, source.pipeline.takeKept(cloud.header().stamp, poses));
  work_.apply_time.add(stopwatch.lap());
  ledger_.noteInserted(cloud.source, work_,
                       {1e-3 * whole.lap(), steadySeconds() - posed.arrival_s});
  // The cloud is in the map: later failures do not count against it.
  guard_.run("after a cloud", [&] { ledger_.giveAdvice(clouds_.hasReady()); });
  forget(*update, cloud.header().stamp, cloud.source);
  guard_.run(kObservationsTopic, [&] {
    observation_publisher_.publish(cloud.header().stamp, poses.T_map_sensor.translation(),
                                   source.parameters.sensor_model, taken);
  });
}

const ScanUpdate& MappingNode::takeMoving(const ScanUpdate& update, const CloudPoses& poses,
                                          const Source& source, const ros::Time& stamp) {
  if (moving_points_ && moving_points_.getNumSubscribers() > 0) {
    moving_points_.publish(toCloud(moving_filter_.findMoving(source.pipeline.scans()),
                                   makeHeader(withoutSlash(parameters_.frame_id), stamp)));
  }
  return moving_filter_.take(update, poses.window_center_map);
}

void MappingNode::forget(const ScanUpdate& update, const ros::Time& stamp, std::size_t source) {
  guard_.run("forgetting", [&] {
    forgetting_.note(update, stamp, source);
    while (forgetting_.hasDue()) {
      map_.edit([this](CuboidMap& map) { return forgetting_.forgetSome(map); });
    }
  });
}

void MappingNode::reconfigure(const NodeParameters& parameters) {
  ledger_.setParameters(parameters);
  {
    const std::lock_guard<FairMutex> lock(work_mutex_);
    sources_.setParameters(parameters);
  }
  clouds_.setSearch(makeSearch(parameters));
  map_.edit([&](CuboidMap& map) { return map.setSensorModel(parameters.source.sensor_model); });
  map_.saveHead();
  post(publish_thread_.queue(), this, [this, parameters] {
    has_color_span_ = parameters.color_period_m == 0.0;
    occupied_publisher_.setColors(parameters.color_by, parameters.color_period_m);
    octomap_server_.setParameters(parameters.octomap_server);
  });
  publish_timer_.setPeriod(ros::WallDuration(1.0 / parameters.publish_rate_hz), false);
}

void MappingNode::updateColorSpan() {
  if (!occupied_publisher_.hasListeners()) return;
  if (!has_color_span_) {
    if (color_span_) occupied_publisher_.setColorSpan(std::nullopt);
    color_span_.reset();
    return;
  }
  const auto span = map_.read([](const CuboidMap& map) { return findHeightRange(map); });
  if (color_span_ && !isOtherSpan(span, *color_span_)) return;
  color_span_ = span;
  occupied_publisher_.setColorSpan(span);
}

void MappingNode::publishSoon() {
  if (is_publish_due_.exchange(true)) return;
  post(publish_thread_.queue(), this, [this] {
    is_publish_due_ = false;
    publish();
  });
}

void MappingNode::publish() {
  updateColorSpan();
  ChangeSet changes;
  // Topics are guarded one by one, so that a failure of one does not keep the changes from the others.
  const bool is_known =
      guard_.run(kCuboidMapUpdatesTopic, [&] { changes = map_publisher_.publish(); });
  if (!is_known) changes.is_everything = true;  // The changes are lost.
  for (MarkerPublisher* publisher : {&occupied_publisher_, &free_publisher_}) {
    guard_.run("markers", [&] {
      publisher->noteChanges(changes);
      publisher->publish();
    });
  }
  guard_.run("topics of octomap_server", [&] {
    octomap_server_.noteChanges(changes);
    octomap_server_.publish();
  });
  guard_.run(kRobotGridTopic, [&] {
    if (!robot_grid_) return;
    robot_grid_->publish();
    robot_grid_->publishKeyframe();
  });
}

void MappingNode::drop(std::size_t source, DropReason reason) noexcept {
  guard_.run("counting", [&] { ledger_.noteDropped(source, reason, toAdvice(reason)); });
}

}  // namespace cuboid_mapping_ros
