// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/services/answers.h"

namespace cuboid_mapping_ros {
namespace {

template <typename ServiceT>
ros::ServiceServer advertise(const ros::NodeHandle& nh, const char* name, const MapInFrame& map) {
  return offerService<ServiceT>(nh, name, [&map](const auto& request, auto& response) {
    response = answer<ServiceT>(map, request);
  });
}

}  // namespace

std::vector<ros::ServiceServer> advertisePlannerServices(const ros::NodeHandle& nh,
                                                         const MapInFrame& map) {
  return {advertise<QueryBox>(nh, kQueryBoxService, map),
          advertise<CheckBoxes>(nh, kCheckBoxesService, map),
          advertise<CheckPath>(nh, kCheckPathService, map),
          advertise<CheckPoses>(nh, kCheckPosesService, map),
          advertise<CastRays>(nh, kCastRaysService, map),
          advertise<FindNearest>(nh, kNearestService, map),
          advertise<FindNearestFree>(nh, kNearestFreeService, map),
          advertise<GetCuboids>(nh, kGetCuboidsService, map),
          advertise<GetFreeGraph>(nh, kGetFreeGraphService, map),
          advertise<GetDistances>(nh, kGetDistancesService, map),
          advertise<GetFrontiers>(nh, kGetFrontiersService, map),
          advertise<FindCorridor>(nh, kFindCorridorService, map),
          advertise<GetLocks>(nh, kGetLocksService, map)};
}

}  // namespace cuboid_mapping_ros
