// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/edit_answers.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/request_reader.h"

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::SensorModel;
using cuboid_mapping::SetBox;
using cuboid_mapping::UniformBox;

using Request = SetBox::Request;

bool isFilled(const Request& request) {
  return request.occupancy == Request::FREE || request.occupancy == Request::OCCUPIED;
}

void checkOccupancy(RequestReader& reader, const Request& request) {
  reader.require(request.occupancy <= Request::KEEP,
                 "occupancy is " + std::to_string(request.occupancy) +
                     ": use UNKNOWN (0), FREE (1), OCCUPIED (2) or KEEP (3)");
  const double probability = request.probability;
  if (probability == 0.0) return;
  const bool is_right = request.occupancy == Request::FREE
                            ? probability > 0.0 && probability < 0.5
                            : probability >= 0.5 && probability < 1.0;
  reader.require(isFilled(request) && is_right,
                 "probability is " + std::to_string(probability) +
                     ": use 0, or below 0.5 for FREE, from 0.5 to below 1 for OCCUPIED");
}

/// Within the clamping thresholds, as a cloud would leave it.
float toLogOdds(const SensorModel& model, const Request& request) {
  const bool is_free = request.occupancy == Request::FREE;
  if (request.probability == 0.0F) return is_free ? model.min() : model.max();
  const float log_odds = cuboid_mapping::toLogOdds(request.probability);
  return std::min(std::max(log_odds, model.min()), model.max());
}

ChangeSet setBox(CuboidMap& map, const CellBox& box, const Request& request) {
  request.lock != 0 ? map.lock(box) : map.unlock(box);
  if (request.occupancy == Request::KEEP) return {map.revision(), false, {}};
  std::vector<UniformBox> boxes;
  if (isFilled(request)) boxes.push_back({box, toLogOdds(map.sensorModel(), request)});
  return map.replace(box, boxes);
}

}  // namespace

SetBox::Response answerSetBox(const MapInFrame& map, const SetBox::Request& request) {
  RequestReader reader(map, request.header);
  checkOccupancy(reader, request);
  const std::vector<CellBox> boxes = reader.boxes(request.min, request.max, request.inflation);
  double num_voxels = 0.0;
  for (const CellBox& box : boxes) num_voxels += isFilled(request) ? box.numVoxels() : 0.0;
  reader.require(num_voxels <= kMaxSetVoxels,
                 "the boxes have " + std::to_string(num_voxels) + " voxels: at most " +
                     std::to_string(kMaxSetVoxels) + " can be made free or occupied at once");
  if (!reader.isGood()) return refuse<SetBox::Response>(reader.error());
  SetBox::Response response;
  map.map.edit([&](CuboidMap& content, const ros::Time& stamp) {
    ChangeSet all;
    for (const CellBox& box : boxes) {
      const ChangeSet changes = setBox(content, box, request);
      all.bricks.insert(all.bricks.end(), changes.bricks.begin(), changes.bricks.end());
    }
    all.revision = content.revision();
    fillHead(map, content, stamp, response);
    return all;
  });
  for (const CellBox& box : boxes) {
    const cuboid_mapping::MetricBox box_map = map.map.grid().toMetricBox(box);
    response.min.push_back(toPoint(box_map.min_m));
    response.max.push_back(toPoint(box_map.max_m));
  }
  return response;
}

}  // namespace cuboid_mapping_ros
