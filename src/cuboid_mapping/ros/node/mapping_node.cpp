// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_node.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/conversions/point_cloud.h"
#include "cuboid_mapping/ros/middleware/function_callback.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// The log repeats a reason for dropping clouds after this time at the earliest.
constexpr std::chrono::seconds kLogPeriod{10};

/// At least so many clouds wait in the inbox, so that a cloud that takes long costs none of those behind it.
constexpr std::size_t kMinInboxClouds = 100;

/// How often clouds that wait look at the clock; at tf they look when it changes.
constexpr double kWaitingPeriod_s = 0.1;

/// Calls of services that are worked on side by side: a long one keeps no other waiting.
constexpr std::uint32_t kQueryThreads = 4;

MarkerTopic makeTopic(const char* name, const MarkerStyle& style,
                      const NodeParameters& parameters) {
  return {name, withoutSlash(parameters.frame_id), parameters.latch, parameters.keyframe_period_s,
          style};
}

CloudLimits makeInboxLimits(const NodeParameters& parameters) {
  CloudLimits limits = makeCloudLimits(parameters);
  limits.max_clouds = std::max(limits.max_clouds, kMinInboxClouds);
  return limits;
}

}  // namespace

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters,
                         const std::optional<cuboid_mapping::MapSnapshot>& start_map)
    : cloud_callbacks_(*nh.getCallbackQueue(), guard_, "clouds"),
      arrival_callbacks_(arrivals_, guard_, "receiving"),
      tf_thread_(guard_, "tf"),
      query_threads_(guard_, "queries", kQueryThreads),
      edit_threads_(guard_, "edits", 2),
      asking_threads_(guard_, "asking robots",
                      static_cast<std::uint32_t>(parameters.fleet.robots.size()) + 1),
      publish_thread_(guard_, "publishing"),
      nh_(withQueue(nh, cloud_callbacks_)),
      private_nh_(withQueue(private_nh, cloud_callbacks_)),
      parameters_(parameters),
      sources_(parameters),
      forgetting_(parameters),
      moving_filter_(parameters.map.resolution_m, parameters.moving_points, parameters.window),
      map_(makeMapConfig(parameters)),
      has_color_span_(parameters.color_period_m == 0.0),
      speed_watch_(parameters.map.resolution_m, parameters.max_range_m),
      map_publisher_(withQueue(nh_, publish_thread_.queue()),
                     withQueue(private_nh_, publish_thread_.queue()), parameters, map_),
      observation_publisher_(nh_, private_nh_, parameters),
      occupied_publisher_(
          withQueue(nh_, publish_thread_.queue()),
          makeTopic(kOccupiedCuboidsTopic, makeOccupiedStyle(parameters), parameters), map_),
      free_publisher_(withQueue(nh_, publish_thread_.queue()),
                      makeTopic(kFreeCuboidsTopic, makeFreeStyle(), parameters), map_),
      octomap_server_(nh_, private_nh_, parameters, map_,
                      {publish_thread_.queue(), query_threads_.queue()}),
      diagnostics_(nh_, private_nh_, private_nh_.getNamespace()),
      cloud_intake_(cloud_callbacks_, tf_buffer_, parameters, intakeCallbacks()),
      cloud_inbox_(cloud_callbacks_, makeInboxLimits(parameters), inboxCallbacks()) {
  if (start_map) {
    map_.edit([&](cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
      map_.setProgress(start_map->progress);
      auto changes = restoreSnapshot(*start_map, map);
      if (parameters.is_autosave_read) {
        for (const auto& box : readLocks(parameters.autosave_file)) map.lock(box);
      }
      return changes;
    });
  }
  map_.setWindow(map_.read([&](const cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
    return makeWindow(parameters, map);
  }));
  advertiseServices();
  map_files_.emplace(private_nh_, parameters, map_, guard_);
  reconfigure_server_.emplace(private_nh_, parameters,
                              [this](const NodeParameters& changed) { reconfigure(changed); });
  if (!parameters.robot_grid.frame_id.empty()) {
    robot_grid_.emplace(withQueue(nh_, publish_thread_.queue()), parameters, map_, tf_buffer_);
  }
  startTimers();
  subscribe();
  startDiagnostics();  // Which looks at what subscribe() makes.
  query_threads_.start();
  edit_threads_.start();
  publish_thread_.start();
}

