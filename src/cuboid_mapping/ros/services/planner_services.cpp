// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/planner_services.h"

#include "cuboid_mapping/map/cuboid_search.h"

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/services/check_answers.h"
#include "cuboid_mapping/ros/services/edit_answers.h"
#include "cuboid_mapping/ros/services/query_box.h"
#include "cuboid_mapping/ros/services/request_reader.h"
#include "cuboid_mapping/ros/services/search_answers.h"

#include <ros/console.h>
#include <boost/function.hpp>

#include <exception>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

/// Offers a service that a pure function answers. No exception leaves it, and the caller is told why.
template <typename RequestT, typename ResponseT, typename AnswerT>
ros::ServiceServer advertise(ros::NodeHandle& nh, const char* name, AnswerT answer) {
  CallbackGuard& guard = guardOf(nh);
  const boost::function<bool(RequestT&, ResponseT&)> callback =
      [answer, name, &guard](RequestT& request, ResponseT& response) {
        try {
          response = answer(request);
        } catch (const std::exception& exception) {
          guard.noteFailure(name, exception.what());
          response =
              refuse<ResponseT>(std::string("the node could not answer: ") + exception.what());
        }
        return true;
      };
  return nh.advertiseService(name, callback);
}

/// advertise() for a function of map and request.
template <typename RequestT, typename ResponseT>
ros::ServiceServer advertise(ros::NodeHandle& nh, const char* name, const MapInFrame& map,
                             ResponseT (*answer)(const MapInFrame&, const RequestT&)) {
  return advertise<RequestT, ResponseT>(
      nh, name, [&map, answer](const RequestT& request) { return answer(map, request); });
}

}  // namespace

PlannerServices::PlannerServices(const ros::NodeHandle& private_nh, const MapInFrame& map)
    : map_(map) {
  ros::NodeHandle nh(private_nh);
  servers_.push_back(advertise(nh, kQueryBoxService, map_, answerQueryBox));
  servers_.push_back(advertise(nh, kCheckBoxesService, map_, answerCheckBoxes));
  servers_.push_back(advertise(nh, kCheckPathService, map_, answerCheckPath));
  servers_.push_back(advertise(nh, kCastRaysService, map_, answerCastRays));
  servers_.push_back(advertise(nh, kNearestService, map_, answerFindNearest));
  servers_.push_back(advertise(nh, kNearestFreeService, map_, answerFindNearestFree));
  servers_.push_back(advertise(nh, kGetCuboidsService, map_, answerGetCuboids));
  servers_.push_back(advertise(nh, kGetFreeGraphService, map_, answerGetFreeGraph));
  servers_.push_back(advertise(nh, kFindCorridorService, map_, answerFindCorridor));
}

EditServices::EditServices(const ros::NodeHandle& private_nh, const MapInFrame& map,
                           std::function<void()> publish)
    : map_(map), publish_(std::move(publish)) {
  using cuboid_mapping::SetBox;
  ros::NodeHandle nh(private_nh);
  servers_.push_back(advertise<SetBox::Request, SetBox::Response>(
      nh, kSetBoxService, [this](const SetBox::Request& request) {
        SetBox::Response response = answerSetBox(map_, request);
        if (response.success != 0) publish_();
        return response;
      }));
  using std_srvs::SetBool;
  servers_.push_back(nh.advertiseService<SetBool::Request, SetBool::Response>(
      kPauseService, [this](SetBool::Request& request, SetBool::Response& response) {
        return onPause(request, response);
      }));
}

bool EditServices::onPause(std_srvs::SetBool::Request& request,
                           std_srvs::SetBool::Response& response) {
  is_paused_ = request.data != 0;
  response.success = static_cast<std::uint8_t>(true);
  response.message = is_paused_ ? "clouds are ignored from now on" : "clouds are inserted again";
  ROS_INFO_STREAM_NAMED(kNodeName, response.message);
  return true;
}

}  // namespace cuboid_mapping_ros
