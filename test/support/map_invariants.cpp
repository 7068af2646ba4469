// SPDX-License-Identifier: BSD-3-Clause
#include "support/map_invariants.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/rtree/traversal.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "support/tree_invariants.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace cuboid_mapping {
namespace {

bool isBefore(const Cuboid& a, const Cuboid& b) {
  return a.box.min != b.box.min ? a.box.min < b.box.min : a.box.max < b.box.max;
}

/// Checks all parts of a map and collects violations.
class MapChecker {
 public:
  explicit MapChecker(const CuboidMap& map) : map_(map), voxels_(map.voxels()) {}

  std::vector<std::string> check() {
    const CuboidTree& tree = map_.cuboids();
    add(checkNodes(tree.inner(), [&](NodeIndex leaf) { return summaryOf(leaf); }));
    expect(numLeaves() == voxels_.size(), "leaf nodes are lost", numLeaves());
    checkStore();
    if (tree.grown() != nullptr) {
      tree.grown()->forEach([&](const GrownBrick& brick) { checkGrown(brick, *tree.grown()); });
    }
    visitAll(map_, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      cover(cuboid);
      return Visit::kContinue;
    });
    covers_.forEach([&](const Cover& cover) { checkCover(cover); });
    voxels_.forEach([&](const VoxelBrick& brick) {
      expect(covers_.find(brick.brick) != nullptr, "brick without cuboids", brick.brick);
    });
    return std::move(violations_);
  }

 private:
  /// Cuboids that cover a brick.
  struct Cover {
    Cell brick;
    BrickMask free;
    BrickMask occupied;
    std::vector<Cuboid> cuboids;  ///< Cuboids with their least cell in the brick.
  };

  void add(const std::vector<std::string>& violations) {
    violations_.insert(violations_.end(), violations.begin(), violations.end());
  }
  template <typename PlaceT>
  void expect(bool holds, const char* text, const PlaceT& place) {
    if (holds) return;
    std::ostringstream out;
    out << text << " (" << place << ")";
    violations_.push_back(out.str());
  }

  void checkStore() {
    double num_free = 0.0;
    double num_occupied = 0.0;
    std::size_t num_bricks = 0;
    voxels_.forEach([&](const VoxelBrick& brick) {
      checkVoxels(brick);
      num_free += brick.voxels.free().count();
      num_occupied += brick.voxels.occupied().count();
      ++num_bricks;
      const CellBox known = boundsOf(brick);
      bounds_ = bounds_ ? unite(*bounds_, known) : known;
    });
    expect(num_bricks == voxels_.size(), "size() is not the number of bricks", voxels_.size());
    expect(num_free == voxels_.numFreeVoxels(), "wrong number of free voxels", num_free);
    expect(num_occupied == voxels_.numOccupiedVoxels(), "wrong number of occupied voxels",
           num_occupied);
    expect(bounds_ == map_.bounds(), "wrong bounds", bounds_.value_or(CellBox()));
  }