/// Threads first: nothing goes while a callback may use it.
MappingNode::~MappingNode() {
  is_stopping_ = true;
  sources_.stopListening();
  if (merger_) merger_->stopAsking();
  for (GuardedThread* thread :
       {&tf_thread_, &query_threads_, &edit_threads_, &asking_threads_, &publish_thread_}) {
    thread->stop();
  }
  tf_changes_.disconnect();
  removePosted(cloud_callbacks_, this);
}

void MappingNode::startTimers() {
  // Wall time: simulated time may stand still, or jump back.
  publish_timer_ = withQueue(nh_, publish_thread_.queue())
                       .createWallTimer(ros::WallDuration(1.0 / parameters_.publish_rate_hz),
                                        [this](const ros::WallTimerEvent&) { publish(); });
  waiting_timer_ =
      nh_.createWallTimer(ros::WallDuration(kWaitingPeriod_s),
                          [this](const ros::WallTimerEvent&) { updateWaitingClouds(); });
}

void MappingNode::startDiagnostics() {
  diagnostics_.setHardwareID("none");
  diagnostics_.add("mapping", this, &MappingNode::reportDiagnostics);
  sources_.addDiagnostics(diagnostics_);
  if (parameters_.fleet.observation_max_kb_s > 0.0) {
    diagnostics_.add("observations", &observation_publisher_, &ObservationPublisher::report);
  }
  diagnostics_timer_ =
      nh_.createWallTimer(ros::WallDuration(std::max(0.1, diagnostics_.getPeriod())),
                          [this](const ros::WallTimerEvent&) { diagnostics_.force_update(); });
}

void MappingNode::subscribe() {
  tf_changes_ = tf_buffer_._addTransformsChangedListener([this] { onTfChanged(); });
  tf_receiver_.emplace(withQueue(nh_, tf_thread_.queue()), tf_buffer_);
  tf_thread_.start();
  if (!parameters_.fleet.robots.empty()) return mergeRobots();
  if (parameters_.moving_points != MovingPoints::kIgnore) {
    moving_points_ = nh_.advertise<sensor_msgs::PointCloud2>(kMovingPointsTopic, 10);
  }
  sources_.listen(withQueue(nh_, arrival_callbacks_),
                  [this](const SensorMessage& cloud) { cloud_inbox_.put(cloud); });
}

void MappingNode::mergeRobots() {
  RobotMerger::Callbacks callbacks;
  callbacks.is_paused = [this] { return edit_services_->isPaused(); };
  callbacks.note = [this](const cuboid_mapping::RobotObservation& observation, bool is_in_map) {
    last_received_ = last_progress_ = Clock::now();
    last_header_.stamp = stampOf(observation);
    last_arrival_ = ros::Time::now();
    ++statistics_.num_received;
    if (!is_in_map) {
      return drop(0, DropReason::kPaused, [] { return toAdvice(DropReason::kPaused); });
    }
    ++statistics_.num_inserted;
    forget(observation.update, last_header_.stamp, 0);
  };
  last_header_.frame_id = withoutSlash(parameters_.frame_id);
  merger_.emplace(nh_, withQueue(nh_, asking_threads_.queue()), parameters_, map_,
                  std::move(callbacks));
  diagnostics_.add("merging", &*merger_, &RobotMerger::report);
  asking_threads_.start();
}

CloudInbox::Callbacks MappingNode::inboxCallbacks() {
  CloudInbox::Callbacks callbacks;
  callbacks.take = [this](const SensorMessage& cloud) {
    const std::string name = "receiving a cloud";
    if (!guard_.run(name, [&] { onCloudReceived(cloud); })) {
      drop(cloud.source, DropReason::kInternalError,
           [] { return toAdvice(DropReason::kInternalError); });
    }
  };
  callbacks.drop = [this](std::size_t source, std::size_t count) {
    statistics_.num_received += count;
    sources_.noteLost(source, count);
    for (std::size_t i = 0; i < count; ++i) {
      drop(source, DropReason::kQueueFull,
           [this] { return speed_watch_.advice().value_or(toAdvice(DropReason::kQueueFull)); });
    }
  };
  return callbacks;
}

