// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/publishers/latched_topic.h"

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>
#include <ros/time.h>

#include <functional>
#include <optional>
#include <set>
#include <string>

namespace cuboid_mapping_ros {

/// The least rectangle of a grid with all cells that differ from an older one; its data are empty when
/// none does. Nothing when the grids have other sizes, origins or frames: an update cannot say that.
[[nodiscard]] std::optional<map_msgs::OccupancyGridUpdate> findGridUpdate(
    const nav_msgs::OccupancyGrid& older, const nav_msgs::OccupancyGrid& grid);

/// Publishes a grid, whole or what of it has changed, as the static layer of costmap_2d takes it.
///
/// The whole grid is sent when its size, origin or frame changes, to a new connection, with each change while a node
/// that listens to it takes no updates, and as a keyframe. While nobody listens nothing is built.
/// Thread rule: all calls, and the queue of the node handle, are of one thread.
class GridPublisher {
 public:
  /// @return Nothing where there is no grid now.
  using Make = std::function<std::optional<nav_msgs::OccupancyGrid>()>;
  struct Options {
    std::string grid;     ///< Topic.
    std::string updates;  ///< Topic.
    bool is_latched = true;
    double keyframe_period_s = 0.0;  ///< 0: no keyframes.
  };

  GridPublisher(const ros::NodeHandle& nh, const Options& options, Make make);
  GridPublisher(const GridPublisher&) = delete;
  GridPublisher& operator=(const GridPublisher&) = delete;

  /// Publishes the grid as it is now, where somebody listens.
  void publish();
  /// To be called now and then: sends the whole grid when updates have been sent since it was, and the period is over.
  void publishKeyframe();

 private:
  void publishWhole(const nav_msgs::OccupancyGrid& grid);
  [[nodiscard]] bool allTakeUpdates() const;

  Make make_;
  std::optional<nav_msgs::OccupancyGrid> sent_;  ///< Held by all listeners; else nothing.
  std::multiset<std::string> nodes_;             ///< That listen to the grid, by connection.
  std::multiset<std::string> update_nodes_;      ///< That listen to updates.
  bool owes_keyframe_ = false;
  ros::WallTime last_whole_;
  ros::WallDuration keyframe_period_;
  // Last: they call back.
  LatchedTopic<map_msgs::OccupancyGridUpdate> updates_topic_;
  LatchedTopic<nav_msgs::OccupancyGrid> topic_;
};

}  // namespace cuboid_mapping_ros
