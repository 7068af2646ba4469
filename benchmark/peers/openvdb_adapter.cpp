// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"

#include "peers/agreement_counter.h"
#include "peers/beams.h"
#include "timing.h"

#include "cuboid_mapping/geometry/brick.h"

#define TBB_PREVIEW_GLOBAL_CONTROL 1  // for TBB before 2021
#include <openvdb/math/DDA.h>
#include <openvdb/math/Ray.h>
#include <openvdb/openvdb.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping::bench {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

// Not registered with their trees, which is quicker; so they must be cleared with them.
using UpdateAccessor = openvdb::tree::ValueAccessor<openvdb::BoolTree, false>;
using MapAccessor = openvdb::tree::ValueAccessor<openvdb::FloatTree, false>;
using ConstMapAccessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree, false>;

Coord toCoord(const Cell& cell) { return {cell.x, cell.y, cell.z}; }

/// The voxels of a leaf node, which has the size of a brick.
CellBox leafCells(const openvdb::FloatTree::LeafNodeType& leaf) {
  static_assert(openvdb::FloatTree::LeafNodeType::DIM == kBrickEdge, "a leaf is a brick");
  const Coord origin = leaf.origin();
  return brickBox({origin.x(), origin.y(), origin.z()});
}

/// The voxels of one cloud: active ones are observed, those that are true are hits.
class UpdateGrid {
 public:
  UpdateGrid(const Grid& grid, double max_range_m) : grid_(grid), max_range_m_(max_range_m) {}

  void compute(const Scan& scan) {
    accessor_.clear();
    tree_.clear();
    forEachBeam(grid_, max_range_m_, scan, [this](const Ray& ray, bool is_hit) {
      forEachMiss(ray, [this](const Cell& cell) { accessor_.setActiveState(toCoord(cell), true); });
      if (is_hit) {
        accessor_.setValueOn(toCoord(ray.end), true);
      } else {
        accessor_.setActiveState(toCoord(ray.end), true);
      }
    });
  }

  [[nodiscard]] const openvdb::BoolTree& tree() const { return tree_; }

 private:
  Grid grid_;
  double max_range_m_;
  openvdb::BoolTree tree_{false};
  UpdateAccessor accessor_{tree_};
};

class OpenvdbAdapter : public PeerAdapter {
 public:
  explicit OpenvdbAdapter(const InsertionConfig& config)
      : grid_(config.map.resolution_m),
        sensor_model_(config.map.sensor_model, config.map.environment),
        control_(tbb::global_control::max_allowed_parallelism,
                 static_cast<std::size_t>(config.map.threads)),
        update_(std::make_unique<UpdateGrid>(grid_, config.max_range_m)),
        tree_(std::make_unique<openvdb::FloatTree>(0.0F)),
        accessor_(std::make_unique<MapAccessor>(*tree_)),
        const_accessor_(std::make_unique<ConstMapAccessor>(*tree_)) {}

  [[nodiscard]] std::string name() const override { return "openvdb"; }

