// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/value_query.h"

#include "support/modelled_map.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <map>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

TEST(ValueQuery, isNothingWhereNothingIsKnown) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {2, 1, 1}}, -1.0F}});
  for (const CellBox& box : {CellBox{{2, 0, 0}, {9, 9, 9}}, CellBox{{0, 0, 0}, {0, 1, 1}}}) {
    EXPECT_TRUE(meanProbability(map, box, Budget::unlimited()).isNotFound());
    EXPECT_TRUE(maxLogOdds(map, box, Budget::unlimited()).isNotFound());
  }
}

TEST(ValueQuery, saysOfACuboidWhatItsVoxelsSay) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {3, 1, 1}}, toLogOdds(0.2)},
                          UniformBox{{{3, 0, 0}, {4, 1, 1}}, toLogOdds(0.4)}});
  ASSERT_EQ(countCuboids(map).total(), 1U) << "free all";
  EXPECT_NEAR(meanProbability(map, {{0, 0, 0}, {4, 1, 1}}, Budget::unlimited()).value, 0.25, 1e-6);
  EXPECT_EQ(maxLogOdds(map, {{0, 0, 0}, {4, 1, 1}}, Budget::unlimited()).valueOr(99.0F),
            toLogOdds(0.4));
  EXPECT_EQ(maxLogOdds(map, {{0, 0, 0}, {3, 1, 1}}, Budget::unlimited()).valueOr(99.0F),
            toLogOdds(0.2));
}

TEST(ValueQuery, agreesWithALookAtEveryVoxel) {
  Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_unknown = 0;
  for (const Cell& offset : {Cell{0, 0, 0}, Cell{10000000, -10000000, 800}, Cell{-8, 0, 8}}) {
    const ModelledMap model = test::randomMap(random, MapConfig{}, offset);
    const CellBox area{offset - Cell{18, 18, 18}, offset + Cell{17, 17, 17}};
    for (int i = 0; i < 2000; ++i, ++num_cases) {
      const CellBox box = i == 0 ? kAllCells : test::randomBox(random, area, i % 2 == 0 ? 3 : 12);
      std::map<float, int> expected;
      double sum = 0.0;
      int num_known = 0;
      test::visitCells(intersect(box, area), [&](const Cell& cell) {
        const auto log_odds = model.voxels.find(cell);
        if (!log_odds) return;
        ++expected[*log_odds];
        sum += toProbability(*log_odds);
        ++num_known;
      });
      std::map<float, int> values;
      visitValues(model.map, box, Budget::unlimited(),
                  [&](float log_odds, int count) { values[log_odds] += count; });
      ASSERT_EQ(values, expected) << box << test::seedNote(num_cases);
      const auto mean = meanProbability(model.map, box, Budget::unlimited());
      const auto greatest = maxLogOdds(model.map, box, Budget::unlimited());
      ASSERT_EQ(mean.isFound(), num_known > 0);
      ASSERT_EQ(greatest.isFound(), num_known > 0);
      num_unknown += num_known == 0 ? 1 : 0;
      if (num_known == 0) continue;
      ASSERT_NEAR(*mean, sum / num_known, 1e-9) << box << test::seedNote(num_cases);
      ASSERT_EQ(*greatest, expected.rbegin()->first) << box << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 6000U);
  EXPECT_GT(num_unknown, 100U);
  EXPECT_LT(num_unknown, num_cases / 2);
}

}  // namespace
}  // namespace cuboid_mapping
