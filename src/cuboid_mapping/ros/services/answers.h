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

#include <std_srvs/Trigger.h>

#include <new>
#include <string>

namespace cuboid_mapping_ros {

// Each function fills in the answer of one service, except `info`; srv/ documents the answers. They read the
// current map; clouds may come in during a long answer. They keep within the limits of the MapInFrame, and
// throw a Refusal or std::bad_alloc. Complexities are those of the functions of query/, for each entry.
///@{
void answer(ServiceCall& call, const QueryBox::Request& request, QueryBox::Response& response);
void answer(ServiceCall& call, const CheckBoxes::Request& request, CheckBoxes::Response& response);
void answer(ServiceCall& call, const CheckPath::Request& request, CheckPath::Response& response);
void answer(ServiceCall& call, const CheckPoses::Request& request, CheckPoses::Response& response);
void answer(ServiceCall& call, const CastRays::Request& request, CastRays::Response& response);
void answer(ServiceCall& call, const FindNearest::Request& request,
            FindNearest::Response& response);
void answer(ServiceCall& call, const FindNearestFree::Request& request,
            FindNearestFree::Response& response);
void answer(ServiceCall& call, const GetCuboids::Request& request, GetCuboids::Response& response);
void answer(ServiceCall& call, const GetFreeGraph::Request& request,
            GetFreeGraph::Response& response);
void answer(ServiceCall& call, const GetDistances::Request& request,
            GetDistances::Response& response);
void answer(ServiceCall& call, const GetFrontiers::Request& request,
            GetFrontiers::Response& response);
void answer(ServiceCall& call, const FindCorridor::Request& request,
            FindCorridor::Response& response);
void answer(ServiceCall& call, const GetLocks::Request& request, GetLocks::Response& response);
/// If one of the boxes is refused, none is set. If memory runs out, the boxes set before stay.
void answer(ServiceCall& call, const SetBox::Request& request, SetBox::Response& response);
///@}

/// Answer of ~undo_edit, see GuardedMap::undoEdit().
[[nodiscard]] std_srvs::Trigger::Response undoEdit(GuardedMap& map);

/// Limit of the bricks of 8 x 8 x 8 voxels that one ~set_box may make free or occupied: each takes memory.
constexpr double kMaxSetBricks = 2e6;

template <typename ResponseT>
void setInfo(const AnswerInfo& info, ResponseT& response) {
  response.info = info;
}
/// Copies the status to the fields of ~query_box, which is older than AnswerInfo.
void setInfo(const AnswerInfo& info, QueryBox::Response& response);

/// Answers a service call: exceptions of answer() become refusals.
template <typename ServiceT>
[[nodiscard]] typename ServiceT::Response answer(const MapInFrame& map,
                                                 const typename ServiceT::Request& request) {
  const auto refuse = [](const std::string& why) {
    typename ServiceT::Response response;
    AnswerInfo info;
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
