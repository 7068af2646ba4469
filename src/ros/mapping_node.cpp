// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping_node.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/names.h"
#include "cuboid_mapping/ros/query_box_service.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// The log repeats a reason for dropping clouds after this time at the earliest.
constexpr std::chrono::seconds kLogPeriod{10};

/// Clouds that roscpp keeps, and beyond which it drops them without telling: what may arrive while
/// one cloud is worked on. The bound that counts is that of CloudQueue.
constexpr std::uint32_t kReceiveQueueSize = 100;

MarkerTopic makeTopic(const char* name, const MarkerStyle& style,
                      const NodeParameters& parameters) {
  return {name, withoutSlash(parameters.frame_id),
          parameters.latch ? LateListener::kGetsPictureAtOnce : LateListener::kGetsPictureLater,
          style};
}

ros::NodeHandle withQueue(ros::NodeHandle nh, ros::CallbackQueue& queue) {
  nh.setCallbackQueue(&queue);
  return nh;
}

}  // namespace

MappingNode::MappingNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters,
                         const std::optional<cuboid_mapping::MapSnapshot>& start_map)
    : parameters_(parameters),
      live_parameters_(parameters),
      pipeline_(std::in_place, parameters),
      map_(makeMapConfig(parameters)),
      has_color_span_(parameters.color_period_m == 0.0),
      speed_watch_(parameters.map.resolution_m, parameters.max_range_m),
      map_publisher_(withQueue(nh, publish_queue_), withQueue(private_nh, publish_queue_),
                     parameters, map_),
      occupied_publisher_(
          withQueue(nh, publish_queue_),
          makeTopic(kOccupiedCuboidsTopic, makeOccupiedStyle(parameters), parameters), map_),
      free_publisher_(withQueue(nh, publish_queue_),
                      makeTopic(kFreeCuboidsTopic, makeFreeStyle(), parameters), map_),
      octomap_server_(nh, private_nh, parameters, map_, {publish_queue_, query_queue_}),
      diagnostics_(nh, private_nh, private_nh.getNamespace()),
      tf_history_(tf_buffer_.getCacheLength()),
      time_jump_detector_(tf_history_),
      cloud_topic_(nh.resolveName(kCloudTopic)),
      cloud_queue_(
          nh.getCallbackQueue(), static_cast<std::size_t>(parameters.queue_size),
          [this](const CloudPtr& cloud) { onCloudInTurn(cloud); },
          [this](const CloudPtr&) {
            drop(DropReason::kQueueFull,
                 speed_watch_.advice().value_or(toAdvice(DropReason::kQueueFull)));
          }),
      tf_filter_(tf_buffer_, parameters.frame_id, static_cast<std::uint32_t>(parameters.queue_size),
                 nh),
      tf_listener_(tf_buffer_, nh),
      query_spinner_(1, &query_queue_),
      publish_spinner_(1, &publish_queue_) {
  if (start_map) {
    map_.edit([&](cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
      return restoreSnapshot(*start_map, map);
    });
  }
  advertiseServices(private_nh);
  map_files_.emplace(private_nh, parameters, map_);
  reconfigure_server_.emplace(private_nh, parameters,
                              [this](const NodeParameters& changed) { reconfigure(changed); });

  // Wall time: simulated time may stand still, or jump back.
  const ros::WallDuration publish_period(1.0 / parameters.publish_rate_hz);
  publish_timer_ =
      withQueue(nh, publish_queue_)
          .createWallTimer(publish_period, [this](const ros::WallTimerEvent&) { publish(); });
  fuse_timer_ = withQueue(nh, publish_queue_)
                    .createWallTimer(
                        ros::WallDuration(1e-3),
                        [this](const ros::WallTimerEvent&) { fuseUntilNextCloud(); }, true, false);
  held_cloud_timer_ = nh.createWallTimer(
      publish_period, [this](const ros::WallTimerEvent&) { releaseHeldCloudIfTfIsRight(); });
  diagnostics_.setHardwareID("none");
  diagnostics_.add("mapping", this, &MappingNode::reportDiagnostics);
  diagnostics_timer_ =
      nh.createWallTimer(ros::WallDuration(std::max(0.1, diagnostics_.getPeriod())),
                         [this](const ros::WallTimerEvent&) { diagnostics_.force_update(); });
  subscribe(nh);
  query_spinner_.start();
  publish_spinner_.start();
}

void MappingNode::advertiseServices(const ros::NodeHandle& private_nh) {
  ros::NodeHandle query_nh = withQueue(private_nh, query_queue_);
  query_box_server_ = advertiseQueryBox(
      query_nh, withoutSlash(parameters_.frame_id), [this](const BoxRequest& request) {
        return answerBoxRequest({map_, parameters_.frame_id, tf_buffer_}, request);
      });
  ros::NodeHandle edit_nh = withQueue(private_nh, publish_queue_);
  reset_server_ = edit_nh.advertiseService(kResetService, &MappingNode::onReset, this);
  const MapInFrame map{map_, parameters_.frame_id, tf_buffer_};
  planner_services_.emplace(query_nh, map);
  edit_services_.emplace(edit_nh, map, [this] { publish(); });
}

