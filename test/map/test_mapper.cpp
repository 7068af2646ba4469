// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/mapper.h"

#include "support/random_shapes.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

MapperConfig configOf(int threads) {
  MapperConfig config;
  config.map.threads = threads;
  return config;
}

/// The map of map() may be read between two calls, with any number of threads.
TEST(Mapper, changesTheMapThatItHasGivenOnlyInItsCalls) {
  test::Random random(5);
  Mapper mapper(configOf(2));
  const CuboidMap& map = mapper.map();
  for (int i = 0; i < 50; ++i) {
    mapper.integrate(test::randomScan(random, {}));
    const double num_known = map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels();
    const auto revision = map.revision();
    mapper.settle();
    ASSERT_EQ(map.revision(), revision) << "scan " << i;
    ASSERT_EQ(map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels(), num_known);
  }
}

TEST(Mapper, makesTheSameMapWithAndWithoutALookAtIt) {
  test::Random random(6);
  Mapper looked_at(configOf(2));
  Mapper plain(configOf(1));
  Mapper settled(configOf(2));
  for (int i = 0; i < 20; ++i) {
    const Scan scan = test::randomScan(random, {});
    for (Mapper* mapper : {&looked_at, &plain, &settled}) mapper->integrate(scan);
    EXPECT_EQ(settled.settle().revision(), static_cast<const Mapper&>(looked_at).map().revision());
  }
  const auto known = [](const CuboidMap& map) {
    return map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels();
  };
  EXPECT_GT(known(plain.map()), 0.0);
  EXPECT_EQ(known(looked_at.map()), known(plain.map()));
  EXPECT_EQ(known(settled.map()), known(plain.map()));
}

}  // namespace
}  // namespace cuboid_mapping
