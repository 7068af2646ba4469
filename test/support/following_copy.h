// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "support/cuboid_set.h"

#include <algorithm>
#include <vector>

namespace cuboid_mapping::test {

/// A copy of a map that knows nothing but the rule of change_set.h.
class FollowingCopy {
 public:
  void follow(const CuboidMap& map, const ChangeSet& changes) {
    if (!changes.is_everything && changes.boxes.empty()) return;
    if (changes.is_everything) {
      cuboids_ = allCuboids(map.tree());
      return;
    }
    const auto lies_in_a_box = [&changes](const Cuboid& cuboid) {
      return std::any_of(changes.boxes.begin(), changes.boxes.end(),
                         [&](const CellBox& box) { return box.contains(cuboid.box); });
    };
    cuboids_.erase(std::remove_if(cuboids_.begin(), cuboids_.end(), lies_in_a_box), cuboids_.end());
    for (const Cuboid& cuboid : allCuboids(map.tree())) {
      if (lies_in_a_box(cuboid)) cuboids_.push_back(cuboid);
    }
    cuboids_ = sorted(std::move(cuboids_));
  }

  [[nodiscard]] const std::vector<Cuboid>& cuboids() const { return cuboids_; }

 private:
  std::vector<Cuboid> cuboids_;
};

}  // namespace cuboid_mapping::test
