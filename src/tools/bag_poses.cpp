// SPDX-License-Identifier: BSD-3-Clause
#include "bag_poses.h"

#include "cuboid_mapping/geometry/rounded_transform.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/pose_messages.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/middleware/to_and_fro.h"
#include "pose_file.h"

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>

#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::PoseTrack;
using cuboid_mapping::roundTransform;
using cuboid_mapping::StampedPose;

/// Poses gathered from a topic.
struct Gathered {
  std::vector<StampedPose> poses;
  std::string map_frame_id;
  std::string body_frame_id;
};

void addMessage(const BagMessage& message, BagFiles& bags, Gathered& gathered) {
  const std::string& type = message.instance.getDataType();
  if (type == "nav_msgs/Path") {
    const auto path = bags.read<nav_msgs::Path>(message);
    if (!path) return;
    gathered = {toStampedPoses(*path), path->header.frame_id, ""};
  } else if (type == "nav_msgs/Odometry") {
    const auto odometry = bags.read<nav_msgs::Odometry>(message);
    if (!odometry) return;
    gathered.map_frame_id = odometry->header.frame_id;
    gathered.body_frame_id = odometry->child_frame_id;
    gathered.poses.push_back(toStampedPose(odometry->header.stamp, odometry->pose.pose));
  } else if (const auto pose = bags.read<geometry_msgs::PoseStamped>(message)) {
    gathered.map_frame_id = pose->header.frame_id;
    gathered.poses.push_back(toStampedPose(pose->header.stamp, pose->pose));
  }
}

bool hasPoses(const BagTopic& topic) {
  return topic.datatype == "nav_msgs/Path" || topic.datatype == "nav_msgs/Odometry" ||
         topic.datatype == "geometry_msgs/PoseStamped";
}

Gathered readTopic(BagFiles& bags, const BagTopics& topics, const std::string& given) {
  const std::string name = withSlash(given);
  const BagTopic* topic = topics.find(name);
  if (topic == nullptr || !hasPoses(*topic)) {
    std::vector<std::string> others;
    for (const auto& [other, its] : topics.all()) {
      if (hasPoses(its)) others.push_back(other);
    }
    throw std::runtime_error(
        "--poses " + given +
        ": there is no such file, and no topic with poses (nav_msgs/Path, "
        "nav_msgs/Odometry, geometry_msgs/PoseStamped) of this name; the bags have " +
        (others.empty() ? "none" : cuboid_mapping::join(others, ", ")));
  }
  Gathered gathered;
  for (const BagMessage& message : bags.collect({name, name.substr(1)})) {
    addMessage(message, bags, gathered);
  }
  return gathered;
}

bool areOfTwoRuns(std::vector<StampedPose> poses) {
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  ToAndFro jumps;
  for (const StampedPose& pose : poses) jumps.add(pose.T_map_body.translation());
  return jumps.isSeen();
}

std::string describe(const PoseTrack& track, const std::string& name) {
  std::ostringstream text;
  text << "takes " << cuboid_mapping::counted(track.size(), "pose") << " of " << name << ", from "
       << std::fixed << std::setprecision(3) << 1e-9 * static_cast<double>(track.begin_ns())
       << " to " << 1e-9 * static_cast<double>(track.end_ns()) << " s";
  return text.str();
}

}  // namespace

BagPoses readBagPoses(BagFiles& bags, const BagTopics& topics, const std::string& file_or_topic,
                      double max_gap_s) {
  std::error_code ignored;
  Gathered gathered;
  std::size_t num_left_out = 0;
  if (std::filesystem::is_regular_file(file_or_topic, ignored)) {
    gathered.poses = cuboid_mapping::readPoseFile(file_or_topic);
  } else {
    gathered = readTopic(bags, topics, file_or_topic);
    const std::size_t num_poses = gathered.poses.size();
    if (areOfTwoRuns(gathered.poses)) {
      throw std::runtime_error("--poses " + file_or_topic +
                               ": the poses jump to and fro between two places, as those of two "
                               "runs. Map each run by itself, and merge the maps with map_merge");
    }
    gathered.poses = tidyPoses(std::move(gathered.poses));
    num_left_out = num_poses - gathered.poses.size();
  }
  try {
    PoseTrack track(std::move(gathered.poses), max_gap_s);
    std::string note = describe(track, file_or_topic);
    if (num_left_out > 0) {
      note += "; leaves out " + std::to_string(num_left_out) +
              " that come twice, or are no numbers, rotations or times";
    }
    return {std::move(track), withoutSlash(gathered.map_frame_id),
            withoutSlash(gathered.body_frame_id), std::move(note)};
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("--poses " + file_or_topic + ": " + error.what());
  }
}

PoseSearch findPosesOn(const PoseTrack& track, const std::string& body_frame_id, const TfBuffer& tf,
                       PoseFrames frames, const std_msgs::Header& header, const Slices& slices) {
  frames.map = body_frame_id.empty() ? header.frame_id : body_frame_id;
  PoseSearch search = findPoses(tf, frames, header, slices);
  if (!search.poses) return search;
  const auto move = [&](CloudPoses& part, const ros::Time& stamp) {
    const auto stamp_ns = static_cast<std::int64_t>(stamp.toNSec());
    if (!track.covers(stamp_ns)) {
      std::ostringstream text;
      text << "the poses of --poses do not reach to " << stamp << " s";
      search = PoseSearch();
      search.why = text.str();
      return false;
    }
    if (const auto gap = track.findGap(stamp_ns)) {
      std::ostringstream text;
      text.precision(3);
      text << "--poses has no pose for " << 1e-9 * static_cast<double>(gap->end_ns - gap->begin_ns)
           << " s";
      search = PoseSearch();
      search.why = text.str();
      search.hopeless = DropReason::kTfGap;
      return false;
    }
    const Eigen::Isometry3d T_map_body = track.at(stamp_ns);
    part.T_map_cloud = roundTransform(T_map_body * part.T_map_cloud);
    part.T_map_sensor = roundTransform(T_map_body * part.T_map_sensor);
    if (part.body) part.body->T_map_body = roundTransform(T_map_body * part.body->T_map_body);
    part.window_center_map = T_map_body * part.window_center_map;
    for (Eigen::Isometry3d& T_map_step : part.T_map_steps) T_map_step = T_map_body * T_map_step;
    return true;
  };
  CloudPoses poses = *search.poses;
  if (!move(poses, header.stamp)) return search;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    if (!move(poses.slice_poses[i], header.stamp + middleOf(slices[i]))) return search;
  }
  search.poses = std::move(poses);
  return search;
}

}  // namespace cuboid_mapping_ros
