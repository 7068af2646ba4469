// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// A changed brick.
struct ChangedBrick {
  Cell brick;                    ///< Its least cell.
  bool has_new_cuboids = false;  ///< Else only log-odds have changed.
};

/// The bricks that one change of a map has touched.
///
/// To update a copy of the cuboids, drop every cuboid that shares a cell with a brick that has new
/// cuboids, and insert the map's cuboids of these bricks.
struct ChangeSet {
  std::uint64_t revision = 0;        ///< Revision of the map after the change.
  bool is_everything = false;        ///< The whole map was replaced; `bricks` does not count then.
  std::vector<ChangedBrick> bricks;  ///< Some may come twice.

  /// Adds a later change. If memory fails, everything counts as changed.
  void append(const ChangeSet& later) noexcept {
    revision = later.revision;
    is_everything = is_everything || later.is_everything;
    try {
      bricks.insert(bricks.end(), later.bricks.begin(), later.bricks.end());
    } catch (...) {
      is_everything = true;
    }
  }
};

}  // namespace cuboid_mapping
