// SPDX-License-Identifier: BSD-3-Clause
#include "bag_output.h"

#include "cuboid_mapping/io/file_replacement.h"

#include <utility>

namespace cuboid_mapping_ros {

BagOutput::BagOutput(std::string file, const std::string& partial_file)
    : file_(std::move(file)), bag_(std::make_unique<rosbag::Bag>()) {
  guard([&] { bag_->open(partial_file, rosbag::bagmode::Write); });
}

BagOutput::~BagOutput() {
  if (!bag_) return;
  try {
    bag_->close();
  } catch (const rosbag::BagException&) {
    // The destructor of the bag would close it again, throw again, and end the program.
    [[maybe_unused]] const rosbag::Bag* const given_up = bag_.release();
  }
}

void BagOutput::writeCloud(const std::string& topic, const sensor_msgs::PointCloud2& cloud,
                           const tf2_msgs::TFMessage& transform) {
  const ros::Duration delay(0, 1000);
  write("/tf", cloud.header.stamp, transform);
  write(topic, cloud.header.stamp + delay, cloud);
}

void BagOutput::close() {
  guard([&] { bag_->close(); });
  bag_.reset();
}

void writeBag(const std::string& file, const std::function<void(BagOutput&)>& write) {
  cuboid_mapping::replaceFile(file, [&](const std::string& partial_file) {
    BagOutput bag(file, partial_file);
    write(bag);
    bag.close();
  });
}

}  // namespace cuboid_mapping_ros
