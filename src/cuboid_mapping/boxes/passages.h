// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/obstacles.h"
#include "cuboid_mapping/query/place_graph.h"
#include "cuboid_mapping/query/voxel_set.h"

#include <vector>

namespace cuboid_mapping {

/// Space that a robot can reach in a map, and no longer beside a cover.
struct LostPassage {
  CellBox place;             ///< The robot's box in that space.
  std::vector<CellBox> way;  ///< Boxes of free voxels from there to the space that it keeps.
};

/// The places of a robot, a box that does not turn, between the known free voxels of a region.
///
/// Places that are connected in the map should stay connected beside a cover. The cover also takes places beside
/// obstacles: such a place is lost only if no place at most the robot's edges away stays. Not thread-safe.
class Passages {
 public:
  /// @param map  Must outlive this object, as must the budget. @param size  Edges of the robot in voxels.
  Passages(const CuboidMap& map, const CellBox& region, const Cell& size, Budget& budget);

  /// One passage for each space that is lost beside a cover, the largest space first.
  /// @complexity O(p log p) for p boxes of places, and O(bricks within the robot's edges of each).
  [[nodiscard]] std::vector<LostPassage> findLost(const VoxelSet& cover);

 private:
  using Node = PlaceGraph::NodeIndex;

  /// Places in parts: two places are connected if and only if they are in one part.
  struct Places {
    Places(const Obstacles& obstacles, const CellBox& region, const Cell& size,
           const std::vector<Cell>& bricks);
    void fill(Node first, std::size_t number);

    FitField field;
    PlaceGraph graph;
    std::vector<std::size_t> part_of;  ///< By node.
    std::vector<double> num_places;    ///< By part.
  };
  /// The best way from a node to the kept places.
  struct Step {
    double cost;
    Node parent = PlaceGraph::kNoNode;
    CellBox target;  ///< Kept places of the node, or the place where the way enters it.
  };

  [[nodiscard]] std::vector<bool> findKept(const Places& beside);
  [[nodiscard]] std::vector<Step> findWays(const Places& beside, const std::vector<bool>& is_kept);
  [[nodiscard]] LostPassage makePassage(Node node, const Cell& place,
                                        const std::vector<Step>& steps) const;
  [[nodiscard]] std::vector<LostPassage> findCutOff(const Places& beside,
                                                    const std::vector<bool>& is_kept,
                                                    const std::vector<Step>& steps, VoxelSet& lost);
  void addFilled(const std::vector<Step>& steps, VoxelSet& lost,
                 std::vector<LostPassage>& passages) const;
  [[nodiscard]] Node nodeAt(const Cell& place);

  const CuboidMap& map_;
  CellBox region_;
  Cell size_;
  Budget& budget_;
  std::vector<Cell> bricks_;  ///< Bricks with a free voxel.
  Obstacles obstacles_;
  Places all_;
  std::vector<Node> found_;
};

}  // namespace cuboid_mapping
