// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/interop/octomap_parity.h"

#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

octomap::point3d toPoint(const Eigen::Vector3f& point) { return {point.x(), point.y(), point.z()}; }

/// Voxels of a leaf, which may be pruned.
CellBox leafBox(const octomap::OcTree::leaf_iterator& leaf, const octomap::OcTree& tree) {
  const octomap::OcTreeKey key = leaf.getIndexKey();
  const std::int32_t edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
  const std::int32_t center = 1 << (tree.getTreeDepth() - 1);
  const Cell min{key[0] - center, key[1] - center, key[2] - center};
  return {min, min + Cell{edge, edge, edge}};
}

}  // namespace

octomap::OcTree makeOctomap(const MapConfig& config) {
  octomap::OcTree tree(config.resolution_m);
  tree.setProbHit(config.sensor_model.hit);
  tree.setProbMiss(config.sensor_model.miss);
  tree.setClampingThresMin(config.sensor_model.alpha_min);
  tree.setClampingThresMax(config.sensor_model.alpha_max);
  return tree;
}

void insertIntoOctomap(const Scan& scan, double max_range_m, octomap::OcTree& tree) {
  assert(scan.anchor_map.isZero() && scan.no_returns.empty());
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) cloud.push_back(toPoint(point));
  const octomap::point3d origin = toPoint(scan.origin);
  if (std::isinf(max_range_m)) {
    tree.insertPointCloud(cloud, origin, -1.0, false, false);
    return;
  }
  octomap::KeySet free_cells;
  octomap::KeySet occupied_cells;
  tree.computeUpdate(cloud, origin, free_cells, occupied_cells, max_range_m);
  for (const octomap::point3d& point : cloud) {
    if ((point - origin).norm() <= max_range_m) continue;
    octomap::OcTreeKey key;
    const octomap::point3d cut =
        origin + (point - origin).normalized() * static_cast<float>(max_range_m);
    if (tree.coordToKeyChecked(cut, key) && occupied_cells.count(key) == 0) free_cells.insert(key);
  }
  for (const octomap::OcTreeKey& key : free_cells) tree.updateNode(key, false);
  for (const octomap::OcTreeKey& key : occupied_cells) tree.updateNode(key, true);
}

Agreement compareWithOctomap(const CuboidMap& map, const octomap::OcTree& tree) {
  Agreement agreement;
  double known_to_both = 0.0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const CellBox box = leafBox(leaf, tree);
    const float expected = leaf->getLogOdds();
    agreement.voxels += box.numVoxels();
    visitValues(map, box, Budget::unlimited(), [&](float log_odds, int count) {
      known_to_both += count;
      if (classify(log_odds) != classify(expected)) agreement.class_mismatch += count;
      agreement.max_log_odds_difference =
          std::max<double>(agreement.max_log_odds_difference, std::abs(log_odds - expected));
    });
  }
  const double known = map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels();
  agreement.known_mismatch = (agreement.voxels - known_to_both) + (known - known_to_both);
  return agreement;
}

}  // namespace cuboid_mapping
