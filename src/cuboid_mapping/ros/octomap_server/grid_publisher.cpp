// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/grid_publisher.h"

#include <ros/single_subscriber_publisher.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// One that is lost would leave a listener's grid wrong there.
constexpr std::uint32_t kUpdatesQueueSize = 100;

}  // namespace

std::optional<map_msgs::OccupancyGridUpdate> findGridUpdate(const nav_msgs::OccupancyGrid& older,
                                                            const nav_msgs::OccupancyGrid& grid) {
  const nav_msgs::MapMetaData& info = grid.info;
  const bool is_same_place = older.header.frame_id == grid.header.frame_id &&
                             older.info.width == info.width && older.info.height == info.height &&
                             older.info.resolution == info.resolution &&
                             older.info.origin.position.x == info.origin.position.x &&
                             older.info.origin.position.y == info.origin.position.y;
  if (!is_same_place) return std::nullopt;
  map_msgs::OccupancyGridUpdate update;
  update.header = grid.header;
  const auto width = static_cast<std::ptrdiff_t>(info.width);
  std::ptrdiff_t min_x = width;
  std::ptrdiff_t max_x = -1;
  std::ptrdiff_t min_y = -1;
  std::ptrdiff_t max_y = -1;
  const auto size = static_cast<std::ptrdiff_t>(grid.data.size());
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (grid.data[at] == older.data[at]) continue;
    min_x = std::min(min_x, i % width);
    max_x = std::max(max_x, i % width);
    if (min_y < 0) min_y = i / width;
    max_y = i / width;
  }
  if (max_x < 0) return update;
  update.x = static_cast<std::int32_t>(min_x);
  update.y = static_cast<std::int32_t>(min_y);
  update.width = static_cast<std::uint32_t>(max_x - min_x + 1);
  update.height = static_cast<std::uint32_t>(max_y - min_y + 1);
  for (std::ptrdiff_t y = min_y; y <= max_y; ++y) {
    const auto row = grid.data.begin() + y * width;
    update.data.insert(update.data.end(), row + min_x, row + max_x + 1);
  }
  return update;
}

GridPublisher::GridPublisher(ros::NodeHandle nh, const Topics& topics, bool is_latched, Make make)
    : make_(std::move(make)),
      updates_publisher_(
          nh.advertise<map_msgs::OccupancyGridUpdate>(topics.updates, kUpdatesQueueSize)),
      publisher_(nh.advertise<nav_msgs::OccupancyGrid>(
          topics.grid, 1, [this, is_latched](const ros::SingleSubscriberPublisher& listener) {
            sent_.reset();
            const auto grid = is_latched ? make_() : std::nullopt;
            if (grid) listener.publish(*grid);
          })) {}

void GridPublisher::publish() {
  const std::uint32_t num_updated = updates_publisher_.getNumSubscribers();
  const std::uint32_t num_whole = publisher_.getNumSubscribers();
  if (num_updated + num_whole == 0) {
    sent_.reset();
    return;
  }
  auto grid = make_();
  if (!grid) return;
  const auto update = sent_ ? findGridUpdate(*sent_, *grid) : std::nullopt;
  if (!update || num_updated < num_whole) publisher_.publish(*grid);
  if (update && !update->data.empty()) updates_publisher_.publish(*update);
  sent_ = std::move(grid);
}

}  // namespace cuboid_mapping_ros
