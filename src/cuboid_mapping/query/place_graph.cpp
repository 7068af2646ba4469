// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/place_graph.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

namespace cuboid_mapping {
namespace {

/// Cost of a node, for its memory here and in a search.
constexpr std::uint64_t kNode = 8;

}  // namespace

PlaceGraph::Range PlaceGraph::nodesIn(const Cell& brick) {
  if (const Range* known = bricks_.find(brick)) return *known;
  const auto first = static_cast<NodeIndex>(nodes_.size());
  const CellBox part = intersect(brickBox(brick), region_);
  if (!part.isEmpty()) {
    DividedBrick divided;
    divided.add(field_.inBrick(brick) & BrickMask::ofBox(part));
    const bool suffices = field_.budget().spend(kNode * static_cast<std::uint64_t>(divided.count));
    for (int i = 0; suffices && i < divided.count; ++i) {
      nodes_.push_back(unpackCuboid(brick, divided.box(i), Occupancy::kFree).box);
    }
  }
  return bricks_.findOrAdd(brick) = {brick, first, static_cast<NodeIndex>(nodes_.size())};
}

void PlaceGraph::findNodes(const CellBox& places, std::vector<NodeIndex>& nodes) {
  (void)anyBrick(places, [&](const Cell& brick) {
    const Range range = nodesIn(brick);
    for (NodeIndex node = range.first; node < range.last; ++node) {
      if (nodes_[node].intersects(places)) nodes.push_back(node);
    }
    return field_.budget().isSpent();  // Else on to the next brick.
  });
}

void PlaceGraph::findNeighbors(NodeIndex node, std::vector<Neighbor>& neighbors) {
  neighbors.clear();
  const CellBox box = nodes_[node];
  for (const int face : {0, 3, 1, 4, 2, 5}) {
    const CellBox beyond = slabBeyond(box, face);  // In one brick.
    const Range range = nodesIn(brickOf(beyond.min));
    for (NodeIndex other = range.first; other < range.last; ++other) {
      const CellBox places = intersect(nodes_[other], beyond);
      if (!places.isEmpty()) neighbors.push_back({other, places});
    }
  }
}

}  // namespace cuboid_mapping