  void insert(const Scan& scan) override {
    ray_walk_cpu_s_ += timeOf([&] { update_->compute(scan); }).cpu_s;
    for (auto leaf = update_->tree().cbeginLeaf(); leaf; ++leaf) {
      for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
        const float observation = *voxel ? sensor_model_.hit() : sensor_model_.miss();
        accessor_->modifyValueAndActiveState(
            voxel.getCoord(), [this, observation](float& log_odds, bool& is_known) {
              log_odds = sensor_model_.update(log_odds, observation);  // 0 where unknown
              is_known = true;
            });
      }
    }
  }

  void dropScratch() override { update_.reset(); }

  void dropMap() override {
    const_accessor_.reset();
    accessor_.reset();
    tree_.reset();
  }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    for (auto leaf = tree_->cbeginLeaf(); leaf; ++leaf) {
      for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
        ++(classify(*voxel) == Occupancy::kOccupied ? figures.occupied_cells : figures.free_cells);
      }
    }
    figures.cells = figures.occupied_cells + figures.free_cells;
    figures.leaf_nodes = tree_->leafCount();
    figures.inner_nodes = tree_->nonLeafCount();
    figures.bytes_own = tree_->memUsage();
    figures.ray_walk_cpu_s = ray_walk_cpu_s_;
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    double sum = 0.0;
    for (auto leaf = tree_->cbeginLeaf(); leaf; ++leaf) {
      for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
        if (classify(*voxel) == Occupancy::kOccupied) sum += voxel.getCoord().x();
      }
    }
    return sum;
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const auto cell = grid_.toCell(point_map);
    float log_odds = 0.0F;
    if (!cell || !const_accessor_->probeValue(toCoord(*cell), log_odds)) return Occupancy::kUnknown;
    return classify(log_odds);
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    const Cell first = brickOf(box.min);
    for (int z = first.z; z < box.max.z; z += kBrickEdge) {
      for (int y = first.y; y < box.max.y; y += kBrickEdge) {
        for (int x = first.x; x < box.max.x; x += kBrickEdge) {
          const auto* leaf = const_accessor_->probeConstLeaf({x, y, z});
          if (leaf != nullptr && isAnyOccupied(*leaf, box)) return true;
        }
      }
    }
    return false;
  }

  /// Voxel by voxel in leaf nodes, and where there is none, on to the next one, as VolumeRayIntersector finds it.
  [[nodiscard]] std::optional<double> castRay(const RayQuery& query) const override {
    using IndexRay = openvdb::math::Ray<double>;
    constexpr int kLevelBelowRoot = openvdb::FloatTree::RootNodeType::ChildNodeType::LEVEL;
    const Eigen::Vector3d origin = grid_.toCellUnits(query.origin_map);
    const Eigen::Vector3d& direction = query.direction;
    const double end = kRayRange_m / grid_.resolution();
    IndexRay ray({origin.x(), origin.y(), origin.z()},
                 {direction.x(), direction.y(), direction.z()}, 0.0, end);
    openvdb::math::VolumeHDDA<openvdb::FloatTree, IndexRay, kLevelBelowRoot> nodes;
    openvdb::math::DDA<IndexRay> voxels(ray);
    while (true) {
      float log_odds = 0.0F;
      if (const_accessor_->probeValue(voxels.voxel(), log_odds)) {
        if (classify(log_odds) == Occupancy::kOccupied) return voxels.time() * grid_.resolution();
      } else if (const_accessor_->probeConstLeaf(voxels.voxel()) == nullptr) {
        const double left_at = voxels.next();
        ray.setTimes(left_at, end);
        const IndexRay::TimeSpan known = nodes.march(ray, *const_accessor_);
        if (!known.valid()) return std::nullopt;
        // Beyond the face, whatever is rounded.
        ray.setTimes(std::max(known.t0, left_at) + openvdb::math::Delta<double>::value(), end);
        voxels.init(ray);
        continue;
      }
      if (!voxels.step()) return std::nullopt;
    }
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    AgreementCounter counter(map);
    for (auto leaf = tree_->cbeginLeaf(); leaf; ++leaf) {
      for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
        const Coord coord = voxel.getCoord();
        counter.add(CellBox::ofCell({coord.x(), coord.y(), coord.z()}), *voxel);
      }
    }
    return counter.result();
  }

 private:
  using Leaf = openvdb::FloatTree::LeafNodeType;

  [[nodiscard]] static bool isAnyOccupied(const Leaf& leaf, const CellBox& box) {
    const bool is_whole = box.contains(leafCells(leaf));
    for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) {
      if (classify(*voxel) != Occupancy::kOccupied) continue;
      if (is_whole) return true;
      const Coord coord = voxel.getCoord();
      if (box.contains(Cell{coord.x(), coord.y(), coord.z()})) return true;
    }
    return false;
  }

  Grid grid_;
  SensorModel sensor_model_;
  tbb::global_control control_;
  std::unique_ptr<UpdateGrid> update_;
  std::unique_ptr<openvdb::FloatTree> tree_;
  std::unique_ptr<MapAccessor> accessor_;
  std::unique_ptr<ConstMapAccessor> const_accessor_;
  double ray_walk_cpu_s_ = 0.0;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOpenvdbAdapter(const InsertionConfig& config) {
  return std::make_unique<OpenvdbAdapter>(config);
}

}  // namespace cuboid_mapping::bench
