// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/query_box.h"

#include "cuboid_mapping/ros/map/guarded_map.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/services/limited_answer.h"
#include "cuboid_mapping/ros/services/request_reader.h"

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BoxQueryResult;
using cuboid_mapping::Budget;
using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::CuboidOutput;
using cuboid_mapping::MetricBox;

CuboidOutput toOutput(const BoxRequest& request) {
  if (static_cast<WantedCuboids>(request.wanted_cuboids) == WantedCuboids::kNone) {
    return CuboidOutput::kNone;
  }
  return request.is_clipped ? CuboidOutput::kClipped : CuboidOutput::kWhole;
}

CuboidFilter toFilter(const BoxRequest& request) {
  switch (static_cast<WantedCuboids>(request.wanted_cuboids)) {
    case WantedCuboids::kFree: return CuboidFilter::kFree;
    case WantedCuboids::kOccupied: return CuboidFilter::kOccupied;
    default: return CuboidFilter::kAll;
  }
}

BoxAnswer toAnswer(const CuboidMap& map, const BoxQueryResult& result, Budget& budget) {
  BoxAnswer answer;
  answer.revision = map.revision();
  answer.box_map = map.grid().toMetricBox(result.box);
  answer.free_volume_m3 = result.free_volume_m3;
  answer.occupied_volume_m3 = result.occupied_volume_m3;
  answer.unknown_volume_m3 = result.unknown_volume_m3;
  answer.occupancy = result.occupancy();
  if (const auto log_odds = maxLogOdds(map, result.box, budget)) {
    answer.max_probability = cuboid_mapping::toProbability(*log_odds);
  }
  answer.cuboids.reserve(result.cuboids.size());
  for (const cuboid_mapping::Cuboid& cuboid : result.cuboids) {
    const auto probability = meanProbability(map, cuboid.box, budget);
    if (!budget.spendAndYield()) break;
    answer.cuboids.push_back(
        {map.grid().toMetricBox(cuboid.box), cuboid.occupancy, probability.value_or(0.0)});
  }
  return answer;
}

}  // namespace

BoxAnswer answerBoxRequest(const MapInFrame& map, const BoxRequest& request) {
  std_msgs::Header header;
  header.frame_id = request.frame_id;
  header.stamp = request.stamp;
  RequestReader reader(map, header);
  reader.require(request.wanted_cuboids <= static_cast<std::uint8_t>(WantedCuboids::kAll),
                 "cuboids is " + std::to_string(request.wanted_cuboids) +
                     ": use one of the CUBOIDS_* values, 0 to 3");
  const CellBox box = reader.box(toPoint(request.box.min_m), toPoint(request.box.max_m), 0.0);
  if (!reader.isGood()) {
    BoxAnswer answer;
    answer.error = reader.error();
    return answer;
  }
  constexpr std::size_t kCuboidBytes = 53;
  return readWithin(map, kCuboidBytes,
                    [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
                      const auto content_of_box =
                          queryBox(content, box, toOutput(request), toFilter(request), budget);
                      BoxAnswer answer = toAnswer(content, content_of_box, budget);
                      answer.stamp = stamp;
                      if (budget.isSpent()) {
                        answer.cut = explain(budget.whyEnded(), map.limits) +
                                     "; ask for a smaller box, or for fewer cuboids";
                      }
                      return answer;
                    });
}

}  // namespace cuboid_mapping_ros
