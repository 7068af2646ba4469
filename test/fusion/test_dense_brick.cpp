// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/dense_brick.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

TEST(DenseBrick, isUnknownAtFirst) {
  const DenseBrick brick;
  EXPECT_EQ(brick.known, BrickMask{});
  for (const float log_odds : brick.log_odds) EXPECT_EQ(log_odds, 0.0F);
}

TEST(DenseBrick, takesThePartsOfCuboidsThatAreInIt) {
  test::Random random(1);
  constexpr std::size_t kCases = 3000;
  std::size_t num_outside = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    DenseBrick brick;
    brick.brick = {-8, 0, 16};
    const CellBox area{{-20, -12, 4}, {12, 20, 36}};
    // The later cuboid overwrites the first.
    const Cuboid cuboids[] = {{test::randomBox(random, area, 20), 1.0F},
                              {test::randomBox(random, area, 20), -1.0F}};
    for (const Cuboid& cuboid : cuboids) brick.fill(cuboid);
    if (intersect(cuboids[0].box, brickBox(brick.brick)).isEmpty()) ++num_outside;
    test::visitCells(brickBox(brick.brick), [&](const Cell& cell) {
      const bool is_in[] = {cuboids[0].box.contains(cell), cuboids[1].box.contains(cell)};
      ASSERT_EQ(test::isInMask(brick.known, cell), is_in[0] || is_in[1]) << test::seedNote(i);
      if (!is_in[0] && !is_in[1]) return;
      ASSERT_EQ(brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))], is_in[1] ? -1.0F : 1.0F)
          << test::seedNote(i);
    });
  }
  EXPECT_GT(num_outside, kCases / 20);
}

TEST(DenseBrick, updatesEveryObservedVoxelOnce) {
  test::Random random(2);
  constexpr std::size_t kCases = 2000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const SensorModel model({}, i % 2 == 0 ? Environment::kDynamic : Environment::kStatic);
    DenseBrick brick = test::randomDenseBrick(random);
    brick.fill({CellBox::ofCell(brick.brick), model.max()});  // A stable one is among them.
    test::visitCells(brickBox(brick.brick), [&](const Cell& cell) {
      if (!test::isInMask(brick.known, cell)) {
        brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))] = 0.0F;
      }
    });
    const DenseBrick before = brick;
    const BrickUpdate update = test::randomUpdate(random, {{0, 0, 0}, {1, 1, 1}}, 1).bricks.front();
    const bool is_changed = brick.apply(update, model);
    EXPECT_EQ(is_changed, brick.known != before.known || brick.log_odds != before.log_odds);
    test::visitCells(brickBox({0, 0, 0}), [&](const Cell& cell) {
      const auto voxel = static_cast<std::size_t>(voxelIndex(cell));
      const bool is_hit = test::isInMask(update.hits, cell);
      const bool was_known = test::isInMask(before.known, cell);
      if (!is_hit && !test::isInMask(update.misses, cell)) {
        ASSERT_EQ(test::isInMask(brick.known, cell), was_known) << test::seedNote(i);
        ASSERT_EQ(brick.log_odds[voxel], before.log_odds[voxel]) << test::seedNote(i);
        return;
      }
      ASSERT_TRUE(test::isInMask(brick.known, cell)) << test::seedNote(i);
      ASSERT_EQ(brick.log_odds[voxel], model.update(was_known ? before.log_odds[voxel] : 0.0F,
                                                    is_hit ? model.hit() : model.miss()))
          << cell << test::seedNote(i);
    });
  }
}

}  // namespace
}  // namespace cuboid_mapping
