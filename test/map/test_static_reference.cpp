// SPDX-License-Identifier: BSD-3-Clause
// A static map compared with a model of the paper's text: a dense grid of probabilities.
#include "cuboid_mapping/map/cuboid_search.h"

#include "support/cuboid_set.h"
#include "support/random.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace cuboid_mapping {
namespace {

/// Section IV-A: cells are initialized with 0.5 when they are observed, and updated by the inverse
/// sensor model of Section V; beyond alpha_min or alpha_max "a grid cell is no longer updated".
class PaperGrid {
 public:
  void observe(const Cell& cell, bool is_hit) {
    double& p = cells_.emplace(cell, 0.5).first->second;
    if (p <= kAlphaMin || p >= kAlphaMax) return;
    const double p_z = is_hit ? 0.7 : 0.4;
    // The product form of the update, with a prior of 0.5.
    p = 1.0 / (1.0 + (1.0 - p_z) / p_z * (1.0 - p) / p);
  }
  [[nodiscard]] const std::map<Cell, double>& cells() const { return cells_; }

  static constexpr double kAlphaMin = 0.12;
  static constexpr double kAlphaMax = 0.97;

 private:
  std::map<Cell, double> cells_;
};

class StaticReference : public testing::TestWithParam<FusionKind> {};

TEST_P(StaticReference, agreesInEveryVoxel) {
  test::Random random(91);
  MapConfig config;
  config.resolution_m = 0.2;
  config.environment = Environment::kStatic;
  config.fusion = GetParam();
  CuboidMap map(config);
  ScanUpdater updater(map.grid(), 3.0, 1, {2.0, 1});
  PaperGrid grid;
  test::ScanShape shape;
  shape.half_edge_m = 3.0;
  shape.resolution_m = config.resolution_m;
  Scan scan = test::randomScan(random, shape);
  for (int cloud = 0; cloud < 60; ++cloud) {
    if (cloud % 4 == 0) scan = test::randomScan(random, shape);  // Otherwise the same scan again.
    const ScanUpdate& update = updater.compute(scan);
    for (const auto& [cell, is_hit] : test::toObservedCells(update)) grid.observe(cell, is_hit);
    map.apply(update);
  }
  std::size_t num_voxels = 0;
  std::size_t num_stable = 0;
  for (const Cuboid& cuboid : test::allCuboids(map)) {
    test::visitCells(cuboid.box, [&](const Cell& cell) {
      ++num_voxels;
      const auto found = grid.cells().find(cell);
      ASSERT_NE(found, grid.cells().end()) << cell;
      // The map clamps to the thresholds; the paper's grid passes them once.
      const double p = std::clamp(found->second, PaperGrid::kAlphaMin, PaperGrid::kAlphaMax);
      const float log_odds = map.voxels().logOddsAt(cell).value();
      ASSERT_NEAR(toProbability(log_odds), p, 1e-4) << cell;
      ASSERT_EQ(classify(log_odds), cuboid.occupancy) << cell;
      num_stable += map.sensorModel().isStable(log_odds) ? 1 : 0;
    });
  }
  EXPECT_EQ(num_voxels, grid.cells().size());
  EXPECT_GT(num_stable, num_voxels / 10);
  EXPECT_LT(num_stable, num_voxels);
}

INSTANTIATE_TEST_SUITE_P(Fusions, StaticReference,
                         testing::Values(FusionKind::kGrowth, FusionKind::kClass,
                                         FusionKind::kNone));

}  // namespace
}  // namespace cuboid_mapping
