// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <memory>
#include <string>

namespace cuboid_mapping_ros {

/// A rosbag that is being written, see writeBag(). All functions throw std::runtime_error naming the file and the
/// reason if it cannot be written.
class BagOutput {
 public:
  /// @param file  Name for messages.
  BagOutput(std::string file, const std::string& partial_file);
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

  /// Finishes the file.
  void close();

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
  std::unique_ptr<rosbag::Bag> bag_;  ///< Empty after close().
};

/// Replaces a file by a rosbag, all of it or none, as replaceFile() does.
/// @param write  Writes the messages; its exceptions are passed on.
void writeBag(const std::string& file, const std::function<void(BagOutput&)>& write);

}  // namespace cuboid_mapping_ros
