// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/cuboid_query.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <algorithm>
#include <unordered_map>

namespace cuboid_mapping {
namespace {

std::int32_t shortestEdge(const CellBox& box) {
  const Cell size = box.size();
  return std::min({size.x, size.y, size.z});
}

/// Whether a face is wide enough along its two axes.
bool isPassable(const CellBox& face, int normal, const Cell& passage) {
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != normal && face.max[axis] - face.min[axis] < passage[axis]) return false;
  }
  return true;
}

}  // namespace

Answer<std::vector<Cuboid>> selectCuboids(const CuboidMap& map, const CellBox& region,
                                          const CuboidSelection& selection, Budget& budget) {
  std::vector<Cuboid> cuboids;
  bool is_cut = false;
  visitBox(map, region, withinBudget(selection.filter), [&](const Cuboid& cuboid) {
    if (!budget.spend()) return Visit::kStop;
    if (!matches(selection.filter, cuboid)) return Visit::kContinue;
    if (shortestEdge(cuboid.box) < selection.min_edge) return Visit::kContinue;
    is_cut = cuboids.size() == selection.max_cuboids || !budget.addEntries();
    if (is_cut) return Visit::kStop;
    cuboids.push_back(
        {selection.is_clipped ? intersect(cuboid.box, region) : cuboid.box, cuboid.occupancy});
    return Visit::kContinue;
  });
  return answerWithAll(std::move(cuboids), !is_cut && !budget.isSpent());
}

Answer<FreeGraph> buildFreeGraph(const CuboidMap& map, const CellBox& region, const Cell& passage,
                                 Budget& budget, std::size_t max_cuboids) {
  auto free = selectCuboids(map, region, {CuboidFilter::kFree, 1, true, max_cuboids}, budget);
  if (free.isNotFound()) return AnswerStatus::kNotFound;
  FreeGraph graph;
  graph.cuboids = std::move(free.value);
  if (budget.isSpent()) return {AnswerStatus::kBudgetSpent, std::move(graph)};
  std::unordered_map<Cell, std::uint32_t, CellHash> numbers;
  for (const Cuboid& cuboid : graph.cuboids) {
    numbers.emplace(cuboid.box.min, static_cast<std::uint32_t>(numbers.size()));
  }
  for (std::uint32_t first = 0; first < graph.cuboids.size() && !budget.isSpent(); ++first) {
    if (!budget.spend()) break;
    const CellBox box = graph.cuboids[first].box;
    for (int axis = 0; axis < 3; ++axis) {
      const CellBox beyond = slabBeyond(box, axis + 3);
      visitBox(map, intersect(beyond, region), CuboidFilter::kFree, [&](const Cuboid& cuboid) {
        if (!budget.spend()) return Visit::kStop;
        const auto second = numbers.find(intersect(cuboid.box, region).min);
        CellBox face = intersect(cuboid.box, beyond);
        face.max[axis] = face.min[axis];
        if (second != numbers.end() && isPassable(face, axis, passage) && budget.addEntries()) {
          graph.portals.push_back({first, second->second, face});
        }
        return Visit::kContinue;
      });
    }
  }
  if (!free.isFound() || budget.isSpent()) return {AnswerStatus::kBudgetSpent, std::move(graph)};
  return graph;
}

}  // namespace cuboid_mapping
