// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/query_box.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/services/limited_answer.h"
#include "cuboid_mapping/ros/services/request_reader.h"

#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BoxQueryResult;
using cuboid_mapping::Budget;
using cuboid_mapping::CellBox;
using cuboid_mapping::Cuboid;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::CuboidOutput;
using cuboid_mapping::MapCuboid;
using cuboid_mapping::MetricBox;
using cuboid_mapping::Occupancy;
using cuboid_mapping::QueryBox;

static_assert(QueryBox::Response::UNKNOWN == static_cast<int>(Occupancy::kUnknown));
static_assert(QueryBox::Response::FREE == static_cast<int>(Occupancy::kFree));
static_assert(QueryBox::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(MapCuboid::FREE == static_cast<int>(Occupancy::kFree));
static_assert(MapCuboid::OCCUPIED == static_cast<int>(Occupancy::kOccupied));

constexpr std::size_t kContentBytes = 53;

CuboidOutput toOutput(const QueryBox::Request& request) {
  if (request.cuboids == QueryBox::Request::CUBOIDS_NONE) return CuboidOutput::kNone;
  return request.clip != 0 ? CuboidOutput::kClipped : CuboidOutput::kWhole;
}

CuboidFilter toFilter(const QueryBox::Request& request) {
  switch (request.cuboids) {
    case QueryBox::Request::CUBOIDS_FREE: return CuboidFilter::kFree;
    case QueryBox::Request::CUBOIDS_OCCUPIED: return CuboidFilter::kOccupied;
    default: return CuboidFilter::kAll;
  }
}

MapCuboid toMessage(const Cuboid& cuboid, const cuboid_mapping::Grid& grid) {
  const MetricBox box_map = grid.toMetricBox(cuboid.box);
  MapCuboid message;
  message.min = toPoint(box_map.min_m);
  message.max = toPoint(box_map.max_m);
  message.occupancy = static_cast<std::uint8_t>(cuboid.occupancy);
  return message;
}

void fill(const CuboidMap& map, const BoxQueryResult& result, Budget& budget,
          QueryBox::Response& response) {
  const MetricBox box_map = map.grid().toMetricBox(result.box);
  response.min = toPoint(box_map.min_m);
  response.max = toPoint(box_map.max_m);
  response.free_volume = result.free_volume_m3;
  response.occupied_volume = result.occupied_volume_m3;
  response.unknown_volume = result.unknown_volume_m3;
  response.occupancy = static_cast<std::uint8_t>(result.occupancy());
  const auto log_odds = maxLogOdds(map, result.box, budget);
  response.max_probability = log_odds ? static_cast<float>(cuboid_mapping::toProbability(*log_odds))
                                      : std::numeric_limits<float>::quiet_NaN();
  response.cuboids.reserve(result.cuboids.size());
  for (const Cuboid& cuboid : result.cuboids) {
    const auto probability = meanProbability(map, cuboid.box, budget);
    if (!budget.spendAndYield()) break;
    response.cuboids.push_back(toMessage(cuboid, map.grid()));
    response.cuboids.back().probability = static_cast<float>(probability.value_or(0.0));
  }
}

}  // namespace

QueryBox::Response answerQueryBox(const MapInFrame& map, const QueryBox::Request& request) {
  RequestReader reader(map, request.header);
  reader.require(request.cuboids <= QueryBox::Request::CUBOIDS_ALL,
                 "cuboids is " + std::to_string(request.cuboids) +
                     ": use one of the CUBOIDS_* values, 0 to 3");
  const CellBox box = reader.box(request.min, request.max, 0.0);
  if (!reader.isGood()) return refuse<QueryBox::Response>(reader.error());
  QueryBox::Response response;
  readWithin(
      map, kContentBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
        fillHead(map, content, stamp, response);
        const auto result = queryBox(content, box, toOutput(request), toFilter(request), budget);
        fill(content, result, budget, response);
        noteEnd(map, budget, "ask for a smaller box, or for fewer cuboids", response);
      });
  return response;
}

}  // namespace cuboid_mapping_ros
