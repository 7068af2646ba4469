// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <memory>
#include <string>

namespace cuboid_mapping_ros {

/// A rosbag that exists when it is complete, or not at all.
///
/// Messages go to FILE.partial. commit() renames it to FILE; without commit() the destructor removes
/// it. All functions throw std::runtime_error naming the file and the reason if it
/// cannot be written.
class BagOutput {
 public:
  /// Opens the partial file. An existing file stays until commit() replaces it.
  explicit BagOutput(std::string file);
  ~BagOutput();
  BagOutput(const BagOutput&) = delete;
  BagOutput& operator=(const BagOutput&) = delete;

  /// Appends a message.
  /// @param time  Time of receipt: the order of playing.
  template <typename MessageT>
  void write(const std::string& topic, const ros::Time& time, const MessageT& message) {
    guard([&] { bag_->write(topic, time, message); });
  }

  /// As write, for a topic that `rosbag play` latches: late subscribers get the last message.
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

  /// Appends a cloud after the transform of its frame at its stamp: players sort by time, so
  /// the transform comes first.
  void writeCloud(const std::string& topic, const sensor_msgs::PointCloud2& cloud,
                  const tf2_msgs::TFMessage& transform);

  /// Finishes the file and renames it.
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
