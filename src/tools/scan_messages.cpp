// SPDX-License-Identifier: BSD-3-Clause
#include "scan_messages.h"

#include <tf2_eigen/tf2_eigen.h>

#include <filesystem>

namespace cuboid_mapping_ros {

geometry_msgs::TransformStamped toTransformMessage(const Eigen::Isometry3d& T_map_sensor,
                                                   const ros::Time& stamp, const ScanNames& names) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_map_sensor);
  message.header.stamp = stamp;
  message.header.frame_id = names.map_frame;
  message.child_frame_id = names.sensor_frame;
  return message;
}

bool ScanFolders::isOne(const std::string& path) {
  namespace fs = std::filesystem;
  return fs::is_directory(path) || fs::path(path).extension() == ".graph";
}

ScanFolders::ScanFolders(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    datasets_.push_back(cuboid_mapping::openScanDataset(path));
    size_ += datasets_.back()->size();
  }
}

cuboid_mapping::ScanDataset::Item ScanFolders::read(std::size_t number) const {
  auto dataset = datasets_.begin();
  for (; number >= (*dataset)->size(); ++dataset) number -= (*dataset)->size();
  return (*dataset)->read(number);
}

}  // namespace cuboid_mapping_ros
