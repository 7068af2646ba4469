// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/place_graph.h"

#include "cuboid_mapping/geometry/box_faces.h"

namespace cuboid_mapping {
namespace {

/// Cost of a node, for its memory here and in a search.
constexpr std::uint64_t kNode = 8;

/// Voxels of a box of the brick at the origin, in each of its slices.
std::uint64_t sliceOf(int x, int y, int width, int height) {
  return BrickMask::ofBox({{x, y, 0}, {x + width, y + height, 1}})[0];
}

bool holds(std::uint64_t mask, std::uint64_t part) { return (mask & part) == part; }

}  // namespace

void partitionMask(const Cell& brick, BrickMask mask, std::vector<CellBox>& boxes) {
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    std::uint64_t& slice = mask[z];
    while (slice != 0) {
      const int bit = __builtin_ctzll(slice);
      const int x = bit & 7;
      const int y = bit >> 3;
      int width = 1;
      while (x + width < kBrickEdge && holds(slice, sliceOf(x + width, y, 1, 1))) ++width;
      int height = 1;
      while (y + height < kBrickEdge && holds(slice, sliceOf(x, y + height, width, 1))) ++height;
      const std::uint64_t part = sliceOf(x, y, width, height);
      std::size_t end = z;
      while (end < kBrickEdge && holds(mask[end], part)) mask[end++] &= ~part;
      const Cell min = brick + Cell{x, y, static_cast<std::int32_t>(z)};
      boxes.push_back({min, min + Cell{width, height, static_cast<std::int32_t>(end - z)}});
    }
  }
}

PlaceGraph::Range PlaceGraph::nodesIn(const Cell& brick) {
  if (const Range* known = bricks_.find(brick)) return *known;
  const auto first = static_cast<NodeIndex>(nodes_.size());
  const CellBox part = intersect(brickBox(brick), region_);
  if (!part.isEmpty()) {
    std::vector<CellBox> boxes;
    partitionMask(brick, field_.inBrick(brick) & BrickMask::ofBox(part), boxes);
    if (!field_.budget().spend(kNode * boxes.size())) boxes.clear();
    nodes_.insert(nodes_.end(), boxes.begin(), boxes.end());
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
