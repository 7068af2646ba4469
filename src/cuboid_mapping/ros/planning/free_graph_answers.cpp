// SPDX-License-Identifier: BSD-3-Clause
// Answers about free space as a graph.
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "cuboid_mapping/query/cuboid_query.h"

namespace cuboid_mapping_ros {
namespace {

constexpr std::size_t kPortalBytes = 56;

}  // namespace

void answer(ServiceCall& call, const GetFreeGraph::Request& request,
            GetFreeGraph::Response& response) {
  const CellBox region = call.box(request.region, 0.0, {"region"});
  const double inflation_m = ServiceCall::notNegative(request.inflation, "inflation");
  Cell passage;
  if (inflation_m > 0.0 || request.size != geometry_msgs::Vector3()) {
    const auto size = call.map().grid().toSizeInCells(call.size(request.size, inflation_m));
    if (!size) throw Refusal("size is larger than any map: give the robot's edges in metres");
    passage = *size;
  }
  call.read(kPortalBytes, [&](const CuboidMap& map, Budget& budget) {
    const auto graph = buildFreeGraph(map, region, passage, budget, toLimit(request.limit));
    noteCut(call, budget, graph.status == AnswerStatus::kBudgetSpent);
    for (const Cuboid& cuboid : graph.value.cuboids) {
      response.cuboids.push_back(boxMessage(map.grid(), cuboid.box));
    }
    for (const auto& portal : graph.value.portals) {
      response.first.push_back(portal.first);
      response.second.push_back(portal.second);
      response.portals.push_back(boxMessage(map.grid(), portal.face));
    }
  });
}

}  // namespace cuboid_mapping_ros
