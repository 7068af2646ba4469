// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/growing_bricks.h"
#include "cuboid_mapping/fusion/growth_rules.h"

#include <vector>

namespace cuboid_mapping {

/// Adaptation of the cell resolution (paper, Section IV-B and Figure 5): a stable cell expands in one search direction
/// after the other. An expansion succeeds if cells inside the added slab fill it (6), and are stable in the same
/// class (7), (8). The fused cuboid replaces these cells.
class Grower {
 public:
  /// @param bricks  Get the fused cuboids. Both must outlive the object.
  Grower(const GrowthRules& rules, GrowingBricks& bricks) : rules_(rules), bricks_(bricks) {}

  /// Grows cells until none of them can: one pass tries each cell once; the next pass tries those beside a fused cuboid
  /// again. @param cells  The paper's set T, in the order of trial. @throws std::bad_alloc
  void grow(std::vector<Cell> cells);

 private:
  void tryCell(const Cell& cell);
  [[nodiscard]] std::vector<Cell> startersBesideFused();

  const GrowthRules& rules_;
  GrowingBricks& bricks_;
  std::vector<CellBox>
      fused_;                ///< Cuboids that have fused in this pass, also those absorbed since.
  std::vector<Cell> tried_;  ///< Cells in the masks `tried` of the bricks.
};

}  // namespace cuboid_mapping
