// SPDX-License-Identifier: BSD-3-Clause
// Answers of services about the map.
#pragma once

#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <cuboid_mapping/CheckBoxes.h>
#include <cuboid_mapping/GetCuboids.h>
#include <cuboid_mapping/QueryBox.h>

#include <ros/service_server.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <string>

namespace cuboid_mapping_ros {

// Each function answer() fills in the answer of one service, except `info`; srv/ documents the answers. They read
// the current map; clouds may come in during a long answer. They keep within the limits of the MapInFrame, and
// throw a Refusal or std::bad_alloc. Complexities are those of the functions of query/, for each entry.
///@{
void answer(ServiceCall& call, const QueryBox::Request& request, QueryBox::Response& response);
void answer(ServiceCall& call, const CheckBoxes::Request& request, CheckBoxes::Response& response);
void answer(ServiceCall& call, const GetCuboids::Request& request, GetCuboids::Response& response);
///@}

/// Gives each entry of a request its element in the arrays of the answer. It reads as blocked or as nothing found, also in
/// a refused answer. @param anchor  Not read: by it answer() finds the functions that are declared later.
///@{
template <typename RequestT, typename ResponseT>
void fillBlank(const MapInFrame& /*anchor*/, const RequestT& /*request*/, ResponseT& /*response*/) {
}
void fillBlank(const MapInFrame& anchor, const CheckBoxes::Request& request,
               CheckBoxes::Response& response);
///@}

/// Limit of the entries of an answer; 0: none.
[[nodiscard]] inline std::size_t toLimit(std::uint32_t limit) {
  return limit == 0 ? std::numeric_limits<std::size_t>::max() : limit;
}

/// Notes that there are more cuboids, and whether the request's or the node's limit cut them.
void noteCut(ServiceCall& call, const Budget& budget, bool is_cut);

template <typename ResponseT>
void setInfo(const AnswerInfo& info, ResponseT& response) {
  response.info = info;
}
/// Copies the status to the fields of ~query_box, which is older than AnswerInfo.
void setInfo(const AnswerInfo& info, QueryBox::Response& response);

/// Answers a service call: a Refusal or std::bad_alloc of answer() becomes a refusal.
template <typename ServiceT>
[[nodiscard]] typename ServiceT::Response answer(const MapInFrame& map,
                                                 const typename ServiceT::Request& request) {
  const auto refuse = [&](const std::string& why) {
    typename ServiceT::Response response;
    fillBlank(map, request, response);
    setInfo(makeInfo(map.map, map.frame_id, why), response);
    return response;
  };
  try {
    typename ServiceT::Response response;
    fillBlank(map, request, response);
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

/// Offers a service that answer() answers. @param map  Must outlive the service.
template <typename ServiceT>
[[nodiscard]] ros::ServiceServer offerAnswers(const ros::NodeHandle& nh, const char* name,
                                              const MapInFrame& map) {
  return offerService<ServiceT>(nh, name, [&map](const auto& request, auto& response) {
    response = answer<ServiceT>(map, request);
  });
}

}  // namespace cuboid_mapping_ros
