// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/corrections/pose_corrections.h"

#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/ros/conversions/pose_messages.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <ros/console.h>

#include <exception>
#include <new>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {

std::unique_ptr<KeptHistory> makeHistory(const NodeParameters& parameters, GuardedMap& map) {
  const MapConfig config = map.config();
  const HistoryLimits limits{static_cast<std::uint64_t>(parameters.keep.memory_mb) * 1000000};
  auto history =
      std::make_unique<KeptHistory>(config, config.resolution_m / kKeptStepsPerVoxel, limits);
  if (parameters.window.isOn()) {
    CuboidMap whole(config);
    restoreSnapshot(takeWholeSnapshot(map, "", limitsOfMachine()), whole);
    history->restart(whole);
  } else {
    const auto restart = [&](const CuboidMap& content) { history->restart(content); };
    map.readWhole(restart);
  }
  return history;
}

PoseCorrections::PoseCorrections(const MapHost& host)
    : host_(host),
      map_(host.map),
      frame_id_(withoutSlash(host.parameters.frame_id)),
      tolerance_m_(0.5 * host.parameters.map.resolution_m),
      thread_(host.guard, "corrections") {
  map_.setHistory(makeHistory(host.parameters, map_));
  server_ = offerService<CorrectPoses>(
      withQueue(host.private_nh, thread_.queue()), kCorrectPosesService,
      [this](const auto& request, auto& response) { answer(request, response); });
  subscriber_ =
      subscribeTo<nav_msgs::Path>(withQueue(host.nh, thread_.queue()), kCorrectedPathTopic, 1,
                                  [this](const auto& path) { onPath(*path); });
  thread_.start();
}

PoseCorrections::~PoseCorrections() { thread_.stop(); }

void PoseCorrections::report(NodeReport& report) {
  report.kept = map_.history()->figures();
  report.kept_error = map_.history()->error();
}

void PoseCorrections::answer(const CorrectPoses::Request& request,
                             CorrectPoses::Response& response) {
  const CorrectionRule rule{
      request.outside_stays != 0 ? OutsidePoses::kStay : OutsidePoses::kFollow, request.tolerance,
      request.edits_move != 0};
  correct(request.path, rule, std::nullopt, response);
}

void PoseCorrections::onPath(const nav_msgs::Path& path) {
  if (path.poses.empty()) return;  // SLAM that has just started has no poses yet.
  CorrectPoses::Response unused;
  correct(path, {OutsidePoses::kFollow, tolerance_m_}, tolerance_m_, unused);
}

PoseTrack PoseCorrections::readPath(const nav_msgs::Path& path) const {
  const std::string frame_id = withoutSlash(path.header.frame_id);
  if (!frame_id.empty() && frame_id != frame_id_) {
    throw std::invalid_argument("the path is in frame '" + frame_id + "', the map in '" +
                                frame_id_ +
                                "': give poses in the frame of the map, or set frame_id to that of "
                                "the path");
  }
  return PoseTrack(tidyPoses(toStampedPoses(path)), host_.parameters.tf_gap_s);
}

void PoseCorrections::correct(const nav_msgs::Path& path, const CorrectionRule& rule,
                              std::optional<double> ignored_shift_m,
                              CorrectPoses::Response& response) {
  std::string error;
  const ros::SteadyTime begin = ros::SteadyTime::now();
  try {
    const PoseTrack poses = readPath(path);
    if (ignored_shift_m) {
      if (map_.history()->figures().num_clouds == 0) return;
      const auto shift_m = map_.history()->whole().findShift_m(poses, kShiftDistance_m);
      // Clouds may begin after the last pose: the refusal of such a path is logged once.
      if (std::exchange(is_without_clouds_, !shift_m) && !shift_m) return;
      if (shift_m && *shift_m <= *ignored_shift_m) return;
    }
    correctMap(poses, rule, response);
  } catch (const std::bad_alloc&) {
    error = "there is not enough memory for a second map";
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  response.seconds = (ros::SteadyTime::now() - begin).toSec();
  response.info = makeInfo(map_, frame_id_, error);
  if (!error.empty()) {
    constexpr double kPeriod_s = 10.0;  // A topic may repeat its messages.
    ROS_ERROR_STREAM_THROTTLE_NAMED(kPeriod_s, kNodeName, "poses not corrected: " << error);
    return;
  }
  ROS_INFO_STREAM_NAMED(kNodeName, "poses corrected: " << response.clouds
                                                       << " kept clouds, greatest shift "
                                                       << response.max_shift << " m, in "
                                                       << response.seconds << " s");
  host_.note_replaced();
  host_.publish_soon();
}

void PoseCorrections::correctMap(const PoseTrack& poses, const CorrectionRule& rule,
                                 CorrectPoses::Response& response) {
  constexpr std::size_t kFew = 2;  // Clouds that keep others waiting for the map.
  const auto listener = endWhen(host_.is_stopping);
  auto& history = map_.history()->whole();
  MapCorrection correction = history.begin(poses, rule);
  while (history.catchUp(correction, listener) > kFew) {
  }
  map_.exchange(correction);
  response.clouds = static_cast<std::uint32_t>(correction.numClouds());
  response.outside = static_cast<std::uint32_t>(correction.numOutside());
  response.max_shift = correction.maxShift_m();
}

std::vector<ParameterDeclaration> PoseCorrections::declare() {
  using P = NodeParameters;
  return {
      {"keep_clouds/memory", "MB", integer({&P::keep, &KeepParameters::memory_mb}, 0, 1000000),
       "Memory for kept clouds, from which ~correct_poses and corrected_path rebuild the map. A "
       "point takes 1 to 2 bytes, and is rounded to a sixteenth of a voxel. When the memory is "
       "full, the oldest clouds become a fixed part of the map. A rebuild needs memory for a "
       "second whole map, also with a window. 0: no cloud is kept."},
      {"keep_clouds/body_frame", "", frame({&P::keep, &KeepParameters::body_frame}, true),
       "Frame whose poses corrected_path and ~correct_poses give, such as base_link. Empty: the "
       "frame of each cloud. A path on corrected_path moves a cloud only if a point 10 m from the "
       "body moves by more than half a voxel."},
  };
}

std::vector<ParameterError> PoseCorrections::check(const LoadedParameters& loaded) {
  const NodeParameters& parameters = loaded.parameters;
  if (!parameters.keep.isOn()) return {};
  std::vector<ParameterError> errors;
  const auto refuse = [&](const std::string& key, const std::string& why) {
    errors.push_back(
        {"keep_clouds/memory", "does not go with " + key + ": " + why + ". Change one of them"});
  };
  if (!parameters.robots.empty()) {
    refuse("merge/robots", "this node does not get the robots' clouds");
  }
  if (parameters.source.forget_after_s > 0.0) {
    refuse("forget_after", "a rebuilt map would have the forgotten voxels again");
  }
  if (parameters.moving_points == MovingPoints::kLeaveOut) {
    refuse("moving_points: leave_out", "which points move depends on the poses");
  }
  if (parameters.window.isOn() && !parameters.window.keeps()) {
    refuse("this window/outside", "voxels outside would come back");
  }
  return errors;
}

}  // namespace cuboid_mapping_ros
