// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/passages.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>

namespace cuboid_mapping {
namespace {

constexpr std::size_t kNoPart = std::numeric_limits<std::size_t>::max();

std::vector<Cell> findFreeBricks(const CuboidMap& map, const CellBox& region) {
  std::vector<Cell> bricks;
  map.voxels().forEachIn(region, [&](const VoxelBrick& brick) {
    if (!brick.voxels.free().isEmpty()) bricks.push_back(brick.brick);
  });
  std::sort(bricks.begin(), bricks.end(), isBeforeOnMortonCurve);
  return bricks;
}

/// The place of a set in a box that is nearest to the middle; nothing if there is none.
std::optional<Cell> findMiddle(const VoxelSet& places, const CellBox& box) {
  const Eigen::Vector3d middle = 0.5 * (toVector(box.min) + toVector(box.max));
  std::optional<Cell> best;
  double least = std::numeric_limits<double>::infinity();
  places.forEachBrickIn(box, [&](const Cell& brick, const BrickMask& mask) {
    forEachCell(brick, mask, [&](const Cell& place) {
      const double distance = (toVector(place) - middle).squaredNorm();
      if (distance < least) best = place;
      least = std::min(least, distance);
    });
  });
  return best;
}

}  // namespace

Passages::Places::Places(const Obstacles& obstacles, const CellBox& region, const Cell& size,
                         const std::vector<Cell>& bricks)
    : field(obstacles, size), graph(field, field.placesIn(region)) {
  std::vector<Node> nodes;
  for (const Cell& brick : bricks) graph.findNodes(brickBox(brick), nodes);
  part_of.assign(graph.numNodes(), kNoPart);
  for (const Node node : nodes) {
    if (part_of[node] == kNoPart) fill(node, num_places.size());
  }
}

/// Gives all nodes that are connected with one a new part.
void Passages::Places::fill(Node first, std::size_t number) {
  num_places.push_back(0.0);
  part_of[first] = number;
  std::vector<Node> open{first};
  std::vector<PlaceGraph::Neighbor> neighbors;
  while (!open.empty()) {
    const Node node = open.back();
    open.pop_back();
    num_places[number] += graph.box(node).numVoxels();
    graph.findNeighbors(node, neighbors);
    for (const PlaceGraph::Neighbor& neighbor : neighbors) {
      if (part_of[neighbor.node] != kNoPart) continue;
      part_of[neighbor.node] = number;
      open.push_back(neighbor.node);
    }
  }
}

Passages::Passages(const CuboidMap& map, const CellBox& region, const Cell& size, Budget& budget)
    : map_(map),
      region_(intersect(region, map.bounds().value_or(CellBox()))),
      size_(size),
      budget_(budget),
      bricks_(findFreeBricks(map, region_)),
      obstacles_(map, UnknownPolicy::kObstacle, budget),
      all_(obstacles_, region_, size, bricks_) {}

Passages::Node Passages::nodeAt(const Cell& place) {
  found_.clear();
  all_.graph.findNodes(CellBox::ofCell(place), found_);
  return found_.front();
}

/// Whether each part beside a cover is the largest one in its part of the map.
std::vector<bool> Passages::findKept(const Places& beside) {
  std::vector<std::size_t> largest(all_.num_places.size(), kNoPart);
  for (Node node = 0; node < beside.part_of.size(); ++node) {
    std::size_t& best = largest[all_.part_of[nodeAt(beside.graph.box(node).min)]];
    const std::size_t part = beside.part_of[node];
    if (best == kNoPart || beside.num_places[part] > beside.num_places[best]) best = part;
  }
  std::vector<bool> is_kept(beside.num_places.size(), false);
  for (const std::size_t part : largest) {
    if (part != kNoPart) is_kept[part] = true;
  }
  return is_kept;
}

/// Dijkstra's search from all kept places.
std::vector<Passages::Step> Passages::findWays(const Places& beside,
                                               const std::vector<bool>& is_kept) {
  using Item = std::pair<double, Node>;
  std::vector<Step> steps(all_.graph.numNodes(),
                          Step{std::numeric_limits<double>::infinity(), PlaceGraph::kNoNode, {}});
  std::priority_queue<Item, std::vector<Item>, std::greater<>> open;
  for (Node node = 0; node < beside.part_of.size(); ++node) {
    if (!is_kept[beside.part_of[node]]) continue;
    const CellBox& box = beside.graph.box(node);
    const Node in_map = nodeAt(box.min);
    Step& step = steps[in_map];
    if (step.cost == 0.0 && step.target.numVoxels() >= box.numVoxels()) continue;
    step.cost = 0.0;
    step.target = intersect(box, all_.graph.box(in_map));
    open.push({0.0, in_map});
  }
  std::vector<PlaceGraph::Neighbor> neighbors;
  while (!open.empty() && budget_.spend()) {
    const auto [cost, node] = open.top();
    open.pop();
    if (cost > steps[node].cost) continue;
    const Cell from = steps[node].target.min;
    all_.graph.findNeighbors(node, neighbors);
    for (const PlaceGraph::Neighbor& neighbor : neighbors) {
      const Cell entry = clampTo(neighbor.places, from);
      const double through = cost + (toVector(entry) - toVector(from)).norm();
      Step& step = steps[neighbor.node];
      if (through >= step.cost) continue;
      step = {through, node, CellBox::ofCell(entry)};
      open.push({through, neighbor.node});
    }
  }
  return steps;
}

LostPassage Passages::makePassage(Node node, const Cell& place,
                                  const std::vector<Step>& steps) const {
  LostPassage passage{all_.field.coveredAt(CellBox::ofCell(place)), {}};
  passage.way.push_back(passage.place);
  if (steps[node].target.isEmpty()) return passage;  // Nothing of this part of the map is kept.
  Cell at = place;
  while (true) {
    const Step& step = steps[node];
    const Cell next = clampTo(step.target, at);
    passage.way.push_back(all_.field.coveredAt(unite(CellBox::ofCell(at), CellBox::ofCell(next))));
    if (step.parent == PlaceGraph::kNoNode) return passage;
    at = clampTo(all_.graph.box(step.parent), next);
    passage.way.push_back(all_.field.coveredAt(unite(CellBox::ofCell(next), CellBox::ofCell(at))));
    node = step.parent;
  }
}

std::vector<LostPassage> Passages::findLost(const VoxelSet& cover) {
  const Obstacles obstacles(map_, UnknownPolicy::kObstacle, budget_, &cover);
  Places beside(obstacles, region_, size_, bricks_);
  const std::vector<bool> is_kept = findKept(beside);
  VoxelSet kept(budget_);
  for (Node node = 0; node < beside.part_of.size(); ++node) {
    if (is_kept[beside.part_of[node]]) kept.add(beside.graph.box(node));
  }
  VoxelSet lost(budget_);  // Of few bricks: most places are kept themselves.
  for (Node node = 0; node < all_.part_of.size(); ++node) {
    const CellBox& box = all_.graph.box(node);
    const Cell brick = brickOf(box.min);
    lost.add(brick, BrickMask::ofBox(box).without(kept.inBrick(brick)));
  }
  for (Node node = 0; node < beside.part_of.size(); ++node) {
    if (is_kept[beside.part_of[node]]) lost.remove(dilate(beside.graph.box(node), size_));
  }
  if (lost.size() == 0.0 || budget_.isSpent()) return {};
  const std::vector<Step> steps = findWays(beside, is_kept);
  std::vector<LostPassage> passages = findCutOff(beside, is_kept, steps, lost);
  addFilled(steps, lost, passages);
  return passages;
}

/// Spaces that the cover cuts off, the largest first: a way from where they are nearest to the kept places.
/// @param lost  Without these spaces afterwards.
std::vector<LostPassage> Passages::findCutOff(const Places& beside,
                                              const std::vector<bool>& is_kept,
                                              const std::vector<Step>& steps, VoxelSet& lost) {
  std::vector<std::vector<Node>> parts(beside.num_places.size());
  for (Node node = 0; node < beside.part_of.size(); ++node) {
    if (!is_kept[beside.part_of[node]]) parts[beside.part_of[node]].push_back(node);
  }
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return beside.num_places[a] > beside.num_places[b];
  });
  std::vector<LostPassage> passages;
  for (const std::size_t part : order) {
    std::optional<Cell> place;
    Node nearest = PlaceGraph::kNoNode;
    Cell from;
    for (const Node node : parts[part]) {
      const CellBox box = beside.graph.box(node);
      if (!place) place = findMiddle(lost, box);
      const Node in_map = nodeAt(box.min);
      if (nearest != PlaceGraph::kNoNode && steps[in_map].cost >= steps[nearest].cost) continue;
      nearest = in_map;
      from = clampTo(box, steps[in_map].target.min);
    }
    if (!place) continue;
    passages.push_back(makePassage(nearest, from, steps));
    passages.back().place = all_.field.coveredAt(CellBox::ofCell(*place));
    for (const Node node : parts[part]) lost.remove(dilate(beside.graph.box(node), size_));
  }
  return passages;
}

/// Spaces that the cover fills. @param lost  Empty afterwards.
void Passages::addFilled(const std::vector<Step>& steps, VoxelSet& lost,
                         std::vector<LostPassage>& passages) const {
  std::vector<Node> nodes(all_.part_of.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  std::stable_sort(nodes.begin(), nodes.end(), [&](Node a, Node b) {
    return all_.graph.box(a).numVoxels() > all_.graph.box(b).numVoxels();
  });
  for (const Node node : nodes) {
    while (const auto place = findMiddle(lost, all_.graph.box(node))) {
      passages.push_back(makePassage(node, *place, steps));
      for (const CellBox& box : passages.back().way) {
        lost.remove(dilate(all_.field.placesIn(box), size_));
      }
    }
  }
}

}  // namespace cuboid_mapping
