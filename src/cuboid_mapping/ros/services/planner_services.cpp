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
  return {advertise<cuboid_mapping::QueryBox>(nh, kQueryBoxService, map),
          advertise<cuboid_mapping::CheckBoxes>(nh, kCheckBoxesService, map),
          advertise<cuboid_mapping::CheckPath>(nh, kCheckPathService, map),
          advertise<cuboid_mapping::CheckPoses>(nh, kCheckPosesService, map),
          advertise<cuboid_mapping::CastRays>(nh, kCastRaysService, map),
          advertise<cuboid_mapping::FindNearest>(nh, kNearestService, map),
          advertise<cuboid_mapping::FindNearestFree>(nh, kNearestFreeService, map),
          advertise<cuboid_mapping::GetCuboids>(nh, kGetCuboidsService, map),
          advertise<cuboid_mapping::GetFreeGraph>(nh, kGetFreeGraphService, map),
          advertise<cuboid_mapping::GetDistances>(nh, kGetDistancesService, map),
          advertise<cuboid_mapping::GetFrontiers>(nh, kGetFrontiersService, map),
          advertise<cuboid_mapping::FindCorridor>(nh, kFindCorridorService, map),
          advertise<cuboid_mapping::GetLocks>(nh, kGetLocksService, map)};
}

}  // namespace cuboid_mapping_ros
