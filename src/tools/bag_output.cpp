// SPDX-License-Identifier: BSD-3-Clause
#include "bag_output.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cuboid_mapping_ros {

namespace fs = std::filesystem;

BagOutput::BagOutput(std::string file)
    : file_(std::move(file)),
      partial_file_(file_ + ".partial"),
      bag_(std::make_unique<rosbag::Bag>()) {
  if (fs::is_directory(file_))
    throw std::runtime_error("cannot write " + file_ + ": it is a folder");
  errno = 0;
  try {
    bag_->open(partial_file_, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
    const int code = errno;
    throw std::runtime_error("cannot write " + file_ + ": " +
                             (code != 0 ? std::strerror(code) : error.what()));
  }
}

BagOutput::~BagOutput() {
  if (!bag_) return;
  try {
    bag_->close();
  } catch (const rosbag::BagException&) {
    // The destructor of the bag would close it again, throw again, and end the program.
    [[maybe_unused]] const rosbag::Bag* const given_up = bag_.release();
  }
  std::error_code ignored;
  fs::remove(partial_file_, ignored);
}

void BagOutput::writeCloud(const std::string& topic, const sensor_msgs::PointCloud2& cloud,
                           const tf2_msgs::TFMessage& transform) {
  const ros::Duration delay(0, 1000);
  write("/tf", cloud.header.stamp, transform);
  write(topic, cloud.header.stamp + delay, cloud);
}

void BagOutput::commit() {
  guard([&] { bag_->close(); });
  std::error_code error;
  fs::rename(partial_file_, file_, error);
  if (error) throw std::runtime_error("cannot write " + file_ + ": " + error.message());
  bag_.reset();
}

}  // namespace cuboid_mapping_ros
