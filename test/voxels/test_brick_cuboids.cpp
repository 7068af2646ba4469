// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include "cuboid_mapping/voxels/brick_store.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr Cell kBrick{-8, 16, 1 << 29};

std::vector<Cuboid> toCuboids(const BrickCuboids& cuboids, CuboidFilter filter) {
  std::vector<Cuboid> boxes;
  (void)cuboids.visit(filter, [&](PackedBox box, Occupancy occupancy) {
    boxes.push_back(unpackCuboid(kBrick, box, occupancy));
    return Visit::kContinue;
  });
  return boxes;
}

std::vector<Cuboid> toCuboids(const DividedBrick& divided) {
  std::vector<Cuboid> boxes;
  for (int i = 0; i < divided.count; ++i) {
    boxes.push_back(
        unpackCuboid(kBrick, divided.boxes[static_cast<std::size_t>(i)],
                     i < divided.num_occupied ? Occupancy::kOccupied : Occupancy::kFree));
  }
  return boxes;
}

BrickMask randomVoxels(test::Random& random) {
  if (random.chance(0.1)) return BrickMask::all();
  BrickMask mask;
  const double share = random.real(0.0, 1.0);
  const bool is_of_boxes = random.chance(0.5);
  for (int i = 0; i < (is_of_boxes ? random.integer(0, 6) : kBrickVoxels); ++i) {
    if (is_of_boxes) {
      const Cell min{random.integer(0, 7), random.integer(0, 7), random.integer(0, 7)};
      mask |= BrickMask::ofBox({min,
                                {random.integer(min.x + 1, 8), random.integer(min.y + 1, 8),
                                 random.integer(min.z + 1, 8)}});
    } else if (random.chance(share)) {
      mask.set(i);
    }
  }
  return mask;
}

TEST(BrickCuboids, areStaleAtFirstAndWhenTheyHaveBeenMovedFrom) {
  BrickCuboids cuboids;
  EXPECT_TRUE(cuboids.isStale());
  BrickCuboids all(divide(BrickMask(), BrickMask::all()));
  EXPECT_FALSE(all.isStale());
  cuboids = std::move(all);
  EXPECT_FALSE(cuboids.isStale());
  EXPECT_EQ(toCuboids(cuboids, CuboidFilter::kAll),
            (std::vector<Cuboid>{{brickBox(kBrick), Occupancy::kFree}}));
}

TEST(BrickCuboids, areWhatTheBrickWasDividedInto) {
  test::Random random(1);
  std::size_t num_inline = 0;
  for (int i = 0; i < 20000; ++i) {
    const BrickMask occupied = randomVoxels(random);
    const BrickMask free = randomVoxels(random).without(occupied);
    const DividedBrick divided = divide(occupied, free);
    const std::vector<Cuboid> expected = toCuboids(divided);
    const BrickCuboids cuboids(divided);
    ASSERT_EQ(toCuboids(cuboids, CuboidFilter::kAll), expected) << test::seedNote(i);
    ASSERT_EQ(toCuboids(cuboids, CuboidFilter::kOccupied).size(),
              static_cast<std::size_t>(divided.num_occupied));
    ASSERT_LE(8 * cuboids.numBytes(), static_cast<std::size_t>(18 * divided.count + 64));
    BrickMask covered;
    for (const Occupancy occupancy : {Occupancy::kOccupied, Occupancy::kFree}) {
      const bool is_occupied = occupancy == Occupancy::kOccupied;
      BrickMask of_class;
      for (const Cuboid& cuboid :
           toCuboids(cuboids, is_occupied ? CuboidFilter::kOccupied : CuboidFilter::kFree)) {
        ASSERT_EQ(cuboid.occupancy, occupancy);
        const BrickMask box = BrickMask::ofBox(cuboid.box);
        ASSERT_FALSE(box.intersects(covered));
        covered |= box;
        of_class |= box;
      }
      ASSERT_EQ(of_class, is_occupied ? occupied : free) << test::seedNote(i);
    }
    const BrickCuboids kept;
    kept.keep(divided);
    ASSERT_EQ(toCuboids(kept, CuboidFilter::kAll), expected);
    num_inline += cuboids.numBytes() == 0 ? 1 : 0;
  }
  EXPECT_GT(num_inline, 1000U);
  EXPECT_LT(num_inline, 19000U);
}

TEST(BrickCuboids, endAVisitWhenTheyAreTold) {
  const BrickCuboids cuboids(divide(BrickMask(), BrickMask::ofBox({{0, 0, 0}, {1, 1, 1}}) |
                                                     BrickMask::ofBox({{4, 4, 4}, {5, 5, 5}})));
  int num_visits = 0;
  EXPECT_EQ(cuboids.visit(CuboidFilter::kAll,
                          [&](PackedBox, Occupancy) {
                            ++num_visits;
                            return Visit::kStop;
                          }),
            Visit::kStop);
  EXPECT_EQ(num_visits, 1);
}

TEST(BrickCuboids, areTheSameForReadersSideBySide) {
  test::Random random(3);
  for (int i = 0; i < 200; ++i) {
    const DividedBrick divided = divide(randomVoxels(random), BrickMask());
    const BrickCuboids cuboids;
    std::vector<std::thread> readers;
    for (int reader = 0; reader < 3; ++reader) {
      readers.emplace_back([&] {
        cuboids.keep(divided);
        EXPECT_EQ(toCuboids(cuboids, CuboidFilter::kAll), toCuboids(divided));
      });
    }
    for (std::thread& reader : readers) reader.join();
  }
}

}  // namespace
}  // namespace cuboid_mapping
