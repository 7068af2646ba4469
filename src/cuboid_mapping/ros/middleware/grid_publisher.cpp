// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/grid_publisher.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using Node = ros::SingleSubscriberPublisher;

/// Queue of updates: a lost update would leave a subscriber's grid wrong.
constexpr std::uint32_t kUpdatesQueueSize = 100;

void removeOne(std::multiset<std::string>& names, const std::string& name) {
  const auto found = names.find(name);
  if (found != names.end()) names.erase(found);
}

}  // namespace

void layOut(const CellBox& extent, double resolution_m, nav_msgs::OccupancyGrid& grid) {
  grid.info.resolution = static_cast<float>(resolution_m);
  grid.info.origin.orientation.w = 1.0;
  if (extent.isEmpty()) return;
  grid.info.width = static_cast<std::uint32_t>(extent.size().x);
  grid.info.height = static_cast<std::uint32_t>(extent.size().y);
  grid.info.origin.position.x = extent.min.x * resolution_m;
  grid.info.origin.position.y = extent.min.y * resolution_m;
  grid.data.assign(std::size_t{grid.info.width} * grid.info.height, kUnknownCell);
}

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

GridPublisher::GridPublisher(const ros::NodeHandle& nh, const Options& options, Make make)
    : make_(std::move(make)),
      keyframe_period_(options.keyframe_period_s),
      updates_topic_(ros::NodeHandle(nh).advertise<map_msgs::OccupancyGridUpdate>(
          options.updates, kUpdatesQueueSize,
          [this](const Node& node) { update_nodes_.insert(node.getSubscriberName()); },
          [this](const Node& node) { removeOne(update_nodes_, node.getSubscriberName()); })),
      topic_(
          nh, options.grid, 1,
          [this](const Node& node) {
            nodes_.insert(node.getSubscriberName());
            sent_.reset();
            const auto grid = make_();
            if (grid && !grid->data.empty()) node.publish(*grid);
          },
          [this](const Node& node) { removeOne(nodes_, node.getSubscriberName()); }) {}

void GridPublisher::publish() {
  if (!topic_.hasListeners() && updates_topic_.getNumSubscribers() == 0) {
    sent_.reset();
    return;
  }
  auto grid = make_();
  if (!grid) return;
  const auto update = sent_ ? findGridUpdate(*sent_, *grid) : std::nullopt;
  if (update && !update->data.empty()) {
    updates_topic_.publish(*update);
    owes_keyframe_ = true;
  }
  if (!update || (!update->data.empty() && !allTakeUpdates())) publishWhole(*grid);
  sent_ = std::move(grid);
}

void GridPublisher::publishKeyframe() {
  if (!owes_keyframe_ || !sent_ || keyframe_period_.isZero()) return;
  if (ros::SteadyTime::now() - last_whole_ >= keyframe_period_) publishWhole(*sent_);
}

void GridPublisher::publishWhole(const nav_msgs::OccupancyGrid& grid) {
  topic_.publish(grid);
  last_whole_ = ros::SteadyTime::now();
  owes_keyframe_ = false;
}

bool GridPublisher::allTakeUpdates() const {
  return std::includes(update_nodes_.begin(), update_nodes_.end(), nodes_.begin(), nodes_.end());
}

}  // namespace cuboid_mapping_ros
