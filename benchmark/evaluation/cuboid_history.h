// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"

#include <unordered_map>
#include <unordered_set>

namespace cuboid_mapping::bench {

/// What becomes of cuboids, told from the map after each cloud, whatever the fusion.
class CuboidHistory {
 public:
  /// Takes note of all cuboids. @complexity O(n log n) for n cuboids.
  void note(const CuboidMap& map);

  /// Cuboids of several voxels that are gone, and in no larger one.
  [[nodiscard]] std::size_t numSplits() const { return num_splits_; }
  /// Voxels that a split has left alone, and that are in a cuboid of several again; counted each time.
  [[nodiscard]] std::size_t numFusedAgain() const { return num_fused_again_; }

 private:
  using Cuboids = std::unordered_map<Cell, CellBox, CellHash>;

  void noteSplit(const CuboidMap& map, const CellBox& gone);

  Cuboids cuboids_;                           ///< Those of several voxels, by their least one.
  std::unordered_set<Cell, CellHash> alone_;  ///< Left alone by a split.
  std::size_t num_splits_ = 0;
  std::size_t num_fused_again_ = 0;
};

}  // namespace cuboid_mapping::bench
