// SPDX-License-Identifier: BSD-3-Clause
// The answers to the services that look at the map or edit it.
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

#include <std_srvs/Trigger.h>

#include <new>
#include <string>

namespace cuboid_mapping_ros {

// Each fills in the answer to one service, all but `info`; their contracts are in srv/. They look at the map as the last
// cloud has left it; in a long answer clouds come in between. They keep within the limits of the MapInFrame, and throw
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
/// When one of the boxes is refused, none is set. When there is not enough memory, what was set until then stays.
void answer(ServiceCall& call, const cuboid_mapping::SetBox::Request& request,
            cuboid_mapping::SetBox::Response& response);
///@}

/// Answer of ~undo_edit, see GuardedMap::undoEdit().
[[nodiscard]] std_srvs::Trigger::Response undoEdit(GuardedMap& map);

/// Bricks of 8 x 8 x 8 voxels that one ~set_box may make free or occupied: each takes memory.
constexpr double kMaxSetBricks = 2e6;

template <typename ResponseT>
void setInfo(const cuboid_mapping::AnswerInfo& info, ResponseT& response) {
  response.info = info;
}
/// ~query_box is older than AnswerInfo.
void setInfo(const cuboid_mapping::AnswerInfo& info, cuboid_mapping::QueryBox::Response& response);

/// Answers a call of a service: what answer() throws becomes a refusal.
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

}  // namespace cuboid_mapping_ros
