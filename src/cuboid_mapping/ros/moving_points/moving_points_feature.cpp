// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/moving_points/moving_points_feature.h"

#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <utility>

namespace cuboid_mapping_ros {

std::vector<ParameterDeclaration> MovingPointsFeature::declare() {
  return {
      {"moving_points", "",
       choice<MovingPoints>(&NodeParameters::moving_points,
                            {{"ignore", MovingPoints::kIgnore},
                             {"publish", MovingPoints::kPublish},
                             {"leave_out", MovingPoints::kLeaveOut}}),
       "Points of moving objects, which lie where earlier clouds have seen empty space. ignore: "
       "the node does not look for them. publish: the node publishes them on moving_points. "
       "leave_out: the node publishes them, and they do not make voxels occupied."},
  };
}

bool MovingPointsFeature::isOn(const NodeParameters& parameters) {
  return parameters.moving_points != MovingPoints::kIgnore && parameters.robots.empty();
}

MovingPointsFeature::MovingPointsFeature(const MapHost& host)
    : frame_id_(withoutSlash(host.parameters.frame_id)),
      filter_(host.parameters.map.resolution_m, host.parameters.moving_points,
              host.parameters.window),
      publisher_(
          ros::NodeHandle(host.nh).advertise<sensor_msgs::PointCloud2>(kMovingPointsTopic, 10)) {}

const ScanUpdate& MovingPointsFeature::filter(const ScanUpdate& update, const CloudInWork& cloud) {
  if (publisher_.getNumSubscribers() > 0) {
    publisher_.publish(
        toCloud(filter_.findMoving(cloud.scans), makeHeader(frame_id_, cloud.stamp)));
  }
  return filter_.take(update, cloud.window_center_map);
}

std::function<void()> MovingPointsFeature::prepareMove(const VoxelMotion& motion) {
  auto moved = std::make_shared<VoidSpace>(filter_.voidSpace().moved(motion));
  return [this, moved] { filter_.setVoidSpace(std::move(*moved)); };
}

}  // namespace cuboid_mapping_ros
