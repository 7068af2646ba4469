// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// What one change of a map has touched.
///
/// A copy of the map is brought up to date by dropping every cuboid that lies in a box, and
/// inserting the map's cuboids that lie in one: no cuboid that changed lies across a box.
struct ChangeSet {
  std::uint64_t revision = 0;  ///< Of the map after the change.
  bool is_everything = false;  ///< The whole map was replaced; `boxes` says nothing then.
  std::vector<CellBox> boxes;
};

}  // namespace cuboid_mapping
