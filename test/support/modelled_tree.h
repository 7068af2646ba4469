// SPDX-License-Identifier: BSD-3-Clause
// Random changes of an R-tree, also applied to a plain list of cuboids.
#pragma once

#include "evaluation/rtree.h"
#include "support/cuboid_set.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping::test {

/// Arrangement of the cuboids of a random tree.
enum class TreeWorld : unsigned char {
  kLattice,      ///< Disjoint, many with common faces, as in a map.
  kOverlapping,  ///< Anywhere, with repeated boxes.
  kHuge,         ///< At the borders of the grid, some as large as the grid.
  kWide,         ///< At the limits of the coordinates; leaves of more and of less than 255 voxels.
};

inline std::string toString(TreeWorld world) {
  constexpr const char* kNames[] = {"Lattice", "Overlapping", "Huge", "Wide"};
  return kNames[static_cast<std::size_t>(world)];
}

/// A random box of a world.
inline CellBox randomBoxIn(Random& random, TreeWorld world) {
  if (world == TreeWorld::kLattice) {
    constexpr int kPitch = 5;
    const Cell slot = randomCell(random, {{-5, -5, -5}, {5, 5, 5}});
    const CellBox box = randomBox(random, {{0, 0, 0}, {1, 1, 1}}, kPitch);
    const Cell min{kPitch * slot.x, kPitch * slot.y, kPitch * slot.z};
    return {min, min + box.max};
  }
  if (world == TreeWorld::kOverlapping) {
    if (random.chance(0.2)) return randomBox(random, {{-3, -3, -3}, {3, 3, 3}}, 2);  // Many twins.
    return randomBox(random, {{-50, -50, -50}, {50, 50, 50}}, random.chance(0.1) ? 80 : 12);
  }
  if (world == TreeWorld::kWide) {
    constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
    constexpr std::int32_t kGreatest = std::numeric_limits<std::int32_t>::max();
    const std::int32_t at = random.chance(0.5) ? kLeast + 100 : kGreatest - 1000;
    return randomBox(random, {{at, at, at}, {at + 400, at + 40, at + 40}},
                     random.chance(0.03) ? 500 : 20);
  }
  constexpr std::int32_t kFar = 1 << 30;
  constexpr std::int32_t kCorners[] = {-kFar, -kFar / 2, 0, kFar - 200};
  if (random.chance(0.05)) {
    return randomBoxInside(random, {{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}});
  }
  const Cell corner{kCorners[random.index(4)], kCorners[random.index(4)],
                    kCorners[random.index(4)]};
  return randomBox(random, {corner, corner + Cell{100, 100, 100}}, 100);
}

/// A tree, and its expected content.
class ModelledTree {
 public:
  ModelledTree(const RTreeConfig& config, TreeWorld world, std::size_t max_size)
      : tree_(config), world_(world), max_size_(max_size) {}

  [[nodiscard]] const bench::RTree& tree() const { return tree_; }
  [[nodiscard]] const std::vector<Cuboid>& cuboids() const { return cuboids_; }
  [[nodiscard]] TreeWorld world() const { return world_; }

  /// Changes the tree in one of all possible ways; keeps it near its maximum size.
  void change(Random& random) {
    const double choice = random.real(0.0, 1.0);
    const bool is_full = cuboids_.size() >= max_size_;
    if (choice < 0.35) {
      is_full ? removeSome(random) : insert(random);
    } else if (choice < 0.55) {
      removeSome(random);
    } else if (choice < 0.60) {
      removeUnknown(random);
      replaceOne(random);
    } else if (choice < 0.90) {
      replaceGroup(random, is_full);
    } else if (choice < 0.94) {
      addBatch(random, is_full ? 0 : static_cast<std::size_t>(random.integer(0, 12)));
    } else if (choice < 0.97) {
      removeBatch(random);
    } else if (choice < 0.99) {
      addBatch(random, is_full ? 0 : max_size_ / 3);
    } else if (choice < 0.995) {
      while (!cuboids_.empty()) removeOneOf(cuboids_.front().box);
    } else {
      tree_.clear();
      cuboids_.clear();
    }
  }

  /// One of the cuboids, or a new one if there are none.
  [[nodiscard]] CellBox knownBox(Random& random) const {
    return cuboids_.empty() ? randomBoxIn(random, world_) : cuboids_[random.index(size())].box;
  }

 private:
  [[nodiscard]] std::size_t size() const { return cuboids_.size(); }

  [[nodiscard]] bool isFree(const CellBox& box) const {
    return std::none_of(cuboids_.begin(), cuboids_.end(),
                        [&](const Cuboid& cuboid) { return cuboid.box.intersects(box); });
  }

  /// Adds a new cuboid to the model; in the lattice only if there is none.
  bool addToModel(Random& random, const CellBox& box, std::vector<Cuboid>& added) {
    if (world_ == TreeWorld::kLattice && !isFree(box)) return false;
    const Cuboid cuboid{box, random.chance(0.3) ? Occupancy::kOccupied : Occupancy::kFree};
    cuboids_.push_back(cuboid);
    added.push_back(cuboid);
    return true;
  }

