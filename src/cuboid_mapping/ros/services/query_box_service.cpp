// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/query_box_service.h"

#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/middleware/checked_messages.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <boost/function.hpp>

#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Occupancy;
using Request = cuboid_mapping::QueryBox::Request;
using Response = cuboid_mapping::QueryBox::Response;

constexpr int toInt(WantedCuboids wanted) { return static_cast<int>(wanted); }
static_assert(Request::CUBOIDS_NONE == toInt(WantedCuboids::kNone));
static_assert(Request::CUBOIDS_FREE == toInt(WantedCuboids::kFree));
static_assert(Request::CUBOIDS_OCCUPIED == toInt(WantedCuboids::kOccupied));
static_assert(Request::CUBOIDS_ALL == toInt(WantedCuboids::kAll));
static_assert(Response::UNKNOWN == static_cast<int>(Occupancy::kUnknown));
static_assert(Response::FREE == static_cast<int>(Occupancy::kFree));
static_assert(Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(cuboid_mapping::MapCuboid::FREE == static_cast<int>(Occupancy::kFree));
static_assert(cuboid_mapping::MapCuboid::OCCUPIED == static_cast<int>(Occupancy::kOccupied));

BoxRequest fromMessage(const Request& message) {
  BoxRequest request;
  request.frame_id = message.header.frame_id;
  request.stamp = message.header.stamp;
  request.box = {toVector(message.min), toVector(message.max)};
  request.wanted_cuboids = message.cuboids;
  request.is_clipped = message.clip != 0;
  return request;
}

cuboid_mapping::MapCuboid toMessage(const AnswerCuboid& cuboid) {
  cuboid_mapping::MapCuboid message;
  message.min = toPoint(cuboid.box_map.min_m);
  message.max = toPoint(cuboid.box_map.max_m);
  message.probability = static_cast<float>(cuboid.probability);
  message.occupancy = static_cast<std::uint8_t>(cuboid.occupancy);
  return message;
}

Response toMessage(const BoxAnswer& answer, const std::string& frame_id) {
  Response message;
  message.success = static_cast<std::uint8_t>(answer.error.empty());
  message.message = answer.error;
  if (!answer.error.empty()) return message;
  message.truncated = static_cast<std::uint8_t>(!answer.cut.empty());
  message.message = answer.cut;
  message.header.frame_id = frame_id;
  message.header.stamp = answer.stamp;
  message.revision = answer.revision;
  message.min = toPoint(answer.box_map.min_m);
  message.max = toPoint(answer.box_map.max_m);
  message.free_volume = answer.free_volume_m3;
  message.occupied_volume = answer.occupied_volume_m3;
  message.unknown_volume = answer.unknown_volume_m3;
  message.occupancy = static_cast<std::uint8_t>(answer.occupancy);
  message.max_probability = static_cast<float>(answer.max_probability);
  message.cuboids.reserve(answer.cuboids.size());
  for (const AnswerCuboid& cuboid : answer.cuboids) message.cuboids.push_back(toMessage(cuboid));
  return message;
}

}  // namespace

ros::ServiceServer advertiseQueryBox(ros::NodeHandle& private_handle,
                                     const std::string& map_frame_id,
                                     std::function<BoxAnswer(const BoxRequest&)> answer) {
  const boost::function<bool(Request&, Response&)> callback =
      [map_frame_id, answer = std::move(answer)](Request& request, Response& response) {
        response = toMessage(answer(fromMessage(request)), map_frame_id);
        return true;
      };
  return advertiseGuarded(private_handle, kQueryBoxService, callback);
}

}  // namespace cuboid_mapping_ros
