// SPDX-License-Identifier: BSD-3-Clause
// Messages of rosbags, which may be damaged: readable parts are read, others are counted.
#pragma once

#include <ros/message_traits.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <cstddef>
#include <exception>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Whether a file begins as a rosbag of ROS 1.
[[nodiscard]] bool isRosbag(const std::string& file);

/// A topic with a leading slash, as recorders write it.
[[nodiscard]] std::string withSlash(const std::string& topic);

/// A message in one of several bags.
struct BagMessage {
  std::size_t bag;
  rosbag::MessageInstance instance;
};

/// Rosbags that are read at the same time.
class BagFiles {
 public:
  /// @throws std::runtime_error naming the file, its error, and the cure.
  explicit BagFiles(const std::vector<std::string>& files);

  [[nodiscard]] std::size_t size() const { return bags_.size(); }
  [[nodiscard]] const rosbag::Bag& operator[](std::size_t number) const {
    return *bags_[number].bag;
  }

  /// The messages on some topics of all bags, in the order of recording.
  [[nodiscard]] std::vector<BagMessage> collect(const std::vector<std::string>& topics) const;

  /// Reads a message; null if it has another type, or cannot be read, which is counted.
  template <typename MessageT>
  [[nodiscard]] boost::shared_ptr<MessageT> read(const BagMessage& message) {
    boost::shared_ptr<MessageT> read;
    access(message, [&] {
      read = message.instance.instantiate<MessageT>();
      const std::string& type = message.instance.getDataType();
      if (read || type != ros::message_traits::datatype<MessageT>()) return;
      throw std::runtime_error(type + " has another definition there: try rosbag fix");
    });
    return read;
  }

  /// The stamp of a message that begins with a header; 0 when it cannot be read.
  [[nodiscard]] ros::Time readStamp(const BagMessage& message);

  /// Messages that could not be read, as text for addFailures() in another process with the same bags.
  [[nodiscard]] std::string failures() const;
  void addFailures(const std::string& failures);
  /// One line for each bag with messages that could not be read.
  [[nodiscard]] std::vector<std::string> describeDamage() const;

 private:
  struct File {
    std::unique_ptr<rosbag::Bag> bag;
    bool has_failed = false;  ///< The last access has failed.
    /// Time of recording and topic of failed messages.
    std::set<std::pair<ros::Time, std::string>> failures;
    std::string error;  ///< Error of the first failure.
    /// First and last message of the bag, once they were needed.
    std::vector<rosbag::MessageInstance> ends;
  };

  template <typename ReadT>
  void access(const BagMessage& message, const ReadT& read_message) {
    try {
      read_message();
      bags_[message.bag].has_failed = false;
    } catch (const std::exception& error) {
      noteFailure(message, error.what());
    }
  }
  void noteFailure(const BagMessage& message, const std::string& error);
  static void refresh(File& file);

  std::vector<File> bags_;
};

}  // namespace cuboid_mapping_ros
