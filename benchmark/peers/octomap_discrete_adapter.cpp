// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"
#include "octomap_descent.h"

#include <cmath>

namespace cuboid_mapping::bench {
namespace {

octomap::point3d toPoint(const Eigen::Vector3f& point) { return {point.x(), point.y(), point.z()}; }

/// OctoMap with one ray for all points of a voxel, to its center. Its searches are those of `octomap`.
class OctomapDiscreteAdapter : public PeerAdapter {
 public:
  explicit OctomapDiscreteAdapter(const InsertionConfig& config)
      : tree_(std::make_unique<octomap::OcTree>(makeOctomap(config.map))),
        max_range_m_(std::isinf(config.max_range_m) ? -1.0 : config.max_range_m) {}

  [[nodiscard]] bool takesAnchors() const override { return false; }
  [[nodiscard]] std::string name() const override { return "octomap_discrete"; }

  void insert(const Scan& scan) override {
    octomap::Pointcloud cloud;
    cloud.reserve(scan.points.size());
    for (const Eigen::Vector3f& point : scan.points) cloud.push_back(toPoint(point));
    constexpr bool kLazy = false;
    constexpr bool kDiscretize = true;
    tree_->insertPointCloud(cloud, toPoint(scan.origin), max_range_m_, kLazy, kDiscretize);
  }

  void dropScratch() override {}
  void dropMap() override { tree_.reset(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    for (auto leaf = tree_->begin_leafs(); leaf != tree_->end_leafs(); ++leaf) {
      ++(tree_->isNodeOccupied(*leaf) ? figures.occupied_cells : figures.free_cells);
    }
    figures.cells = figures.occupied_cells + figures.free_cells;
    figures.leaf_nodes = figures.cells;
    figures.inner_nodes = tree_->size() - figures.leaf_nodes;
    figures.bytes_own = tree_->memoryUsage();
    return figures;
  }

  [[nodiscard]] bool offers(QueryKind /*kind*/) const override { return false; }
  [[nodiscard]] double visitOccupied() const override { return sumOccupied(*tree_); }
  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d&) const override { return {}; }
  [[nodiscard]] bool isAnyOccupied(const CellBox&) const override { return false; }
  [[nodiscard]] std::optional<double> castRay(const RayQuery&) const override { return {}; }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return compareWithOctomap(map, *tree_);
  }

 private:
  std::unique_ptr<octomap::OcTree> tree_;
  double max_range_m_;  ///< -1: no limit.
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOctomapDiscreteAdapter(const InsertionConfig& config) {
  return std::make_unique<OctomapDiscreteAdapter>(config);
}

}  // namespace cuboid_mapping::bench
