// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_edit.h"

#include "cuboid_mapping/query/box_query.h"
#include "support/map_invariants.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

const MetricBox kRoom{{0.0, 0.0, 0.0}, {4.0, 3.0, 2.0}};
const MetricBox kWall{{1.0, 0.0, 0.0}, {1.1, 3.0, 2.0}};

TEST(MapEdit, fillsAndForgets) {
  CuboidMap map;
  fill(map, kRoom, Occupancy::kFree);
  EXPECT_TRUE(isFree(map, kRoom, UnknownPolicy::kObstacle, Budget::unlimited()));
  fill(map, kWall, Occupancy::kOccupied);
  EXPECT_FALSE(isFree(map, kRoom, UnknownPolicy::kFree, Budget::unlimited()));
  EXPECT_NEAR(queryBox(map, kRoom, Budget::unlimited())->occupied_volume_m3, 0.6, 1e-9);
  EXPECT_EQ(map.voxels().logOddsAt(*map.grid().toCell({1.05, 1.0, 1.0})), map.sensorModel().max());
  const ChangeSet changes = forget(map, kWall);
  EXPECT_FALSE(changes.bricks.empty());
  EXPECT_FALSE(isFree(map, kRoom, UnknownPolicy::kObstacle, Budget::unlimited()));
  EXPECT_TRUE(isFree(map, kRoom, UnknownPolicy::kFree, Budget::unlimited()));
  fill(map, kRoom, Occupancy::kUnknown);
  EXPECT_EQ(map.voxels().size(), 0U);
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
}

TEST(MapEdit, refusesWhatIsNoBox) {
  CuboidMap map;
  fill(map, kRoom, Occupancy::kFree);
  const auto revision = map.revision();
  for (const double bad :
       {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity(), 1e12}) {
    const MetricBox box{{0.0, 0.0, 0.0}, {1.0, 1.0, bad}};
    EXPECT_THROW(fill(map, box, Occupancy::kOccupied), std::invalid_argument) << bad;
    EXPECT_THROW(forget(map, box), std::invalid_argument) << bad;
    EXPECT_FALSE(isFree(map, box, UnknownPolicy::kFree, Budget::unlimited()))
        << bad << ": what cannot be said is not free";
  }
  EXPECT_EQ(map.revision(), revision);
}

}  // namespace
}  // namespace cuboid_mapping
