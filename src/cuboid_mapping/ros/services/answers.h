// SPDX-License-Identifier: BSD-3-Clause
// Answers of the services that read or edit the map.
#pragma once

#include "cuboid_mapping/ros/services/service_call.h"

#include <cuboid_mapping/CastRays.h>
#include <cuboid_mapping/CheckBoxes.h>
#include <cuboid_mapping/CheckPath.h>
#include <cuboid_mapping/CheckPoses.h>
#include <cuboid_mapping/FindCorridor.h>
#include <cuboid_mapping/FindNearest.h>
#include <cuboid_mapping/FindNearestFree.h>
#include <cuboid_mapping/GetCuboids.h>
#include <cuboid_mapping/GetDistances.h>
#include <cuboid_mapping/GetFreeGraph.h>
#include <cuboid_mapping/GetFrontiers.h>
#include <cuboid_mapping/GetLocks.h>
#include <cuboid_mapping/QueryBox.h>
#include <cuboid_mapping/SetBox.h>

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <std_srvs/Trigger.h>

#include <new>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

// Each function fills in the answer of one service, except `info`; srv/ has their contracts. They read the map after the last
// cloud; during a long answer clouds may come in. They keep within the limits of the MapInFrame, and throw
// a Refusal, or std::bad_alloc. Complexities are those of the functions of query/, for each entry.
///@{
void answer(ServiceCall& call, const cuboid_mapping::QueryBox::Request& request,
            cuboid_mapping::QueryBox::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::CheckBoxes::Request& request,
            cuboid_mapping::CheckBoxes::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::CheckPath::Request& request,
            cuboid_mapping::CheckPath::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::CheckPoses::Request& request,
            cuboid_mapping::CheckPoses::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::CastRays::Request& request,
            cuboid_mapping::CastRays::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::FindNearest::Request& request,
            cuboid_mapping::FindNearest::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::FindNearestFree::Request& request,
            cuboid_mapping::FindNearestFree::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::GetCuboids::Request& request,
            cuboid_mapping::GetCuboids::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::GetFreeGraph::Request& request,
            cuboid_mapping::GetFreeGraph::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::GetDistances::Request& request,
            cuboid_mapping::GetDistances::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::GetFrontiers::Request& request,
            cuboid_mapping::GetFrontiers::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::FindCorridor::Request& request,
            cuboid_mapping::FindCorridor::Response& response);
void answer(ServiceCall& call, const cuboid_mapping::GetLocks::Request& request,
            cuboid_mapping::GetLocks::Response& response);
/// If one of the boxes is refused, none is set. If memory runs out, the boxes set before stay.
void answer(ServiceCall& call, const cuboid_mapping::SetBox::Request& request,
            cuboid_mapping::SetBox::Response& response);
///@}

/// Answer of ~undo_edit, see GuardedMap::undoEdit().
[[nodiscard]] std_srvs::Trigger::Response undoEdit(GuardedMap& map);

/// Limit of the bricks of 8 x 8 x 8 voxels that one ~set_box may make free or occupied: each takes memory.
constexpr double kMaxSetBricks = 2e6;

template <typename ResponseT>
void setInfo(const cuboid_mapping::AnswerInfo& info, ResponseT& response) {
  response.info = info;
}
/// Copies the status to the fields of ~query_box, which is older than AnswerInfo.
void setInfo(const cuboid_mapping::AnswerInfo& info, cuboid_mapping::QueryBox::Response& response);

/// Answers a service call: exceptions of answer() become refusals.
template <typename ServiceT>
[[nodiscard]] typename ServiceT::Response answer(const MapInFrame& map,
                                                 const typename ServiceT::Request& request) {
  const auto refuse = [](const std::string& why) {
    typename ServiceT::Response response;
    cuboid_mapping::AnswerInfo info;
    info.message = why;
    setInfo(info, response);
    return response;
  };
  try {
    typename ServiceT::Response response;
    ServiceCall call(map, request.header);
    answer(call, request, response);
    setInfo(call.info(), response);
    return response;
  } catch (const Refusal& refusal) {
    return refuse(refusal.what());
  } catch (const std::bad_alloc&) {
    return refuse("the node has not enough memory for the answer: ask for less at once");
  }
}

/// Offers all services that read the map. They are answered from the queue of the node handle.
/// @param map  Must outlive the servers.
[[nodiscard]] std::vector<ros::ServiceServer> advertisePlannerServices(const ros::NodeHandle& nh,
                                                                       const MapInFrame& map);

}  // namespace cuboid_mapping_ros
