// SPDX-License-Identifier: BSD-3-Clause
// Services for planners.
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/queries/answers.h"

#include <cuboid_mapping/CastRays.h>
#include <cuboid_mapping/CheckPath.h>
#include <cuboid_mapping/CheckPoses.h>
#include <cuboid_mapping/FindCorridor.h>
#include <cuboid_mapping/FindNearest.h>
#include <cuboid_mapping/FindNearestFree.h>
#include <cuboid_mapping/GetDistances.h>
#include <cuboid_mapping/GetFreeGraph.h>
#include <cuboid_mapping/GetFrontiers.h>

#include <ros/service_server.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

// Answers of the services, see queries/answers.h.
///@{
void answer(ServiceCall& call, const CheckPath::Request& request, CheckPath::Response& response);
void answer(ServiceCall& call, const CheckPoses::Request& request, CheckPoses::Response& response);
void answer(ServiceCall& call, const CastRays::Request& request, CastRays::Response& response);
void answer(ServiceCall& call, const FindNearest::Request& request,
            FindNearest::Response& response);
void answer(ServiceCall& call, const FindNearestFree::Request& request,
            FindNearestFree::Response& response);
void answer(ServiceCall& call, const GetFreeGraph::Request& request,
            GetFreeGraph::Response& response);
void answer(ServiceCall& call, const GetDistances::Request& request,
            GetDistances::Response& response);
void answer(ServiceCall& call, const GetFrontiers::Request& request,
            GetFrontiers::Response& response);
void answer(ServiceCall& call, const FindCorridor::Request& request,
            FindCorridor::Response& response);
///@}

// See queries/answers.h.
///@{
void fillBlank(const MapInFrame& anchor, const CheckPath::Request& request,
               CheckPath::Response& response);
void fillBlank(const MapInFrame& anchor, const CheckPoses::Request& request,
               CheckPoses::Response& response);
void fillBlank(const MapInFrame& anchor, const CastRays::Request& request,
               CastRays::Response& response);
void fillBlank(const MapInFrame& anchor, const FindNearest::Request& request,
               FindNearest::Response& response);
void fillBlank(const MapInFrame& anchor, const FindNearestFree::Request& request,
               FindNearestFree::Response& response);
void fillBlank(const MapInFrame& anchor, const GetDistances::Request& request,
               GetDistances::Response& response);
///@}

/// ~check_path, ~check_poses, ~cast_rays, ~nearest, ~nearest_free, ~get_free_graph, ~get_distances, ~get_frontiers
/// and ~find_corridor.
class PlannerServices : public MapFeature {
 public:
  explicit PlannerServices(const MapHost& host);
  [[nodiscard]] std::string name() const override { return "planner services"; }

 private:
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace cuboid_mapping_ros