CloudIntake::Callbacks MappingNode::intakeCallbacks() {
  CloudIntake::Callbacks callbacks;
  callbacks.handle = [this](const SensorMessage& cloud, const CloudPoses& poses) {
    onCloudInTurn(cloud, poses);
  };
  callbacks.drop = [this](std::size_t source, DropReason reason, const std::string& text) {
    drop(source, reason, [&text] { return text; });
  };
  return callbacks;
}

void MappingNode::onCloudReceived(const SensorMessage& cloud) {
  if (!sources_.receive(cloud)) return;
  last_received_ = Clock::now();
  if (statistics_.num_received++ == 0) last_progress_ = last_received_;
  last_header_ = cloud.header();
  last_source_ = cloud.source;
  last_arrival_ = ros::Time::now();
  speed_watch_.noteReceived(cloud.header().stamp.toSec());
  is_tf_awaited_ = true;  // Before tf is asked: what comes from now on is told.
  cloud_intake_.receive(cloud, ros::Time::now());
}

void MappingNode::onTfChanged() {
  if (!is_tf_awaited_ || is_update_due_.exchange(true)) return;
  post(cloud_callbacks_, this, [this] { updateWaitingClouds(); });
}

void MappingNode::updateWaitingClouds() {
  is_update_due_ = false;
  cloud_intake_.update(ros::Time::now());
  is_tf_awaited_ = cloud_intake_.awaitsTf();
}

void MappingNode::onCloudInTurn(const SensorMessage& cloud, const CloudPoses& poses) {
  if (edit_services_->isPaused()) {
    return drop(cloud.source, DropReason::kPaused, [] { return toAdvice(DropReason::kPaused); });
  }
  const ros::Time& stamp = cloud.header().stamp;
  if (!stamp.isZero() && stamp.toNSec() < first_stamp_ns_) {
    return drop(cloud.source, DropReason::kBeforeJump,
                [] { return toAdvice(DropReason::kBeforeJump); });
  }
  try {
    integrate(cloud, poses);
  } catch (const std::exception& exception) {
    drop(cloud.source, DropReason::kInternalError, [&exception] {
      return std::string(exception.what()) + "; " + toAdvice(DropReason::kInternalError);
    });
  } catch (...) {
    drop(cloud.source, DropReason::kInternalError,
         [] { return toAdvice(DropReason::kInternalError); });
  }
}

void MappingNode::integrate(const SensorMessage& cloud, const CloudPoses& poses) {
  Stopwatch whole;
  Source& source = sources_.at(cloud.source);
  std::optional<CloudError> error;
  const auto* update = source.pipeline.compute(cloud, poses, statistics_, error);
  for (const std::string& warning : source.pipeline.takeWarnings()) {
    ROS_WARN_STREAM(nameOf(source.parameters) << ": " << warning);
  }
  if (update == nullptr) {
    return drop(cloud.source, toDropReason(error->defect), [&error] { return error->text; });
  }
  Stopwatch stopwatch;
  const auto& taken = takeMoving(*update, poses, source, cloud.header().stamp);
  map_.integrate(cloud.header().stamp, taken, source.pipeline.sensorModel(),
                 poses.window_center_map);
  statistics_.apply_time.add(stopwatch.lap());
  ++statistics_.num_inserted;
  sources_.noteInserted(cloud.source);
  last_progress_ = Clock::now();
  // The cloud is in: what fails from here on does not count against it.
  guard_.run("after a cloud", [&] {
    speed_watch_.noteInserted(1e-3 * whole.lap(), statistics_.reach_m);
    giveAdvice();
  });
  forget(*update, cloud.header().stamp, cloud.source);
  guard_.run(kObservationsTopic, [&] {
    observation_publisher_.publish(cloud.header().stamp, poses.T_map_sensor.translation(),
                                   source.parameters.map.sensor_model, taken);
  });
}

