// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
#include "cuboid_mapping/ros/middleware/latched_topic.h"

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>
#include <ros/time.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>

namespace cuboid_mapping_ros {

/// Values of the cells of a nav_msgs/OccupancyGrid.
///@{
constexpr std::int8_t kUnknownCell = -1;
constexpr std::int8_t kFreeCell = 0;
constexpr std::int8_t kOccupiedCell = 100;
///@}

/// Sets place and size of a grid, and makes its cells unknown; empty for an empty extent.
void layOut(const CellBox& extent, double resolution_m, nav_msgs::OccupancyGrid& grid);

/// Update with the smallest rectangle of a grid that has all cells that differ from an older one; without data
/// if none differs. Nothing if size, origin or frame of the grids differ: an update cannot express that.
[[nodiscard]] std::optional<map_msgs::OccupancyGridUpdate> findGridUpdate(
    const nav_msgs::OccupancyGrid& older, const nav_msgs::OccupancyGrid& grid);

/// Publishes a grid, whole or as updates, in the form of the static layer of costmap_2d.
///
/// The whole grid is sent when its size, origin or frame changes, to a new connection, as a keyframe, and at
/// each change while a node subscribes to it without updates. Nothing is built without subscribers.
/// Thread rule: all calls, and the queue of the node handle, belong to one thread.
class GridPublisher {
 public:
  /// @return The current grid; nothing if there is none.
  using Make = std::function<std::optional<nav_msgs::OccupancyGrid>()>;
  struct Options {
    std::string grid;                ///< Topic of grids.
    std::string updates;             ///< Topic of updates.
    double keyframe_period_s = 0.0;  ///< Period in seconds; 0: no keyframes.
  };

  GridPublisher(const ros::NodeHandle& nh, const Options& options, Make make);
  GridPublisher(const GridPublisher&) = delete;
  GridPublisher& operator=(const GridPublisher&) = delete;

  /// Publishes the current grid if there are subscribers.
  void publish();
  /// To be called regularly: sends the whole grid if updates were sent after it, and the period is over.
  void publishKeyframe();

 private:
  void publishWhole(const nav_msgs::OccupancyGrid& grid);
  [[nodiscard]] bool allTakeUpdates() const;

  Make make_;
  std::optional<nav_msgs::OccupancyGrid> sent_;  ///< Grid of all subscribers; else nothing.
  std::multiset<std::string> nodes_;             ///< Subscribed to the grid, once per connection.
  std::multiset<std::string> update_nodes_;      ///< Nodes that subscribe to updates.
  bool owes_keyframe_ = false;
  ros::SteadyTime last_whole_;
  ros::WallDuration keyframe_period_;
  // Last members: their callbacks use the others.
  ros::Publisher updates_topic_;
  LatchedTopic<nav_msgs::OccupancyGrid> topic_;
};

}  // namespace cuboid_mapping_ros
