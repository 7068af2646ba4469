// SPDX-License-Identifier: BSD-3-Clause
// The paper's occupancy grid as its text has it: to be compared with, not to be used.
#pragma once

#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "evaluation/growth_variant.h"
#include "evaluation/rtree.h"

#include <cstddef>
#include <optional>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping::bench {

/// How the text is read where it can be read in several ways.
struct PaperReading {
  /// Condition (6). True: the cells in the expanded cuboid fill it. False: they need not, and unknown
  /// voxels between them become part of the fused cell. Cells that only stick into it stop both.
  bool is_gap_free = true;
  /// "Biased based on the larger side". True: along the longest side first. False: through the largest
  /// face first, which is across the longest side.
  bool grows_along = true;
  /// Equation (5). As written, W_i sigma with a unit vector sigma: the width of the cell. Or one voxel,
  /// when sigma is "scaled based on width". kNeighbour is not in the paper.
  GrowthStep step = GrowthStep::kOwnWidth;
};

/// R-tree of order (d, M) whose leaf branches are the grid's cells, each with a probability (paper,
/// Sections III and IV), in the paper's static environment.
///
/// Every cell is found by a search from the root, and inserted by least expansion. After a cloud each
/// cell of T is expanded once (Figure 5). Fused cells stay as they are for ever.
class PaperGrid {
 public:
  /// @pre `model` is that of a static environment.
  PaperGrid(const SensorModel& model, const RTreeConfig& rtree, const PaperReading& reading)
      : model_(model), reading_(reading), tree_(rtree) {}

  /// Section IV-A: initializes and updates the cells that a cloud observes.
  void update(const ScanUpdate& update);
  /// Section IV-B: lets the cells of the set T expand, in this order.
  void fuse(const std::vector<Cell>& starters);

  /// All cells, disjoint.
  [[nodiscard]] const RTree& tree() const { return tree_; }
  /// Voxels in all cells.
  [[nodiscard]] double numVoxels() const;

 private:
  void observe(const Cell& voxel, float observation);
  [[nodiscard]] std::optional<Cuboid> find(const Cell& voxel) const;
  [[nodiscard]] bool isStable(const Cuboid& cell) const;
  [[nodiscard]] bool expand(Cuboid& cell);
  [[nodiscard]] bool absorb(const CellBox& slab, Cuboid& cell);

  SensorModel model_;
  PaperReading reading_;
  RTree tree_;
  std::unordered_map<Cell, float, CellHash> log_odds_;  ///< Of each cell, by its least voxel.
};

/// The set T of a cloud: the cells in which beams end, then those drawn along the beams.
[[nodiscard]] std::vector<Cell> startersOf(const ScanUpdate& update);

}  // namespace cuboid_mapping::bench