const cuboid_mapping::ScanUpdate& MappingNode::takeMoving(const cuboid_mapping::ScanUpdate& update,
                                                          const CloudPoses& poses,
                                                          const Source& source,
                                                          const ros::Time& stamp) {
  if (moving_points_ && moving_points_.getNumSubscribers() > 0) {
    moving_points_.publish(toCloud(moving_filter_.findMoving(source.pipeline.scans()),
                                   makeHeader(withoutSlash(parameters_.frame_id), stamp)));
  }
  return moving_filter_.take(update, poses.window_center_map);
}

void MappingNode::forget(const cuboid_mapping::ScanUpdate& update, const ros::Time& stamp,
                         std::size_t source) {
  guard_.run("forgetting", [&] {
    forgetting_.note(update, stamp, source);
    while (forgetting_.hasDue()) {
      map_.edit([this](cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
        return forgetting_.forgetSome(map);
      });
    }
  });
}

void MappingNode::giveAdvice() {
  if (!has_suggested_) {
    if (const auto suggestion = speed_watch_.suggestion()) {
      has_suggested_ = true;
      ROS_INFO_STREAM_NAMED(kNodeName, *suggestion);
    }
  }
  const auto advice = speed_watch_.advice();
  const Clock::time_point now = Clock::now();
  if (!advice || (last_advice_ && now - *last_advice_ < kLogPeriod)) return;
  last_advice_ = now;
  ROS_WARN_STREAM_NAMED(kNodeName, "too slow for these clouds: " << *advice);
}

void MappingNode::reconfigure(const NodeParameters& parameters) {
  speed_watch_ = SpeedWatch(parameters.map.resolution_m, parameters.max_range_m);
  sources_.setParameters(parameters);
  cloud_intake_.setParameters(parameters, ros::Time::now());
  map_.edit([&](cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
    return map.setSensorModel(parameters.map.sensor_model);
  });
  map_.saveHead();
  has_color_span_ = parameters.color_period_m == 0.0;
  occupied_publisher_.setColors(parameters.color_by, parameters.color_period_m);
  octomap_server_.setParameters(parameters.octomap_server);
  publish_timer_.setPeriod(ros::WallDuration(1.0 / parameters.publish_rate_hz), false);
}

void MappingNode::updateColorSpan() {
  if (!occupied_publisher_.hasListeners()) return;
  if (!has_color_span_) {
    if (color_span_) occupied_publisher_.setColorSpan(std::nullopt);
    color_span_.reset();
    return;
  }
  const auto heights = map_.read([](const cuboid_mapping::CuboidMap& map,
                                    const ros::Time& /*stamp*/) { return findHeightRange(map); });
  const HeightSpan span{heights.min_m, heights.max_m};
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
  cuboid_mapping::ChangeSet changes;
  // Each by itself: what fails for one topic must not keep the changes from the others.
  const bool is_known =
      guard_.run(kCuboidMapUpdatesTopic, [&] { changes = map_publisher_.publish(); });
  if (!is_known) changes.is_everything = true;  // They are lost.
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
  if (robot_grid_) guard_.run(kRobotGridTopic, [&] { robot_grid_->publish(); });
}

void MappingNode::drop(std::size_t source, DropReason reason,
                       const std::function<std::string()>& text) {
  ++statistics_.numDropped(reason);
  guard_.run("figures of a source", [&] { sources_.noteDropped(source, toString(reason)); });
  auto& last_logged = last_logged_[static_cast<std::size_t>(reason)];
  const Clock::time_point now = Clock::now();
  if (last_logged && now - *last_logged < kLogPeriod) return;
  last_logged = now;
  guard_.run("log", [&] {
    ROS_WARN_STREAM_NAMED(kNodeName, "cloud dropped, " << toString(reason) << ": " << text() << " ("
                                                       << statistics_.numDropped(reason)
                                                       << " for this reason so far)");
  });
}

}  // namespace cuboid_mapping_ros
