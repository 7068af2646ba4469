// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/map_markers.h"

#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "ros/node_probe.h"

#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::UniformBox;

/// A map in which every second voxel is a cuboid.
class Checkerboard {
 public:
  Checkerboard() : map_({}) { change(); }

  [[nodiscard]] const GuardedMap& map() const { return map_; }

  /// Moves all cuboids by a voxel.
  ChangeSet change() {
    constexpr std::int32_t kEdge = 48;
    is_odd_ = !is_odd_;
    std::vector<UniformBox> boxes;
    Cell at;
    for (at.z = 0; at.z < kEdge; ++at.z) {
      for (at.y = 0; at.y < kEdge; ++at.y) {
        for (at.x = (at.z + at.y + (is_odd_ ? 1 : 0)) % 2; at.x < kEdge; at.x += 2) {
          boxes.push_back({CellBox::ofCell(at), 1.0F});
        }
      }
    }
    map_.replaceAll([&](CuboidMap& map) { return map.replace(cuboid_mapping::kAllCells, boxes); });
    return {0, true, {}};
  }

 private:
  GuardedMap map_;
  bool is_odd_ = false;
};

TEST(MarkerTopic, RestsAfterMessagesThatTookLong) {
  ros::CallbackQueue callbacks;
  CallbackGuard guard;
  GuardedQueue queue(callbacks, guard, "markers");
  Checkerboard board;
  NodeParameters parameters;
  parameters.keyframe_period_s = 0.0;
  MarkerTopic publisher(withQueue(ros::NodeHandle("marker_rate"), queue), CuboidFilter::kOccupied,
                        parameters, board.map());
  int num_messages = 0;
  const boost::function<void(const visualization_msgs::MarkerArray::ConstPtr&)> count =
      [&](const auto&) { ++num_messages; };
  ros::NodeHandle nh;
  const auto subscriber = nh.subscribe("marker_rate/occupied_cuboids", 10, count);
  ASSERT_TRUE(waitFor([&] {
    callbacks.callAvailable();
    return num_messages == 1;
  }));

  publisher.noteChanges(board.change());
  const ros::SteadyTime start = ros::SteadyTime::now();
  publisher.publish();
  const ros::WallDuration work = ros::SteadyTime::now() - start;
  ASSERT_TRUE(waitFor([&] { return num_messages == 2; }));

  publisher.noteChanges(board.change());
  ASSERT_TRUE(waitFor([&] {
    publisher.publish();
    return num_messages == 3;
  })) << "what has changed during the rest is not lost";
  const double rest_s = std::min(10.0 * work.toSec(), MarkerTopic::kMaxRest_s);
  EXPECT_GT((ros::SteadyTime::now() - start).toSec(), rest_s);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
