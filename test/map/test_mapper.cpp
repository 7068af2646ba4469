// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/mapper.h"

#include "cuboid_mapping/parallel/parallel_for.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <thread>

namespace cuboid_mapping {
namespace {

MapperConfig configOf(int threads) {
  MapperConfig config;
  config.map.threads = threads;
  return config;
}

double numKnown(const CuboidMap& map) {
  return map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels();
}

TEST(Mapper, givesAMapThatStandsStillUntilTheNextScan) {
  test::Random random(5);
  Mapper mapper(configOf(2));
  for (int i = 0; i < 50; ++i) {
    mapper.integrate(test::randomScan(random, {}));
    const CuboidMap& map = mapper.map();
    const double num_known = numKnown(map);
    const auto revision = map.revision();
    std::this_thread::yield();
    ASSERT_EQ(mapper.map().revision(), revision) << "scan " << i;
    ASSERT_EQ(numKnown(map), num_known);
  }
}

TEST(Mapper, makesTheSameMapWithAndWithoutALookAtIt) {
  test::Random random(6);
  Mapper looked_at(configOf(2));
  Mapper plain(configOf(1));
  Mapper left_alone(configOf(2));
  for (int i = 0; i < 20; ++i) {
    const Scan scan = test::randomScan(random, {});
    for (Mapper* mapper : {&looked_at, &plain, &left_alone}) mapper->integrate(scan);
    EXPECT_EQ(plain.map().revision(), static_cast<const Mapper&>(looked_at).map().revision());
  }
  EXPECT_GT(numKnown(plain.map()), 0.0);
  EXPECT_EQ(numKnown(looked_at.map()), numKnown(plain.map()));
  EXPECT_EQ(numKnown(left_alone.map()), numKnown(plain.map()));
}

/// A scan that takes a while in the map.
Scan wideScan() {
  Scan scan;
  for (int i = 0; i < 3000; ++i) {
    const float angle = 0.1F * static_cast<float>(i);
    scan.points.emplace_back(40.0F * std::cos(angle), 40.0F * std::sin(angle),
                             0.02F * static_cast<float>(i) - 30.0F);
  }
  return scan;
}

/// Whether integrate() returns before its scan is in the map, after a look at the map. @pre A new program.
bool worksBesideItsCaller() {
  std::atomic<bool> is_released{false};
  BackgroundWork blocker([&] {
    while (!is_released) std::this_thread::yield();
  });
  Mapper mapper(configOf(2));
  const CuboidMap& map = mapper.map();
  const auto revision = map.revision();
  mapper.integrate(wideScan());
  const bool is_early =
      map.revision() == revision;  // The only other thread is busy: nobody changes the map.
  is_released = true;
  return is_early && mapper.map().revision() > revision;
}

TEST(MapperDeathTest, worksBesideItsCallerAfterALookAtTheMap) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";  // A program of its own.
  EXPECT_EXIT(std::exit(worksBesideItsCaller() ? 0 : 1), ::testing::ExitedWithCode(0), "");
}

TEST(MapperDeathTest, canBeAStaticObject) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";  // A program of its own.
  EXPECT_EXIT(
      {
        static Mapper mapper(configOf(2));
        mapper.integrate(wideScan());
        std::exit(0);
      },
      ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace cuboid_mapping
