// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/query_box.h"

#include "cuboid_mapping/ros/guarded_map.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/service_limits.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BoxQueryResult;
using cuboid_mapping::Budget;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::CuboidOutput;
using cuboid_mapping::MetricBox;

std::string toText(const MetricBox& box) {
  std::ostringstream text;
  text << "min (" << box.min_m.transpose() << "), max (" << box.max_m.transpose() << ")";
  return text.str();
}

/// What is wrong with a request that can be seen without map and tf; empty: nothing.
std::string findFault(const BoxRequest& request) {
  const MetricBox& box = request.box;
  if (request.wanted_cuboids > static_cast<std::uint8_t>(WantedCuboids::kAll)) {
    return "cuboids is " + std::to_string(request.wanted_cuboids) +
           ": use one of the CUBOIDS_* values, 0 to 3";
  }
  if (!box.min_m.allFinite() || !box.max_m.allFinite()) {
    return toText(box) + ": a coordinate is NaN or infinite; all must be numbers in metres";
  }
  if ((box.min_m.array() >= box.max_m.array()).any()) {
    return toText(box) + ": min must be less than max on every axis";
  }
  return {};
}

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

BoxAnswer makeError(const std::string& error) {
  BoxAnswer answer;
  answer.error = error;
  return answer;
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

MetricBox computeEnclosingBox(const Eigen::Isometry3d& T_target_source,
                              const MetricBox& box_source) {
  const Eigen::Vector3d center_source = 0.5 * (box_source.min_m + box_source.max_m);
  const Eigen::Vector3d half_source_m = 0.5 * (box_source.max_m - box_source.min_m);
  const Eigen::Vector3d center = T_target_source * center_source;
  const Eigen::Vector3d half_m = T_target_source.linear().cwiseAbs() * half_source_m;
  return {center - half_m, center + half_m};
}

BoxAnswer answerBoxRequest(const MapInFrame& map, const BoxRequest& request) {
  const std::string fault = findFault(request);
  if (!fault.empty()) return makeError(fault);

  MetricBox box_map = request.box;
  const std::string frame_id = withoutSlash(request.frame_id);
  if (!frame_id.empty() && frame_id != withoutSlash(map.frame_id)) {
    const TfLookup lookup = lookupTransform(map.tf, map.frame_id, frame_id, request.stamp);
    if (!lookup.T_target_source) {
      return makeError("no transform from frame '" + frame_id + "' to '" + map.frame_id +
                       "': " + lookup.error +
                       ". Check the name of the frame; stamp 0 takes the latest transform");
    }
    box_map = computeEnclosingBox(*lookup.T_target_source, request.box);
  }

  const auto box = map.map.grid().toCellBox(box_map);
  if (!box) {
    const double limit_m = cuboid_mapping::Grid::kMaxCell * map.map.grid().resolution();
    return makeError(toText(box_map) + " in frame '" + map.frame_id +
                     "' reaches beyond the map: keep coordinates within +-" +
                     std::to_string(limit_m) + " m");
  }
  constexpr std::size_t kCuboidBytes = 53;
  return readWithin(map, kCuboidBytes,
                    [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
                      const auto content_of_box =
                          queryBox(content, *box, toOutput(request), toFilter(request), budget);
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
