// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"
#include "octomap_descent.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cuboid_mapping::bench {
namespace {

using octomap::OcTree;
using octomap::OcTreeKey;

octomap::point3d toPoint(const Eigen::Vector3d& point) {
  const Eigen::Vector3f p = point.cast<float>();
  return {p.x(), p.y(), p.z()};
}

/// Key of a cell, or the nearest one that OctoMap has.
OcTreeKey toKey(const Cell& cell, const OcTree& tree) {
  const int center = 1 << (tree.getTreeDepth() - 1);
  OcTreeKey key;
  for (int axis = 0; axis < 3; ++axis) {
    key[static_cast<unsigned>(axis)] =
        static_cast<octomap::key_type>(std::clamp(cell[axis], -center, center - 1) + center);
  }
  return key;
}

/// The voxels of a leaf, which may be a pruned one.
template <typename LeafIteratorT>
CellBox leafBox(const LeafIteratorT& leaf, const OcTree& tree) {
  const OcTreeKey key = leaf.getIndexKey();
  const std::int32_t edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
  const std::int32_t center = 1 << (tree.getTreeDepth() - 1);
  const Cell min{key[0] - center, key[1] - center, key[2] - center};
  return {min, min + Cell{edge, edge, edge}};
}

class OctomapAdapter : public PeerAdapter {
 public:
  explicit OctomapAdapter(const InsertionConfig& config)
      : OctomapAdapter(std::make_unique<OcTree>(makeOctomap(config.map)), config.max_range_m) {}

  [[nodiscard]] bool takesAnchors() const override { return false; }
  [[nodiscard]] std::string name() const override { return "octomap"; }
  void insert(const Scan& scan) override { insertIntoOctomap(scan, max_range_m_, *tree_); }
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

  [[nodiscard]] double visitOccupied() const override {
    double sum = 0.0;
    for (auto leaf = tree_->begin_leafs(); leaf != tree_->end_leafs(); ++leaf) {
      if (tree_->isNodeOccupied(*leaf)) sum += leaf.getX();
    }
    return sum;
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const octomap::OcTreeNode* node = tree_->search(toPoint(point_map));
    if (node == nullptr) return Occupancy::kUnknown;
    return tree_->isNodeOccupied(node) ? Occupancy::kOccupied : Occupancy::kFree;
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    const OcTreeKey min = toKey(box.min, *tree_);
    const OcTreeKey max = toKey(box.max - Cell{1, 1, 1}, *tree_);
    const auto end = tree_->end_leafs_bbx();
    for (auto leaf = tree_->begin_leafs_bbx(min, max); leaf != end; ++leaf) {
      // The iterator also gives pruned leaves that only touch the box.
      if (tree_->isNodeOccupied(*leaf) && leafBox(leaf, *tree_).intersects(box)) return true;
    }
    return false;
  }

  [[nodiscard]] std::optional<double> castRay(const RayQuery& ray) const override {
    const octomap::point3d origin = toPoint(ray.origin_map);
    octomap::point3d end;
    if (!tree_->castRay(origin, toPoint(ray.direction), end, true, kRayRange_m)) {
      return std::nullopt;
    }
    return (end - origin).norm();
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return compareWithOctomap(map, *tree_);
  }

 protected:
  OctomapAdapter(std::unique_ptr<OcTree> tree, double max_range_m)
      : tree_(std::move(tree)), max_range_m_(max_range_m) {}

  [[nodiscard]] const OcTree& tree() const { return *tree_; }
  OcTree& tree() { return *tree_; }
  [[nodiscard]] double maxRange_m() const { return max_range_m_; }

 private:
  std::unique_ptr<OcTree> tree_;
  double max_range_m_;
};

/// Leaves inner nodes as they are, whatever its callers ask for.
class LazyOcTree : public OcTree {
 public:
  explicit LazyOcTree(const OcTree& tree) : OcTree(tree) {}

  using OcTree::updateNode;
  octomap::OcTreeNode* updateNode(const OcTreeKey& key, bool occupied,
                                  bool /*lazy_eval*/ = false) override {
    return OcTree::updateNode(key, occupied, true);
  }
};

class LazyOctomapAdapter : public OctomapAdapter {
 public:
  explicit LazyOctomapAdapter(const InsertionConfig& config)
      : OctomapAdapter(std::make_unique<LazyOcTree>(makeOctomap(config.map)), config.max_range_m) {}

  [[nodiscard]] std::string name() const override { return "octomap_lazy"; }

  void finish() override {
    tree().updateInnerOccupancy();
    tree().prune();
  }

  [[nodiscard]] double visitOccupied() const override { return sumOccupied(tree()); }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    return bench::isAnyOccupied(tree(), box);
  }
};

/// Its searches are those of OctomapAdapter, and not asked again.
class DiscreteOctomapAdapter : public OctomapAdapter {
 public:
  using OctomapAdapter::OctomapAdapter;

  [[nodiscard]] std::string name() const override { return "octomap_discrete"; }
  [[nodiscard]] bool offers(QueryKind /*kind*/) const override { return false; }

  void insert(const Scan& scan) override {
    octomap::Pointcloud cloud;
    cloud.reserve(scan.points.size());
    for (const Eigen::Vector3f& point : scan.points) cloud.push_back(toPoint(point.cast<double>()));
    constexpr bool kLazy = false;
    constexpr bool kDiscretize = true;
    tree().insertPointCloud(cloud, toPoint(scan.origin.cast<double>()),
                            std::isinf(maxRange_m()) ? -1.0 : maxRange_m(), kLazy, kDiscretize);
  }
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOctomapAdapter(const InsertionConfig& config) {
  return std::make_unique<OctomapAdapter>(config);
}

std::unique_ptr<PeerAdapter> makeLazyOctomapAdapter(const InsertionConfig& config) {
  return std::make_unique<LazyOctomapAdapter>(config);
}

std::unique_ptr<PeerAdapter> makeDiscreteOctomapAdapter(const InsertionConfig& config) {
  return std::make_unique<DiscreteOctomapAdapter>(config);
}

}  // namespace cuboid_mapping::bench