void MappingNode::subscribe(ros::NodeHandle& nh) {
  setTargetFrames();
  tf_filter_.registerCallback([this](const CloudPtr& cloud) { cloud_queue_.push(cloud); });
  tf_filter_.registerFailureCallback(
      [this](const CloudPtr& cloud, tf2_ros::FilterFailureReason reason) {
        onCloudWithoutTf(cloud, reason);
      });
  cloud_subscriber_.registerCallback([this](const CloudPtr& cloud) { onCloudReceived(cloud); });
  cloud_subscriber_.subscribe(nh, kCloudTopic, kReceiveQueueSize);
}

void MappingNode::onCloudReceived(const CloudPtr& cloud) {
  is_cloud_waiting_ = true;
  last_received_ = Clock::now();
  if (statistics_.num_received++ == 0) last_progress_ = last_received_;
  last_header_ = cloud->header;
  last_arrival_ = ros::Time::now();
  speed_watch_.noteReceived(cloud->header.stamp.toSec());
  const StampOrder order = time_jump_detector_.judge(cloud->header.stamp);
  if (order != StampOrder::kInOrder && isTfOutdated(cloud->header)) {
    if (order == StampOrder::kLate) {
      held_cloud_ = cloud;  // late, or the first after a jump: the next one tells
      return;
    }
    ROS_WARN_NAMED(kNodeName, "time has jumped back: transforms from before are forgotten");
    tf_buffer_.clear();
  }
  releaseHeldCloud();
  tf_filter_.add(cloud);
}

void MappingNode::releaseHeldCloud() {
  if (held_cloud_ == nullptr) return;
  tf_filter_.add(held_cloud_);
  held_cloud_.reset();
}

bool MappingNode::isTfOutdated(const std_msgs::Header& header) const {
  try {
    const ros::Time newest = tf_buffer_
                                 .lookupTransform(withoutSlash(parameters_.frame_id),
                                                  withoutSlash(header.frame_id), ros::Time())
                                 .header.stamp;
    return newest > header.stamp && newest - header.stamp > tf_history_;
  } catch (const tf2::TransformException&) {
    return false;  // there is none
  }
}

void MappingNode::onCloudInTurn(const CloudPtr& cloud) {
  if (edit_services_->isPaused()) return drop(DropReason::kPaused, toAdvice(DropReason::kPaused));
  std::string tf_error;
  const auto poses = lookupPoses(tf_buffer_, live_parameters_, cloud->header, tf_error);
  if (!poses) return waitForTfAgain(cloud, tf_error);
  try {
    integrate(*cloud, *poses);
  } catch (const std::exception& exception) {
    drop(DropReason::kInternalError, std::string(exception.what()) + "; " +
                                         toAdvice(DropReason::kInternalError) +
                                         ". Call ~reset if the map looks wrong from now on");
  }
}

void MappingNode::onCloudWithoutTf(const CloudPtr& cloud, tf2_ros::FilterFailureReason reason) {
  if (reason == tf2_ros::filter_failure_reasons::EmptyFrameID) {
    return drop(DropReason::kEmptyFrame, "header.frame_id is empty; set it in the driver");
  }
  std::ostringstream text;
  text << "frame '" << cloud->header.frame_id << "', stamp " << cloud->header.stamp << ": ";
  if (reason == tf2_ros::filter_failure_reasons::OutTheBack) {
    text << "older by more than " << tf_history_.toSec() << " s than the newest transform; "
         << toAdvice(DropReason::kTooOldForTf);
    return drop(DropReason::kTooOldForTf, text.str());
  }
  std::string tf_error;
  const bool is_late =
      lookupPoses(tf_buffer_, live_parameters_, cloud->header, tf_error).has_value();
  text << (is_late ? "the transform came when the queue was full already" : tf_error) << "; "
       << toAdvice(DropReason::kNoTransform);
  drop(DropReason::kNoTransform, text.str());
}

void MappingNode::waitForTfAgain(const CloudPtr& cloud, const std::string& tf_error) {
  std::vector<std::string> frame_ids = neededFrames(live_parameters_);
  frame_ids.push_back(cloud->header.frame_id);
  const bool has_tf = std::all_of(frame_ids.begin(), frame_ids.end(), [&](const auto& frame_id) {
    return tf_buffer_.canTransform(withoutSlash(parameters_.frame_id), withoutSlash(frame_id),
                                   cloud->header.stamp);
  });
  // Not back to the filter, which would let it pass at once, again and again.
  if (has_tf) return drop(DropReason::kNoTransform, tf_error);
  tf_filter_.add(cloud);
}

