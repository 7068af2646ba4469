// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <memory>
#include <string>

namespace cuboid_mapping_ros {

/// A rosbag that is there when it is complete, or not at all.
///
/// Messages go to FILE.partial, which becomes FILE in commit(), and is removed when the object ends
/// without it. All functions throw std::runtime_error naming the file and the reason when it
/// cannot be written.
class BagOutput {
 public:
  /// Opens the partial file. A file of the final name stays until commit() replaces it.
  explicit BagOutput(std::string file);
  ~BagOutput();
  BagOutput(const BagOutput&) = delete;
  BagOutput& operator=(const BagOutput&) = delete;

  /// Appends a message.
  /// @param time  When it was received: the order of playing.
  template <typename MessageT>
  void write(const std::string& topic, const ros::Time& time, const MessageT& message) {
    guard([&] { bag_->write(topic, time, message); });
  }

  /// As write, for a topic that `rosbag play` shall latch: late subscribers get the last message.
  /// @param node  Name of the publishing node.
  template <typename MessageT>
  void writeLatched(const std::string& topic, const ros::Time& time, const MessageT& message,
                    const std::string& node) {
    namespace traits = ros::message_traits;
    auto header = boost::make_shared<ros::M_string>();
    (*header)["topic"] = topic;
    (*header)["type"] = traits::datatype(message);
    (*header)["md5sum"] = traits::md5sum(message);
    (*header)["message_definition"] = traits::definition(message);
    (*header)["callerid"] = node;
    (*header)["latching"] = "1";
    guard([&] { bag_->write(topic, time, message, header); });
  }

  /// Appends a cloud behind the transform of its frame at its stamp: players sort by time, and so
  /// the transform is there first.
  void writeCloud(const std::string& topic, const sensor_msgs::PointCloud2& cloud,
                  const tf2_msgs::TFMessage& transform);

  /// Finishes the file and gives it its name.
  void commit();

 private:
  template <typename ActionT>
  void guard(const ActionT& action) {
    try {
      action();
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("cannot write " + file_ + ": " + error.what());
    }
  }

  std::string file_;
  std::string partial_file_;
  std::unique_ptr<rosbag::Bag> bag_;  ///< Empty after commit().
};

}  // namespace cuboid_mapping_ros
