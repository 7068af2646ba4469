// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/edit_answers.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/services/limited_answer.h"
#include "cuboid_mapping/ros/services/request_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Budget;
using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::SensorModel;
using cuboid_mapping::SetBox;
using cuboid_mapping::toText;
using cuboid_mapping::UniformBox;

using Request = SetBox::Request;

/// Of the answer to each box.
constexpr std::size_t kEditBytes = 48;

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
                 "probability is " + toText(probability) +
                     ": use 0, or below 0.5 for FREE, from 0.5 to below 1 for OCCUPIED");
}

/// Within the clamping thresholds, as a cloud would leave it.
float toLogOdds(const SensorModel& model, const Request& request) {
  const bool is_free = request.occupancy == Request::FREE;
  if (request.probability == 0.0F) return is_free ? model.min() : model.max();
  const float log_odds = cuboid_mapping::toLogOdds(request.probability);
  return std::min(std::max(log_odds, model.min()), model.max());
}

/// Bricks of a box that are set while nobody else has the map: some milliseconds.
constexpr double kBricksATurn = 4096.0;

/// A box in parts of so many bricks at most, cut at their borders: slabs along z, rows along y, and
/// pieces along x.
std::vector<CellBox> divide(const CellBox& box) {
  std::vector<CellBox> parts{box};
  for (int axis = 2; axis >= 0; --axis) {
    std::vector<CellBox> smaller;
    for (const CellBox& part : parts) {
      const double num_layers = ((part.max[axis] - 1) >> 3) - (part.min[axis] >> 3) + 1.0;
      const double layers = std::max(1.0, std::floor(kBricksATurn * num_layers / numBricks(part)));
      for (CellBox piece = part; piece.min[axis] < part.max[axis];
           piece.min[axis] = piece.max[axis]) {
        const double end = ((piece.min[axis] >> 3) + layers) * cuboid_mapping::kBrickEdge;
        piece.max[axis] = static_cast<std::int32_t>(std::min(end, 1.0 * part.max[axis]));
        smaller.push_back(piece);
      }
    }
    parts = std::move(smaller);
  }
  return parts;
}

ChangeSet setPart(CuboidMap& map, const CellBox& box, const Request& request) {
  std::vector<UniformBox> boxes;
  if (isFilled(request)) boxes.push_back({box, toLogOdds(map.sensorModel(), request)});
  return map.replace(box, boxes);
}

/// Locks or unlocks a box, and sets it part by part, until the budget is spent.
void setBox(GuardedMap& map, const CellBox& box, const Request& request, Budget& budget) {
  map.edit([&](CuboidMap& content, const ros::Time& /*stamp*/) {
    request.lock != 0 ? content.lock(box) : content.unlock(box);
    return ChangeSet{content.revision(), false, {}};
  });
  if (request.occupancy == Request::KEEP) return;
  // What becomes unknown costs as much as is known there, however large the box.
  const bool is_divided = numBricks(box) <= kMaxSetBricks;
  for (const CellBox& part : is_divided ? divide(box) : std::vector<CellBox>{box}) {
    if (!budget.lookNow()) return;
    map.editIn(part, [&](CuboidMap& content, const ros::Time& /*stamp*/) {
      return setPart(content, part, request);
    });
  }
}

}  // namespace

SetBox::Response answerSetBox(const MapInFrame& map, const SetBox::Request& request) {
  RequestReader reader(map, request.header);
  checkOccupancy(reader, request);
  reader.requireFew(request.min.size(), "boxes", kEditBytes);
  const std::vector<CellBox> boxes = reader.boxes(request.min, request.max, request.inflation);
  double num_bricks = 0.0;
  for (const CellBox& box : boxes) num_bricks += isFilled(request) ? numBricks(box) : 0.0;
  reader.require(num_bricks <= kMaxSetBricks, "the boxes contain " + toText(num_bricks) +
                                                  " bricks of 8 x 8 x 8 voxels: at most " +
                                                  toText(kMaxSetBricks) +
                                                  " can be set free or occupied at once");
  if (!reader.isGood()) return refuse<SetBox::Response>(reader.error());
  SetBox::Response response;
  cuboid_mapping::QueryLimits limits;
  limits.time_s = map.limits.max_time_s;
  cuboid_mapping::Budget budget(limits,
                                {{}, std::numeric_limits<double>::infinity(), map.is_stopped});
  answerEach(map, boxes.size(), "boxes", budget, response,
             [&](std::size_t i) { setBox(map.map, boxes[i], request, budget); });
  map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    fillHead(map, content, stamp, response);
    return 0;
  });
  for (std::size_t i = 0; i < response.answered; ++i) {
    const cuboid_mapping::MetricBox box_map = map.map.grid().toMetricBox(boxes[i]);
    response.min.push_back(toPoint(box_map.min_m));
    response.max.push_back(toPoint(box_map.max_m));
  }
  return response;
}

}  // namespace cuboid_mapping_ros
