// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "cuboid_mapping/ros/middleware/names.h"

namespace cuboid_mapping_ros {

PlannerServices::PlannerServices(const MapHost& host) {
  const ros::NodeHandle& nh = host.services_nh;
  const MapInFrame& map = host.map_in_frame;
  servers_ = {offerAnswers<CheckPath>(nh, kCheckPathService, map),
              offerAnswers<CheckPoses>(nh, kCheckPosesService, map),
              offerAnswers<CastRays>(nh, kCastRaysService, map),
              offerAnswers<FindNearest>(nh, kNearestService, map),
              offerAnswers<FindNearestFree>(nh, kNearestFreeService, map),
              offerAnswers<GetFreeGraph>(nh, kGetFreeGraphService, map),
              offerAnswers<GetDistances>(nh, kGetDistancesService, map),
              offerAnswers<GetFrontiers>(nh, kGetFrontiersService, map),
              offerAnswers<FindCorridor>(nh, kFindCorridorService, map)};
}

}  // namespace cuboid_mapping_ros