  /// Box around the known voxels of a brick.
  static CellBox boundsOf(const VoxelBrick& brick) {
    std::optional<CellBox> bounds;
    forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
      const CellBox box = CellBox::ofCell(cell);
      bounds = bounds ? unite(*bounds, box) : box;
    });
    return bounds.value_or(CellBox());
  }

  /// Expected branch of an inner node for a leaf node.
  [[nodiscard]] Branch summaryOf(NodeIndex leaf) const {
    const Brick& brick = voxels_.bricks().item(leaf);
    return {boundsOf(brick), brick.voxels.isAnyOccupied(), leaf};
  }
  [[nodiscard]] std::size_t numLeaves() const {
    std::size_t count = 0;
    visitLeaves(
        map_.cuboids().inner(), kEverywhere, CuboidFilter::kAll, [](NodeIndex, int) {},
        [&](NodeIndex) {
          ++count;
          return Visit::kContinue;
        });
    return count;
  }

  void checkVoxels(const VoxelBrick& brick) {
    const PackedVoxels& voxels = brick.voxels;
    expect(brick.brick == brickOf(brick.brick), "cell is no brick", brick.brick);
    expect(voxels_.findBrick(brick.brick) == &brick, "brick cannot be found", brick.brick);
    expect(!voxels.isEmpty() && !voxels.known().isEmpty(), "empty brick", brick.brick);
    expect(voxels.known().contains(voxels.occupied()), "unknown voxel is occupied", brick.brick);
    expect(voxels.isAnyOccupied() == !voxels.occupied().isEmpty(), "isAnyOccupied()", brick.brick);
    expect(voxels.isAllFree() == voxels.free().isFull(), "isAllFree()", brick.brick);
    BrickMask seen;
    std::set<float> values;
    voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      const bool is_occupied = classify(log_odds) == Occupancy::kOccupied;
      expect(std::isfinite(log_odds), "log-odds are not finite", brick.brick);
      expect(values.insert(log_odds).second, "log-odds come twice", brick.brick);
      expect(!of_value.isEmpty(), "log-odds of no voxel", brick.brick);
      expect(!of_value.intersects(seen), "voxel of two log-odds", brick.brick);
      expect((is_occupied ? voxels.occupied() : voxels.free()).contains(of_value),
             "class does not follow the log-odds", brick.brick);
      of_value.forEach([&](int voxel) {
        expect(voxels.logOddsAt(voxel) == log_odds, "logOddsAt() says something else", brick.brick);
      });
      seen |= of_value;
    });
    expect(seen == voxels.known(), "known voxels are not those with log-odds", brick.brick);
  }

  void checkGrown(const GrownBrick& brick, const GrownBricks& all) {
    expect(!brick.isEmpty(), "grown brick without content", brick.brick);
    BrickMask fused;
    for (const Cuboid& cuboid : brick.cuboids) {
      expect(cuboid.box.numVoxels() > 1.0, "single cell among fused cuboids", cuboid.box);
      const CellBox part = intersect(cuboid.box, brickBox(brick.brick));
      expect(!part.isEmpty(), "cuboid in a brick that it does not meet", cuboid.box);
      if (part.isEmpty()) continue;
      fused |= BrickMask::ofBox(part);
      forEachBrick(cuboid.box, [&](const Cell& other) {
        const GrownBrick* found = all.find(other);
        const bool is_listed = found != nullptr && std::count(found->cuboids.begin(),
                                                              found->cuboids.end(), cuboid) == 1;
        expect(is_listed, "cuboid is not once in each of its bricks", cuboid.box);
      });
    }
    expect(fused == brick.fused, "fused voxels are not those of the cuboids", brick.brick);
    BrickMask held;
    for (const HeldVoxel& voxel : brick.held) {
      expect(!held.test(voxel.voxel), "voxel waits twice", brick.brick);
      held.set(voxel.voxel);
    }
  }

  void cover(const Cuboid& cuboid) {
    expect(cuboid.occupancy != Occupancy::kUnknown, "cuboid of no class", cuboid.box);
    covers_.findOrAdd(brickOf(cuboid.box.min)).cuboids.push_back(cuboid);
    forEachBrick(cuboid.box, [&](const Cell& brick) {
      Cover& cover = covers_.findOrAdd(brick);
      const BrickMask part = BrickMask::ofBox(intersect(cuboid.box, brickBox(brick)));
      expect(!part.intersects(cover.free | cover.occupied), "voxel in two cuboids", cuboid.box);
      (cuboid.isOccupied() ? cover.occupied : cover.free) |= part;
      const PackedVoxels* voxels = voxels_.find(brick);
      if (map_.config().fusion != FusionKind::kGrowth || voxels == nullptr) return;
      expect(cuboid.box.numVoxels() == 1.0 || findStable(*voxels).contains(part),
             "fused voxel is not stable", cuboid.box);
    });
  }

  [[nodiscard]] BrickMask findStable(const PackedVoxels& voxels) const {
    const GrowthConfig& growth = map_.config().growth;
    BrickMask stable;
    voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      const auto& alpha = log_odds >= 0.0F ? growth.alpha_max : growth.alpha_min;
      const bool is_beyond = alpha && std::abs(log_odds) >= std::abs(toLogOdds(*alpha)) - 1e-6F;
      if (is_beyond || map_.sensorModel().isStable(log_odds)) stable |= of_value;
    });
    return stable;
  }

  void checkCover(const Cover& cover) {
    const VoxelBrick* brick = voxels_.findBrick(cover.brick);
    if (brick == nullptr) return expect(false, "cuboids of an unknown brick", cover.brick);
    expect(cover.free == brick->voxels.free(), "wrong free cuboids", cover.brick);
    expect(cover.occupied == brick->voxels.occupied(), "wrong occupied cuboids", cover.brick);
    if (map_.config().fusion == FusionKind::kGrowth) return;
    std::vector<Cuboid> expected;
    if (map_.config().fusion == FusionKind::kClass) {
      divideBrick(*brick, expected);
    } else {
      forEachCell(brick->brick, brick->voxels.known(), [&](const Cell& cell) {
        expected.push_back({CellBox::ofCell(cell), voxels_.at(cell)});
      });
    }
    std::vector<Cuboid> cuboids = cover.cuboids;
    std::sort(cuboids.begin(), cuboids.end(), isBefore);
    std::sort(expected.begin(), expected.end(), isBefore);
    expect(cuboids == expected, "brick is divided otherwise", cover.brick);
  }

  const CuboidMap& map_;
  const VoxelStore& voxels_;
  BrickTable<Cover> covers_;
  std::optional<CellBox> bounds_;
  std::vector<std::string> violations_;
};

}  // namespace

std::vector<std::string> checkMap(const CuboidMap& map) { return MapChecker(map).check(); }

}  // namespace cuboid_mapping
