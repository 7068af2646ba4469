// SPDX-License-Identifier: BSD-3-Clause
// Corrected poses of a body, which replace the poses of tf.
#pragma once

#include "bag_files.h"
#include "bag_topics.h"
#include "cuboid_mapping/history/pose_track.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"

#include <string>

namespace cuboid_mapping_ros {

/// Poses of a body in the frame of the map.
struct BagPoses {
  cuboid_mapping::PoseTrack track;
  std::string map_frame_id;   ///< Frame in the messages of a topic; empty for a file.
  std::string body_frame_id;  ///< Frame in the messages of a topic; empty: that of the clouds.
  std::string note;           ///< A line that names the source.
};

/// The poses of a file (readPoseFile()), or of a topic of the bags: the last nav_msgs/Path, or all
/// nav_msgs/Odometry or geometry_msgs/PoseStamped. @throws std::runtime_error  naming the error, and the
/// available topics.
[[nodiscard]] BagPoses readBagPoses(BagFiles& bags, const BagTopics& topics,
                                    const std::string& file_or_topic, double max_gap_s);

/// As findPoses(), with the poses of a body: tf has the sensors' poses on it. Nothing outside the poses, as for
/// tf. @param body_frame_id  Empty: the cloud's frame.
[[nodiscard]] PoseSearch findPosesOn(const cuboid_mapping::PoseTrack& track,
                                     const std::string& body_frame_id, const TfBuffer& tf,
                                     PoseFrames frames, const std_msgs::Header& header,
                                     const Slices& slices);

}  // namespace cuboid_mapping_ros