  void removeFromModel(const Cuboid& cuboid) {
    const auto found = std::find(cuboids_.begin(), cuboids_.end(), cuboid);
    ASSERT_TRUE(found != cuboids_.end()) << "the tree has what was never put in: " << cuboid;
    *found = cuboids_.back();
    cuboids_.pop_back();
  }

  void insert(Random& random) {
    std::vector<Cuboid> added;
    if (addToModel(random, randomBoxIn(random, world_), added)) tree_.insert(added.front());
  }

  /// Cuboids of exactly this box, sorted.
  [[nodiscard]] std::vector<Cuboid> twinsInModel(const CellBox& box) const {
    std::vector<Cuboid> twins;
    std::copy_if(cuboids_.begin(), cuboids_.end(), std::back_inserter(twins),
                 [&](const Cuboid& cuboid) { return cuboid.box == box; });
    return sorted(std::move(twins));
  }

  void removeSome(Random& random) {
    if (!cuboids_.empty()) removeOneOf(knownBox(random));
  }

  void removeOneOf(const CellBox& box) {
    ASSERT_TRUE(tree_.remove(box));
    // Any one of equal cuboids may be removed: find which one.
    std::vector<Cuboid> left;
    visitBox(tree_, box, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      if (cuboid.box == box) left.push_back(cuboid);
      return Visit::kContinue;
    });
    left = sorted(std::move(left));
    const std::vector<Cuboid> twins = twinsInModel(box);
    std::vector<Cuboid> gone;
    std::set_difference(twins.begin(), twins.end(), left.begin(), left.end(),
                        std::back_inserter(gone), isBefore);
    ASSERT_EQ(gone.size(), 1U);
    ASSERT_EQ(left.size() + 1, twins.size());
    removeFromModel(gone.front());
  }

  void removeUnknown(Random& random) {
    CellBox box = random.chance(0.5) ? knownBox(random) : randomBoxIn(random, world_);
    box.max.x += random.integer(1, 3);
    ASSERT_TRUE(!twinsInModel(box).empty() || !tree_.remove(box));
  }

  /// Removes from the model cuboids in or near a box, each with some probability, and returns them.
  std::vector<Cuboid> takeOut(Random& random, const CellBox& box, int margin, double ratio) {
    std::vector<Cuboid> found;
    visitBox(tree_,
             {box.min - Cell{margin, margin, margin}, box.max + Cell{margin, margin, margin}},
             CuboidFilter::kAll, [&](const Cuboid& cuboid) {
               if (random.chance(ratio)) found.push_back(cuboid);
               return Visit::kContinue;
             });
    random.shuffle(found);
    return found;
  }

  /// Acts like a map: replaces cuboids of a small region by others.
  void replaceGroup(Random& random, bool is_full) {
    constexpr double kRatios[] = {0.0, 0.3, 0.8, 1.0};
    const std::vector<Cuboid> removed = takeOut(random, knownBox(random), random.integer(0, 8),
                                                is_full ? 1.0 : kRatios[random.index(4)]);
    const std::size_t num_wanted = is_full ? removed.size() / 2 : random.index(12);
    for (const Cuboid& cuboid : removed) removeTold(cuboid);
    std::vector<Cuboid> added;
    for (std::size_t i = 0; i < num_wanted; ++i) {
      addToModel(random, randomBoxIn(random, world_), added);
    }
    for (const Cuboid& cuboid : added) tree_.insert(cuboid);
    if (random.chance(0.5)) tree_.trim();
  }

  void addBatch(Random& random, std::size_t count) {
    std::vector<Cuboid> added;
    for (std::size_t i = 0; i < count; ++i) {
      addToModel(random, randomBoxIn(random, world_), added);
    }
    for (const Cuboid& cuboid : added) tree_.insert(cuboid);
  }

  void removeBatch(Random& random) {
    const double ratio = random.chance(0.5) ? 1.0 : 0.5;
    for (const Cuboid& cuboid : takeOut(random, knownBox(random), random.integer(0, 40), ratio)) {
      removeTold(cuboid);
    }
  }

  /// Removes one cuboid of a box, whichever it is.
  void removeTold(const Cuboid& cuboid) { removeOneOf(cuboid.box); }

  /// Gives a box another class, or another size, in its place.
  void replaceOne(Random& random) {
    if (cuboids_.empty()) return;
    const CellBox box = knownBox(random);
    if (twinsInModel(box).size() != 1) return;
    const Cuboid old = twinsInModel(box).front();
    const Occupancy other = old.isOccupied() ? Occupancy::kFree : Occupancy::kOccupied;
    const Cuboid now{random.chance(0.5) ? box : randomBoxInside(random, box), other};
    ASSERT_TRUE(tree_.replace(box, now));
    removeFromModel(old);
    cuboids_.push_back(now);
  }

  bench::RTree tree_;
  TreeWorld world_;
  std::size_t max_size_;
  std::vector<Cuboid> cuboids_;
};

}  // namespace cuboid_mapping::test
