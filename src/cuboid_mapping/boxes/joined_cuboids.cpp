// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/joined_cuboids.h"

#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>
#include <array>

namespace cuboid_mapping {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = BrickTable<Brick>::kNoItem;

/// A brick and the cuboids whose least cell lies in it.
struct Tiles {
  Cell brick;
  Index first = 0;
  Index end = 0;
  std::array<Index, 3> next{};  ///< Neighbours along the axes.
};

/// Joins cuboids in place: the one with the lower cells grows, the other is removed.
///
/// The division of a brick takes the largest box at a least corner, so that cuboids of one brick never
/// share a whole face. A joined cuboid has one part in each of its bricks, a cuboid of the map. If two
/// share a whole face their parts at that face do, too: therefore one pass along each axis joins all.
class Joiner {
 public:
  Joiner(const CuboidMap& map, const CellBox& region, CuboidFilter classes, Budget& budget)
      : budget_(budget) {
    std::vector<BrickRef> bricks;
    const Visit end = map.voxels().bricks().visitIn(region, [&](const Brick& brick) {
      if (!budget.spend()) return Visit::kStop;
      bricks.push_back({brick.brick, &brick});
      return Visit::kContinue;
    });
    if (end == Visit::kStop) return;
    sortBricks(bricks);
    const bool are_kept = map.config().fusion == FusionKind::kClass;
    tiles_.reserve(bricks.size());
    for (const BrickRef& at : bricks) {
      if (!budget.spend()) break;
      add(*at.content, region, classes, are_kept);
    }
    for (Tiles& tiles : tiles_) {
      for (int axis = 0; axis < 3; ++axis) {
        Cell next = tiles.brick;
        next[axis] += kBrickEdge;
        tiles.next[static_cast<std::size_t>(axis)] = find(next);
      }
    }
  }

  void joinAlong(int axis) {
    constexpr Index kTilesPerLook = 256;
    for (Index at = 0; at < tiles_.size(); ++at) {
      // What max_bricks has let in is joined.
      const bool is_look = at % kTilesPerLook == 0;
      if (is_look && !budget_.checkClock() && budget_.whyEnded() != BudgetLimit::kBricks) return;
      for (Index i = tiles_[at].first; i < tiles_[at].end; ++i) {
        if (!cuboids_[i].box.isEmpty()) grow(axis, at, cuboids_[i]);
      }
    }
  }

  /// The remaining boxes, along the Morton curve of the bricks of their least cells.
  [[nodiscard]] std::vector<Cuboid> take() {
    const auto is_gone = [](const Cuboid& cuboid) { return cuboid.box.isEmpty(); };
    cuboids_.erase(std::remove_if(cuboids_.begin(), cuboids_.end(), is_gone), cuboids_.end());
    return std::move(cuboids_);
  }

 private:
  /// A brick of the map; copies of its cell are sorted faster than what pointers point to.
  struct BrickRef {
    Cell brick;
    const Brick* content;
  };

  void add(const Brick& brick, const CellBox& region, CuboidFilter classes, bool are_kept) {
    const auto first = static_cast<Index>(cuboids_.size());
    const auto add_box = [&](PackedBox box, Occupancy occupancy) {
      cuboids_.push_back(unpackCuboid(brick.brick, box, occupancy));
      return Visit::kContinue;
    };
    const CellBox part = intersect(region, brickBox(brick.brick));
    const bool is_kept = are_kept && part == brickBox(brick.brick);
    if (is_kept && !brick.cuboids.isStale()) {
      brick.cuboids.visit(classes, add_box);
    } else {
      const BrickMask mask = BrickMask::ofBox(part);
      const DividedBrick divided =
          divide(brick.voxels.occupied() & mask, brick.voxels.free() & mask);
      if (is_kept) brick.cuboids.keep(divided);
      BrickCuboids::visit(divided, classes, add_box);
    }
    const auto end = static_cast<Index>(cuboids_.size());
    if (end == first) return;
    table_.findOrAdd(brick.brick).tiles = static_cast<Index>(tiles_.size());
    tiles_.push_back({brick.brick, first, end, {}});
  }

  [[nodiscard]] Index find(const Cell& brick) const {
    const Entry* entry = table_.find(brick);
    return entry == nullptr ? kNone : entry->tiles;
  }

  /// @param at  The tiles that contain the cuboid.
  void grow(int axis, Index at, Cuboid& cuboid) {
    while ((cuboid.box.max[axis] & (kBrickEdge - 1)) == 0) {
      at = tiles_[at].next[static_cast<std::size_t>(axis)];
      if (at == kNone) return;
      Cuboid* other = findJoinable(axis, cuboid, tiles_[at]);
      if (other == nullptr) return;
      cuboid.box.max[axis] = other->box.max[axis];
      other->box.max = other->box.min;
    }
  }

  /// The cuboid of some tiles that shares the upper face of another one; null when there is none.
  [[nodiscard]] Cuboid* findJoinable(int axis, const Cuboid& cuboid, const Tiles& tiles) {
    CellBox wanted = cuboid.box;
    wanted.min[axis] = cuboid.box.max[axis];
    for (Index i = tiles.first; i < tiles.end; ++i) {
      Cuboid& other = cuboids_[i];
      if (other.box.min != wanted.min || other.box.isEmpty()) continue;
      wanted.max[axis] = other.box.max[axis];
      return other.box == wanted && other.occupancy == cuboid.occupancy ? &other : nullptr;
    }
    return nullptr;
  }

  struct Entry {
    Cell brick;
    Index tiles = 0;
  };
  Budget& budget_;
  std::vector<Cuboid> cuboids_;  ///< Cuboids by tiles; removed ones are empty.
  std::vector<Tiles> tiles_;     ///< Tiles along the Morton curve.
  BrickTable<Entry> table_;
};

}  // namespace

Answer<std::vector<Cuboid>> joinCuboids(const CuboidMap& map, const CellBox& region,
                                        CuboidFilter classes, Budget& budget) {
  if (region.isEmpty()) return AnswerStatus::kNotFound;
  Joiner joiner(map, region, classes, budget);
  for (int axis = 0; axis < 3; ++axis) joiner.joinAlong(axis);
  return answerWithAll(joiner.take(), !budget.isSpent());
}

}  // namespace cuboid_mapping