void MappingNode::integrate(const sensor_msgs::PointCloud2& cloud, const CloudPoses& poses) {
  Stopwatch whole;
  std::optional<CloudError> error;
  const cuboid_mapping::ScanUpdate* update = pipeline_->compute(cloud, poses, statistics_, error);
  if (update == nullptr) return drop(toDropReason(error->defect), error->text);
  Stopwatch stopwatch;
  map_.change(cloud.header.stamp,
              [update](cuboid_mapping::CuboidMap& map) { return map.apply(*update); });
  statistics_.apply_time.add(stopwatch.lap());
  ++statistics_.num_inserted;
  last_progress_ = Clock::now();
  speed_watch_.noteInserted(1e-3 * whole.lap(), statistics_.reach_m);
  giveAdvice();
  is_cloud_waiting_ = cloud_queue_.size() > 0;
  fuse_timer_.stop();
  fuse_timer_.start();
}

/// Cells fuse after every cloud, in the time until the next one comes; what is left then waits, at
/// most until the next publish.
void MappingNode::fuseUntilNextCloud() {
  while (!is_cloud_waiting_ && map_.fuseSome()) {
  }
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

/// tf may have noticed a jump of time by itself meanwhile, by its clock.
void MappingNode::releaseHeldCloudIfTfIsRight() {
  if (held_cloud_ != nullptr && !isTfOutdated(held_cloud_->header)) releaseHeldCloud();
}

void MappingNode::setTargetFrames() {
  std::vector<std::string> target_frames = neededFrames(live_parameters_);
  target_frames.push_back(parameters_.frame_id);
  tf_filter_.setTargetFrames(target_frames);
}

void MappingNode::reconfigure(const NodeParameters& parameters) {
  live_parameters_ = parameters;
  speed_watch_ = SpeedWatch(parameters.map.resolution_m, parameters.max_range_m);
  setTargetFrames();
  pipeline_.emplace(parameters);
  map_.edit([&](cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
    return map.setSensorModel(parameters.map.sensor_model);
  });
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

void MappingNode::publish() {
  updateColorSpan();
  const cuboid_mapping::ChangeSet changes = map_publisher_.publish();
  for (MarkerPublisher* publisher : {&occupied_publisher_, &free_publisher_}) {
    publisher->noteChanges(changes);
    publisher->publish();
  }
  octomap_server_.noteChanges(changes);
  octomap_server_.publish();
}

bool MappingNode::onReset(std_srvs::Empty::Request& /*request*/,
                          std_srvs::Empty::Response& /*response*/) {
  map_.change(ros::Time(), [](cuboid_mapping::CuboidMap& map) { return map.clear(); });
  publish();
  ROS_INFO_NAMED(kNodeName, "map cleared");
  return true;
}

void MappingNode::drop(DropReason reason, const std::string& text) {
  ++statistics_.numDropped(reason);
  auto& last_logged = last_logged_[static_cast<std::size_t>(reason)];
  const Clock::time_point now = Clock::now();
  if (last_logged && now - *last_logged < kLogPeriod) return;
  last_logged = now;
  ROS_WARN_STREAM_NAMED(kNodeName, "cloud dropped, " << toString(reason) << ": " << text << " ("
                                                     << statistics_.numDropped(reason)
                                                     << " for this reason so far)");
}

LastCloud MappingNode::describeLastCloud() const {
  LastCloud cloud;
  cloud.frame_id = last_header_.frame_id;
  cloud.age_s = (last_arrival_ - last_header_.stamp).toSec();
  // NOLINTNEXTLINE(bugprone-unused-return-value): only the reason for no pose is wanted.
  (void)lookupPoses(tf_buffer_, live_parameters_, last_header_, cloud.tf_error);
  return cloud;
}

void MappingNode::reportDiagnostics(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const auto seconds_since = [](Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
  };
  NodeReport report;
  report.statistics = statistics_;
  report.map = map_.read([](const cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
    return summarize(map);
  });
  report.cloud_topic = cloud_topic_;
  report.frame_id = withoutSlash(parameters_.frame_id);
  if (statistics_.num_received > 0) report.last_cloud = describeLastCloud();
  report.num_publishers = cloud_subscriber_.getSubscriber().getNumPublishers();
  report.is_simulated_time = ros::Time::isSimTime();
  report.silence_s = seconds_since(last_received_);
  if (report.is_simulated_time && report.num_publishers > 0) {
    report.silence_s = (ros::Time::now() - last_arrival_).toSec();  // a bag may be paused
  }
  report.starved_s = seconds_since(last_progress_);
  report.num_built = octomap_server_.numBuilt();
  report.rate_hz = speed_watch_.rateHz();
  report.speed_advice = speed_watch_.advice();
  report.autosave_error = map_files_->autosaveError();
  fillStatus(report, reported_statistics_, status);
  reported_statistics_ = statistics_;
}

}  // namespace cuboid_mapping_ros
