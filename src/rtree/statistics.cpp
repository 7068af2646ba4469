// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/statistics.h"

namespace cuboid_mapping {
namespace {

/// Sums while the tree is walked.
struct LevelSums {
  double volume = 0.0;
  double shared_volume = 0.0;
};

void addNode(const RTree& tree, NodeIndex index, int level, TreeStatistics& statistics,
             std::vector<LevelSums>& sums) {
  const Node& node = tree.node(level, index);
  const auto at = static_cast<std::size_t>(level);
  ++statistics.levels[at].num_nodes;
  statistics.levels[at].num_branches += static_cast<std::size_t>(node.count());
  for (int i = 0; i < node.count(); ++i) {
    sums[at].volume += node.box(i).numVoxels();
    for (int j = 0; j < i; ++j) {
      sums[at].shared_volume += intersect(node.box(i), node.box(j)).numVoxels();
    }
    if (level > 0) addNode(tree, node.child()[i], level - 1, statistics, sums);
  }
}

}  // namespace

TreeStatistics computeStatistics(const RTree& tree) {
  TreeStatistics statistics;
  statistics.levels.resize(static_cast<std::size_t>(tree.height()));
  statistics.num_cuboids = tree.size();
  statistics.num_bytes = tree.numBytes();
  std::vector<LevelSums> sums(statistics.levels.size());
  addNode(tree, tree.root(), tree.height() - 1, statistics, sums);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    LevelStatistics& level = statistics.levels[i];
    level.fill_ratio = static_cast<double>(level.num_branches) /
                       (static_cast<double>(level.num_nodes) * tree.config().max_branches);
    if (sums[i].volume > 0.0) level.overlap_ratio = sums[i].shared_volume / sums[i].volume;
  }
  return statistics;
}

}  // namespace cuboid_mapping
