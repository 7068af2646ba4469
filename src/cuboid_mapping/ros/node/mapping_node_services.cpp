// SPDX-License-Identifier: BSD-3-Clause
// Services of a MappingNode that it answers itself.
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/node/mapping_node.h"
#include "cuboid_mapping/ros/queries/answers.h"

#include <ros/console.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>

namespace cuboid_mapping_ros {

using std_srvs::Empty;
using std_srvs::SetBool;

namespace {

/// Why the map cannot move for a jump at this time; empty if it can. @param latest  Newest cloud in the map.
std::string describeWrongTime(const ros::Time& jump, const ros::Time& latest) {
  constexpr double kMaxAhead_s = 60.0;
  std::ostringstream text;
  if (jump.isZero()) return {};
  if (latest >= jump) {
    text << "the map has a cloud of " << latest << " s, but the jump was at " << jump
         << " s: call ~move_map before poses of the new frame are published, or ~pause before the "
            "jump";
  } else if (jump.toSec() > std::max(ros::Time::now(), latest).toSec() + kMaxAhead_s) {
    text << "the jump is at " << jump << " s, more than " << kMaxAhead_s
         << " s ahead of the node's time and of the newest cloud: no cloud before it would come "
            "into the map. Give its time on the clock of the clouds";
  }
  return text.str();
}

}  // namespace

void MappingNode::advertiseServices() {
  const ros::NodeHandle& nh = host_.services_nh;
  servers_ = {offerAnswers<QueryBox>(nh, kQueryBoxService, map_in_frame_),
              offerAnswers<CheckBoxes>(nh, kCheckBoxesService, map_in_frame_),
              offerAnswers<GetCuboids>(nh, kGetCuboidsService, map_in_frame_)};
  servers_.push_back(
      offerService<SetBool>(nh, kPauseService, [this](const auto& request, auto& response) {
        mapper_.pause(request.data != 0);
        response.success = static_cast<std::uint8_t>(true);
        response.message =
            request.data != 0 ? "clouds are ignored from now on" : "clouds are inserted again";
        ROS_INFO_STREAM_NAMED(kNodeName, response.message);
      }));
  servers_.push_back(offerService<Empty>(
      nh, kResetService, [this](const auto& /*request*/, auto& /*response*/) { onReset(); }));
  servers_.push_back(offerService<MoveMap>(
      nh, kMoveMapService,
      [this](const auto& request, auto& response) { onMoveMap(request, response); }));
}

void MappingNode::onReset() {
  const auto lock = mapper_.hold();  // The cloud in work is of the map before.
  map_.replaceAll([](CuboidMap& map, ros::Time& stamp) {
    stamp = ros::Time();
    return map.clear();
  });
  features_.noteReplaced();
  mapper_.setFirstStamp(ros::Time());
  publishing_.publishSoon();
  ROS_INFO_NAMED(kNodeName, "map cleared");
}

/// No cloud is processed meanwhile: clouds wait, or belong to the old frame.
void MappingNode::onMoveMap(const MoveMap::Request& request, MoveMap::Response& response) {
  const auto lock = mapper_.hold();
  const StorageAnswer answer = moveMap(toIsometry(request.transform), request.stamp);
  response.info = makeInfo(map_, parameters_.frame_id, answer.error);
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
  const auto motion = VoxelMotion::of(T_new_old, resolution_m);
  if (!motion) answer.error = describeRefusal(T_new_old, resolution_m);
  const std::string wrong_time = describeWrongTime(jump, map_.stamp());
  if (!wrong_time.empty()) answer.error = wrong_time;
  if (!parameters_.robots.empty()) {
    answer.error =
        "the robots' observations stay in the old frame: stop this node and theirs, move the map "
        "with map_merge, and start them again";
  }
  if (!answer.error.empty()) return answer;
  // What may run out of memory comes first.
  const auto move_features = features_.prepareMove(*motion);
  answer = moveWholeMap(map_, *motion, limitsOfMachine(), endWhen(is_stopping_));
  if (!answer.error.empty()) return answer;
  move_features();
  mapper_.setFirstStamp(jump.isZero() ? ros::Time::now() : jump);
  return answer;
}

}  // namespace cuboid_mapping_ros
