// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <functional>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// The least rectangle of a grid with all cells that differ from an older one; its data are empty when
/// none does. Nothing when the grids have other sizes, origins or frames: an update cannot say that.
[[nodiscard]] std::optional<map_msgs::OccupancyGridUpdate> findGridUpdate(
    const nav_msgs::OccupancyGrid& older, const nav_msgs::OccupancyGrid& grid);

/// Publishes a grid, whole or what of it has changed, as the static layer of costmap_2d takes it.
///
/// The whole grid is sent when its size, origin or frame is another one, after somebody has connected, and each time
/// as long as not all listeners take updates. While nobody listens nothing is built.
/// Thread rule: all calls, and the queue of the node handle, are of one thread.
class GridPublisher {
 public:
  /// @return Nothing where there is no grid now.
  using Make = std::function<std::optional<nav_msgs::OccupancyGrid>()>;
  struct Topics {
    std::string grid;
    std::string updates;
  };

  /// @param is_latched  Who connects is sent the grid at once.
  GridPublisher(ros::NodeHandle nh, const Topics& topics, bool is_latched, Make make);
  GridPublisher(const GridPublisher&) = delete;
  GridPublisher& operator=(const GridPublisher&) = delete;

  /// Publishes the grid as it is now, where somebody listens.
  void publish();

 private:
  Make make_;
  std::optional<nav_msgs::OccupancyGrid> sent_;  ///< What all listeners have; nothing: not all.
  ros::Publisher updates_publisher_;
  ros::Publisher publisher_;  ///< Last: it calls back.
};

}  // namespace cuboid_mapping_ros
