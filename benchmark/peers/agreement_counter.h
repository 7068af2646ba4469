// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping::bench {

/// Compares the cells of a peer with a map, one after the other.
class AgreementCounter {
 public:
  /// @pre `map` stays as it is.
  explicit AgreementCounter(const CuboidMap& map) : map_(map) {}

  /// A cell that is known to the peer, and in no other that is added.
  void add(const CellBox& cell, float log_odds) {
    agreement_.voxels += cell.numVoxels();
    visitValues(map_, cell, Budget::unlimited(), [&](float own, int count) {
      known_to_both_ += count;
      if (classify(own) != classify(log_odds)) agreement_.class_mismatch += count;
      agreement_.max_log_odds_difference =
          std::max<double>(agreement_.max_log_odds_difference, std::abs(own - log_odds));
    });
  }

  /// Once all cells were added.
  [[nodiscard]] Agreement result() const {
    Agreement agreement = agreement_;
    const double known = map_.voxels().numFreeVoxels() + map_.voxels().numOccupiedVoxels();
    agreement.known_mismatch = (agreement.voxels - known_to_both_) + (known - known_to_both_);
    return agreement;
  }

 private:
  const CuboidMap& map_;
  Agreement agreement_;
  double known_to_both_ = 0.0;
};

}  // namespace cuboid_mapping::bench
