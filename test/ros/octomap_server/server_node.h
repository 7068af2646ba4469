// SPDX-License-Identifier: BSD-3-Clause
// One of several running nodes, each in its own namespace, and its messages about a cloud.
#pragma once

#include "ros/octomap_server/octomap_probe.h"
#include "support/snapshots.h"

#include <nav_msgs/OccupancyGrid.h>
#include <visualization_msgs/MarkerArray.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

using cuboid_mapping::Cell;
using Points = std::vector<Eigen::Vector3d>;

/// Place of the frame "lidar" in the map: the middle of a voxel.
const Eigen::Vector3d kOriginOfLidar(0.05, 0.05, 0.05);

/// The voxels that contain points.
inline std::set<Cell> cellsOf(const Points& points, double resolution_m = kResolution_m) {
  const cuboid_mapping::Grid grid(resolution_m);
  std::set<Cell> cells;
  for (const Eigen::Vector3d& point : points) cells.insert(grid.toCell(point).value());
  return cells;
}

inline std_msgs::Header headerOf(const visualization_msgs::MarkerArray& array) {
  return array.markers.empty() ? std_msgs::Header() : array.markers.front().header;
}
template <typename MessageT>
const std_msgs::Header& headerOf(const MessageT& message) {
  return message.header;
}

/// The cells of a grid that have this value, with z = 0.
inline std::set<Cell> cellsOf(const nav_msgs::OccupancyGrid& grid, int value) {
  const auto toCell = [&](double origin_m) {
    return static_cast<std::int32_t>(std::lround(origin_m / grid.info.resolution));
  };
  const Cell least{toCell(grid.info.origin.position.x), toCell(grid.info.origin.position.y), 0};
  const auto width = static_cast<std::int32_t>(grid.info.width);
  std::set<Cell> cells;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(grid.data.size()); ++i) {
    if (grid.data[static_cast<std::size_t>(i)] == value) {
      cells.insert(least + Cell{i % width, i / width, 0});
    }
  }
  return cells;
}

/// The lidar's origin, with another value of one coordinate.
inline Eigen::Vector3d pointAlong(int axis, double at_m) {
  Eigen::Vector3d point = kOriginOfLidar;
  point[axis] = at_m;
  return point;
}

inline Points pointsOf(const sensor_msgs::PointCloud2& cloud) {
  Points points;
  for (sensor_msgs::PointCloud2ConstIterator<float> xyz(cloud, "x"); xyz != xyz.end(); ++xyz) {
    points.emplace_back(xyz[0], xyz[1], xyz[2]);
  }
  return points;
}

/// Centres of the cubes of all sizes.
inline Points pointsOf(const visualization_msgs::MarkerArray& array) {
  Points points;
  for (const auto& marker : array.markers) {
    for (const auto& point : marker.points) points.emplace_back(point.x, point.y, point.z);
  }
  return points;
}

/// A node `/NAME/octomap_server` with an empty map and its own clouds.
class ServerNode {
 public:
  explicit ServerNode(const std::string& name)
      : name_("/" + name), clouds_(nh_.advertise<sensor_msgs::PointCloud2>(topic("cloud_in"), 10)) {
    EXPECT_TRUE(waitFor([this] { return clouds_.getNumSubscribers() > 0; })) << name;
    reset();
  }

  [[nodiscard]] std::string topic(const std::string& name) const { return name_ + '/' + name; }

  void reset() {
    std_srvs::Empty empty;
    const std::string service = topic("octomap_server/reset");
    EXPECT_TRUE(ros::service::waitForService(service, ros::Duration(kDeadline_s)));
    EXPECT_TRUE(callService(service, empty));
  }

  /// Sends a cloud of points given in the frame of the map, and waits until it is mapped.
  void insert(const Points& points_map) {
    static double latest_s = 100.0;
    stamp_ = ros::Time(++latest_s);
    Points points_lidar = points_map;
    for (Eigen::Vector3d& point : points_lidar) point -= kOriginOfLidar;
    clouds_.publish(makeCloud("lidar", stamp_, points_lidar));
    EXPECT_TRUE(waitFor([this] {
      octomap_msgs::GetOctomap get;
      return callService(topic("octomap_full"), get) && get.response.map.header.stamp == stamp_;
    })) << name_;
  }

  /// Stamp of the last cloud.
  [[nodiscard]] const ros::Time& stamp() const { return stamp_; }

  [[nodiscard]] octomap_msgs::Octomap octomap() const { return callOctomap(topic("octomap_full")); }

  /// The log-odds of all known voxels.
  [[nodiscard]] std::map<Cell, float> voxels() const {
    std::map<Cell, float> voxels;
    for (const auto& leaf : contentOf(octomap()).leaves) {
      cuboid_mapping::test::visitCells(
          leaf.box, [&](const Cell& cell) { voxels.emplace(cell, leaf.log_odds); });
    }
    return voxels;
  }
  [[nodiscard]] std::set<Cell> occupied() const { return cellsOfClass(true); }
  [[nodiscard]] std::set<Cell> free() const { return cellsOfClass(false); }

  /// The message of a topic about the last cloud.
  template <typename MessageT>
  MessageT show(const std::string& name) {
    TopicProbe<MessageT> probe(topic(name));
    EXPECT_TRUE(probe.waitForMessage([this](const MessageT& message) {
      return headerOf(message).stamp == stamp_;
    })) << topic(name);
    return probe.last();
  }

 private:
  [[nodiscard]] std::set<Cell> cellsOfClass(bool is_occupied) const {
    std::set<Cell> cells;
    for (const auto& [cell, log_odds] : voxels()) {
      if ((log_odds >= 0.0F) == is_occupied) cells.insert(cell);
    }
    return cells;
  }

  std::string name_;
  ros::NodeHandle nh_;
  ros::Publisher clouds_;
  ros::Time stamp_;
};

}  // namespace cuboid_mapping_ros::test
