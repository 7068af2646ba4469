// SPDX-License-Identifier: BSD-3-Clause
// The services of a MappingNode that are not made by others.
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/node/mapping_node.h"
#include "cuboid_mapping/ros/services/request_reader.h"

#include <ros/console.h>

#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {

using cuboid_mapping::MoveMap;

void MappingNode::advertiseServices() {
  ros::NodeHandle query_nh = withQueue(private_nh_, query_threads_.queue());
  const MapInFrame map{map_, parameters_.frame_id, tf_buffer_, parameters_.service_limits,
                       &is_stopping_};
  ros::NodeHandle edit_nh = withQueue(private_nh_, edit_threads_.queue());
  using std_srvs::Empty;
  reset_server_ = edit_nh.advertiseService<Empty::Request, Empty::Response>(
      kResetService, [this](Empty::Request& /*request*/, Empty::Response& /*response*/) {
        onReset();
        return true;
      });
  // Among the clouds: none is worked on meanwhile.
  move_server_ = private_nh_.advertiseService<MoveMap::Request, MoveMap::Response>(
      kMoveMapService, [this](MoveMap::Request& request, MoveMap::Response& response) {
        onMoveMap(request, response);
        return true;
      });
  planner_services_.emplace(query_nh, map);
  edit_services_.emplace(edit_nh, map, [this] { publishSoon(); });
}

void MappingNode::onReset() {
  map_.replaceAll([](cuboid_mapping::CuboidMap& map, ros::Time& stamp) {
    stamp = ros::Time();
    return map.clear();
  });
  moving_filter_.reset();
  first_stamp_ns_ = 0;
  publishSoon();
  ROS_INFO_NAMED(kNodeName, "map cleared");
}

void MappingNode::onMoveMap(const MoveMap::Request& request, MoveMap::Response& response) {
  const std::lock_guard<FairMutex> lock(work_mutex_);
  const StorageAnswer answer = moveMap(toIsometry(request.transform), request.stamp);
  response.success = static_cast<std::uint8_t>(answer.error.empty());
  response.message = answer.error;
  response.cuboids = answer.num_cuboids;
  if (answer.error.empty()) {
    ROS_INFO_STREAM_NAMED(kNodeName, "map moved: " << answer.num_cuboids << " cuboids");
  } else {
    ROS_ERROR_STREAM_NAMED(kNodeName, "map not moved: " << answer.error);
  }
}

StorageAnswer MappingNode::moveMap(const Eigen::Isometry3d& T_new_old, const ros::Time& jump) {
  StorageAnswer answer;
  const double resolution_m = map_.grid().resolution();
  const auto motion = cuboid_mapping::VoxelMotion::of(T_new_old, resolution_m);
  if (!motion) answer.error = describeRefusal(T_new_old, resolution_m);
  const ros::Time latest =
      map_.read([](const auto& /*map*/, const ros::Time& stamp) { return stamp; });
  if (!jump.isZero() && latest >= jump) {
    std::ostringstream text;
    text << "the map has a cloud of " << latest << " s, but the jump was at " << jump
         << " s: call ~move_map before poses of the new frame are published, or ~pause before the "
            "jump";
    answer.error = text.str();
  }
  if (!parameters_.fleet.robots.empty()) {
    answer.error =
        "what robots say goes on in the frame as it was: stop this node and theirs, move the map "
        "with map_merge, and start them anew";
  }
  if (!answer.error.empty()) return answer;
  // First what may want for memory.
  Forgetting forgetting = forgetting_.moved(*motion);
  cuboid_mapping::VoidSpace void_space = moving_filter_.voidSpace().moved(*motion);
  answer = moveWholeMap(map_, *motion, makeSnapshotLimits(parameters_));
  if (!answer.error.empty()) return answer;
  forgetting_ = std::move(forgetting);
  moving_filter_.setVoidSpace(std::move(void_space));
  first_stamp_ns_ = (jump.isZero() ? ros::Time::now() : jump).toNSec();
  return answer;
}

}  // namespace cuboid_mapping_ros
