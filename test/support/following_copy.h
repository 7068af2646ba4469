// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "support/map_cuboids.h"

#include <algorithm>
#include <set>
#include <vector>

namespace cuboid_mapping::test {

/// A copy of the cuboids of a map that uses only the rule of change_set.h.
class FollowingCopy {
 public:
  void follow(const CuboidMap& map, const ChangeSet& changes) {
    if (changes.is_everything) {
      cuboids_ = allCuboids(map);
      return;
    }
    std::set<Cell> bricks;
    for (const ChangedBrick& changed : changes.bricks) {
      if (changed.has_new_cuboids) bricks.insert(changed.brick);
    }
    if (bricks.empty()) return;
    const auto lies_in_a_brick = [&bricks](const Cuboid& cuboid) {
      return anyBrick(cuboid.box, [&](const Cell& brick) { return bricks.count(brick) != 0; });
    };
    cuboids_.erase(std::remove_if(cuboids_.begin(), cuboids_.end(), lies_in_a_brick),
                   cuboids_.end());
    visitAll(map, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      if (lies_in_a_brick(cuboid)) cuboids_.push_back(cuboid);
      return Visit::kContinue;
    });
  }

  [[nodiscard]] std::size_t size() const { return cuboids_.size(); }
  /// Sorted.
  [[nodiscard]] std::vector<Cuboid> cuboids() const { return sorted(cuboids_); }

 private:
  std::vector<Cuboid> cuboids_;  ///< In any order.
};

}  // namespace cuboid_mapping::test
