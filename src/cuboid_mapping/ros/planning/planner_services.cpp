// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "cuboid_mapping/ros/middleware/names.h"

namespace cuboid_mapping_ros {
namespace {

/// Whether nothing is known, in memory or on disk.
bool isEmpty(const GuardedMap& map) {
  const auto window = map.windowFigures();
  return (!window || window->num_on_disk_only == 0) &&
         map.read([](const CuboidMap& content) { return content.voxels().size() == 0; });
}

/// As offerAnswers(), but refuses to answer about an empty map: no obstacle would be in the way.
template <typename ServiceT>
ros::ServiceServer offerToPlanners(const ros::NodeHandle& nh, const char* name,
                                   const MapInFrame& map) {
  return offerService<ServiceT>(nh, name, [&map](const auto& request, auto& response) {
    if (isEmpty(map.map)) {
      fillBlank(map, request, response);
      response.info =
          makeInfo(map.map, map.frame_id,
                   "the map is empty: no cloud has come since the node was started or the map "
                   "was reset; ask again when one has");
      return;
    }
    response = answer<ServiceT>(map, request);
  });
}

}  // namespace

PlannerServices::PlannerServices(const MapHost& host) {
  const ros::NodeHandle& nh = host.services_nh;
  const MapInFrame& map = host.map_in_frame;
  servers_ = {offerToPlanners<CheckPath>(nh, kCheckPathService, map),
              offerToPlanners<CheckPoses>(nh, kCheckPosesService, map),
              offerToPlanners<CastRays>(nh, kCastRaysService, map),
              offerToPlanners<FindNearest>(nh, kNearestService, map),
              offerToPlanners<FindNearestFree>(nh, kNearestFreeService, map),
              offerToPlanners<GetFreeGraph>(nh, kGetFreeGraphService, map),
              offerToPlanners<GetDistances>(nh, kGetDistancesService, map),
              offerToPlanners<GetFrontiers>(nh, kGetFrontiersService, map),
              offerToPlanners<FindCorridor>(nh, kFindCorridorService, map)};
}

}  // namespace cuboid_mapping_ros
