// SPDX-License-Identifier: BSD-3-Clause
// Random streams of operations: a tree always is an R-tree of its order, with the
// inserted cuboids.
#include "support/modelled_tree.h"
#include "support/tree_invariants.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ModelledTree;
using test::Random;
using test::TreeWorld;

constexpr RTreeConfig kOrders[] = {{2, 1},   {4, 2},  {8, 3},   {16, 6},
                                   {32, 12}, {64, 8}, {64, 32}, {5, 1}};  // {M, d}
constexpr TreeWorld kWorlds[] = {TreeWorld::kLattice, TreeWorld::kOverlapping, TreeWorld::kHuge,
                                 TreeWorld::kWide};
constexpr std::size_t kOperations = 9000;
static_assert(std::size(kOrders) * std::size(kWorlds) * kOperations >= 200000);

/// A window: small, large, around a cuboid, or empty.
CellBox randomWindow(Random& random, const ModelledTree& model) {
  CellBox window = random.chance(0.5) ? model.knownBox(random) : randomBoxIn(random, model.world());
  if (random.chance(0.1)) return {window.max, window.min};
  if (random.chance(0.2)) window = unite(window, randomBoxIn(random, model.world()));
  const int margin = random.integer(0, 3);
  return {window.min - Cell{margin, margin, margin}, window.max + Cell{margin, margin, margin}};
}

/// A point in or near the cuboids, in units of cells; one in four is the corner of voxels.
Eigen::Vector3d randomPointNear(Random& random, const ModelledTree& model) {
  const CellBox box = model.knownBox(random);
  const Cell cell = test::randomCell(random, {box.min - Cell{5, 5, 5}, box.max + Cell{5, 5, 5}});
  const Eigen::Vector3d corner(cell.x, cell.y, cell.z);
  if (random.chance(0.25)) return corner;
  return corner + test::randomPoint(random, 1.0);
}

void checkRandomNearest(Random& random, const ModelledTree& model,
                        const std::vector<Cuboid>& expected, CuboidFilter filter) {
  const Eigen::Vector3d point = randomPointNear(random, model);
  // No sum of three squares of integers, or of arbitrary reals, is this far from the point.
  const double max_distance = random.chance(0.3) ? std::numeric_limits<double>::infinity()
                                                 : random.integer(0, 40) + 0.123456;
  test::checkNearestSearch(model.tree(), expected, point, max_distance, filter);
}

void checkQueries(Random& random, const ModelledTree& model) {
  const bench::RTree& tree = model.tree();
  const std::vector<Cuboid> expected = test::sorted(model.cuboids());  // Once for all.
  test::checkContent(tree, expected);
  test::checkBoxSearch(tree, expected, randomWindow(random, model));
  const CellBox box = model.knownBox(random);
  const Cell cells[] = {box.min, box.max, test::randomCell(random, box)};
  test::checkCellSearch(tree, expected, cells[random.index(3)]);
  const CuboidFilter filter = test::kFilters[random.index(3)];
  checkRandomNearest(random, model, expected, filter);
  test::checkStop(tree, 1 + random.index(5));
}

/// Changes a tree at random and checks it after each given number of changes.
void runStream(Random& random, ModelledTree& model, std::size_t num_operations,
               std::size_t check_period) {
  std::size_t num_checks = 0;
  std::size_t greatest_size = 0;
  int greatest_height = 0;
  for (std::size_t operation = 0; operation < num_operations; ++operation) {
    model.change(random);
    if (operation % check_period == 0) {
      EXPECT_EQ(checkTree(model.tree()), std::vector<std::string>{});
      checkQueries(random, model);
      ++num_checks;
    }
    ASSERT_FALSE(testing::Test::HasFailure()) << test::seedNote(operation);
    greatest_size = std::max(greatest_size, model.tree().size());
    greatest_height = std::max(greatest_height, model.tree().height());
  }
  EXPECT_EQ(num_checks, (num_operations + check_period - 1) / check_period);
  EXPECT_GT(greatest_size, 2U * static_cast<unsigned>(model.tree().inner().config().max_branches));
  EXPECT_GE(greatest_height, 2);
}

class RTreeModel : public testing::TestWithParam<std::tuple<RTreeConfig, TreeWorld>> {};

TEST_P(RTreeModel, isAnRTreeWithTheRightContentAfterEveryOperation) {
  const auto& [order, world] = GetParam();
  Random random(static_cast<std::uint64_t>(order.max_branches * 100 + order.min_branches));
  ModelledTree model(order, world, static_cast<std::size_t>(100 + 4 * order.max_branches));
  runStream(random, model, kOperations, 1);
}

std::string nameOf(const testing::TestParamInfo<RTreeModel::ParamType>& info) {
  const auto& [order, world] = info.param;
  return toString(world) + std::to_string(order.min_branches) + "of" +
         std::to_string(order.max_branches);
}

INSTANTIATE_TEST_SUITE_P(AllOrders, RTreeModel,
                         testing::Combine(testing::ValuesIn(kOrders), testing::ValuesIn(kWorlds)),
                         nameOf);

TEST(RTreeModelLarge, staysRightWithThousandsOfCuboids) {
  for (const RTreeConfig& order : {RTreeConfig{4, 2}, RTreeConfig{32, 12}, RTreeConfig{64, 32}}) {
    Random random(static_cast<std::uint64_t>(order.max_branches));
    ModelledTree model(order, TreeWorld::kOverlapping, 4000);
    runStream(random, model, 3000, 50);
  }
}

}  // namespace
}  // namespace cuboid_mapping
