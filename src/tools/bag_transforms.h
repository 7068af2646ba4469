// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bag_files.h"
#include "bag_topics.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"

#include <geometry_msgs/TransformStamped.h>

#include <Eigen/Core>

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// The transforms of some bags. Transforms of /tf are all known at any time; those of /tf_static hold from the
/// time of recording until the next one of the same frame, as in a node; before the first one, the first holds.
class BagTransforms {
 public:
  /// No transforms.
  BagTransforms() = default;

  /// Reads all transforms. @param topic  The topic of /tf, or its namespace, such as "/robot1"; empty: /tf, or
  /// the only other one.
  /// @param added  Static transforms such as "map base x y z yaw pitch roll". @throws std::runtime_error for an invalid
  /// one, or if the bags have no transforms on `topic`.
  void read(BagFiles& bags, const BagTopics& topics, const std::string& topic,
            const std::vector<std::string>& added);

  /// See TfBuffer; to be set before read().
  void setMaxGap(double max_gap_s) { tf_.setMaxGap(max_gap_s); }

  /// Adds a transform of any time.
  void set(const geometry_msgs::TransformStamped& transform) {
    (void)tf_.setTransform(transform, "scans");
  }

  /// Refuses transforms of two runs or two robots: poses between them would be torn. @throws std::runtime_error if the
  /// frame of a sensor, or one above it, jumps to and fro.
  void checkRuns(const BagTopics& topics) const;

  /// Applies static transforms recorded up to a time. @pre It is not before that of the last call.
  void advance(const ros::Time& time);

  [[nodiscard]] const TfBuffer& buffer() const { return tf_; }

  /// Lines that name sources, ignored transforms, and reasons.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct StaticTransform {
    ros::Time recorded;
    geometry_msgs::TransformStamped transform;
  };

  /// Transforms of a moving frame, while the bags are read.
  struct Moving {
    std::vector<std::pair<ros::Time, Eigen::Vector3d>> positions;
    std::set<std::string> files;
  };

  void findRuns(std::map<std::string, Moving>& frames);
  void readTopics(BagFiles& bags, const std::vector<std::string>& topics);
  void setFirstStatics();

  TfBuffer tf_{ros::Duration(1e6)};       // long enough for any bag
  std::vector<StaticTransform> statics_;  ///< Static transforms in the order of their times.
  std::size_t num_taken_ = 0;             ///< Number of static ones taken by advance().
  /// Frames of two runs, and the files of these.
  std::map<std::string, std::set<std::string>> torn_;
  std::vector<std::string> notes_;
};

}  // namespace cuboid_mapping_ros
