// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/brick.h"

#include "cuboid_mapping/geometry/page.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

TEST(Brick, isNamedByItsLeastCell) {
  EXPECT_EQ(brickOf({0, 7, 8}), (Cell{0, 0, 8}));
  EXPECT_EQ(brickOf({-1, -8, -9}), (Cell{-8, -8, -16}));
  EXPECT_EQ(brickOf({(1 << 30) - 1, -(1 << 30), 0}), (Cell{(1 << 30) - 8, -(1 << 30), 0}));
}

TEST(Brick, holdsExactlyTheCellsThatAreOfIt) {
  test::Random random(1);
  const CellBox area{{-40, -40, -40}, {40, 40, 40}};
  for (int i = 0; i < 10000; ++i) {
    const Cell cell = test::randomCell(random, area);
    const CellBox box = brickBox(brickOf(cell));
    ASSERT_TRUE(box.contains(cell)) << cell;
    ASSERT_EQ(box.numVoxels(), kBrickVoxels);
    ASSERT_EQ(brickOf(box.min), box.min);
    ASSERT_EQ(brickOf(box.max - Cell{1, 1, 1}), box.min);
    ASSERT_EQ(brickOf(box.max), box.max);
  }
}

TEST(Brick, numbersItsVoxelsByXThenYThenZ) {
  for (const Cell brick : {Cell{0, 0, 0}, Cell{-8, -16, 800}}) {
    int expected = 0;
    for (int z = 0; z < kBrickEdge; ++z) {
      for (int y = 0; y < kBrickEdge; ++y) {
        for (int x = 0; x < kBrickEdge; ++x) {
          ASSERT_EQ(voxelIndex(brick + Cell{x, y, z}), expected++);
        }
      }
    }
    EXPECT_EQ(expected, kBrickVoxels);
  }
}

/// The voxels of a box in one brick, voxel by voxel.
BrickMask markVoxels(const CellBox& box) {
  BrickMask mask;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if (box.contains(cellAt(brickOf(box.min), voxel))) mask.set(voxel);
  }
  return mask;
}

TEST(BrickMask, findsNeighborsInItsBrickAndTheNextOne) {
  test::Random random(9);
  for (int i = 0; i < 50; ++i) {
    BrickMask here;
    BrickMask there;
    for (int z = 0; z < kBrickEdge; ++z) {
      here[z] = random.bits();
      there[z] = random.bits();
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const BrickMask found = neighborsIn(here, there, axis, step);
        for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
          Cell beside = cellAt({0, 0, 0}, voxel);
          beside[axis] += step;
          const bool is_here = brickOf(beside) == Cell{0, 0, 0};
          ASSERT_EQ(found.test(voxel), (is_here ? here : there).test(voxelIndex(beside)));
        }
      }
    }
  }
}

TEST(Brick, findsTheVoxelOfANumber) {
  for (const Cell brick : {Cell{0, 0, 0}, Cell{-8, -16, 800}}) {
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const Cell cell = cellAt(brick, voxel);
      ASSERT_EQ(voxelIndex(cell), voxel);
      ASSERT_EQ(brickOf(cell), brick);
    }
  }
}

TEST(Brick, visitsTheBricksThatShareACellWithABox) {
  test::Random random(3);
  const CellBox all{{-48, -48, -48}, {48, 48, 48}};
  for (std::size_t i = 0; i < 1000; ++i) {
    const CellBox box = test::randomBox(random, {{-20, -20, -20}, {20, 20, 20}}, 25);
    std::vector<Cell> expected;
    for (Cell brick = all.min; brick.z < all.max.z; brick.z += kBrickEdge) {
      for (brick.y = all.min.y; brick.y < all.max.y; brick.y += kBrickEdge) {
        for (brick.x = all.min.x; brick.x < all.max.x; brick.x += kBrickEdge) {
          if (!intersect(brickBox(brick), box).isEmpty()) expected.push_back(brick);
        }
      }
    }
    std::vector<Cell> visited;
    forEachBrick(box, [&](const Cell& brick) { visited.push_back(brick); });
    ASSERT_EQ(visited, expected) << test::seedNote(i);
    ASSERT_EQ(numBricks(box), static_cast<double>(expected.size())) << test::seedNote(i);
    const Cell& last = expected.back();
    std::size_t num_asked = 0;
    ASSERT_TRUE(anyBrick(box, [&](const Cell& brick) {
      ++num_asked;
      return brick == last;
    }));
    ASSERT_EQ(num_asked, expected.size());
    ASSERT_FALSE(anyBrick(box, [](const Cell&) { return false; }));
  }
}

TEST(Brick, visitsNoneForAnEmptyBox) {
  for (const CellBox& box : {CellBox{{0, 0, 0}, {0, 0, 0}}, CellBox{{3, 3, 3}, {3, 3, 3}},
                             CellBox{{3, 3, 3}, {3, 20, 20}}, CellBox{{-5, 3, 9}, {5, 5, 2}}}) {
    EXPECT_EQ(numBricks(box), 0.0) << box;
    forEachBrick(box, [&](const Cell& brick) { ADD_FAILURE() << brick << " for " << box; });
  }
}

TEST(Brick, countsTheBricksOfTheWholeGrid) {
  constexpr std::int32_t kFar = 1 << 30;
  EXPECT_EQ(numBricks({{-kFar, -kFar, 0}, {kFar, kFar, 1}}), 0x1p56);
}

TEST(Page, isCountedIfItSharesACellWithABox) {
  EXPECT_EQ(numPages(pageBox({64, 0, -64})), 1.0);
  EXPECT_EQ(numPages({{-1, 0, 0}, {65, 64, 1}}), 3.0);
  EXPECT_EQ(numPages({}), 0.0);
}

TEST(Brick, numbersTheBricksOfAGroup) {
  std::vector<int> count(kGroupBricks, 0);
  const Cell group{-64, 32, 0};
  forEachBrick({group, group + Cell{kGroupEdge, kGroupEdge, kGroupEdge}}, [&](const Cell& brick) {
    EXPECT_EQ(groupOf(brick), group);
    ++count[indexInGroup(brick)];
  });
  EXPECT_EQ(count, std::vector<int>(kGroupBricks, 1));
  EXPECT_EQ(indexInGroup(group + Cell{24, 8, 16}), 16U * 2 + 4U * 1 + 3U);
}

TEST(BrickMask, hasTheVoxelsOfABox) {
  int num_cases = 0;
  for (const Cell brick : {Cell{0, 0, 0}, Cell{8, 8, 8}, Cell{-8, -16, -24}}) {
    for (int x = 0; x < 8 * 8; ++x) {
      for (int y = 0; y < 8 * 8; ++y) {
        const Cell min{x / 8, y / 8, (x + y) % 8};
        const Cell max{x % 8 + 1, y % 8 + 1, min.z + 1 + x * y % (8 - min.z)};
        if (min.x >= max.x || min.y >= max.y) continue;
        const CellBox box{brick + min, brick + max};
        ASSERT_EQ(BrickMask::ofBox(box), markVoxels(box)) << box;
        ASSERT_EQ(BrickMask::ofBox(box).count(), box.numVoxels()) << box;
        ++num_cases;
      }
    }
  }
  EXPECT_EQ(num_cases, 3 * 36 * 36);
}

TEST(BrickMask, isEmptyAtFirstAndFullWithAll) {
  EXPECT_TRUE(BrickMask().isEmpty());
  EXPECT_FALSE(BrickMask().isFull());
  EXPECT_EQ(BrickMask().count(), 0);
  EXPECT_TRUE(BrickMask::all().isFull());
  EXPECT_FALSE(BrickMask::all().isEmpty());
  EXPECT_EQ(BrickMask::all().count(), kBrickVoxels);
  EXPECT_EQ(BrickMask::all(), BrickMask::ofBox(brickBox({-8, 0, 8})));
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    BrickMask one;
    one.set(voxel);
    ASSERT_FALSE(one.isEmpty());
    ASSERT_FALSE((~one).isFull());
  }
}

TEST(BrickMask, isASetOfVoxels) {
  test::Random random(4);
  for (std::size_t i = 0; i < 1000; ++i) {
    std::set<int> sets[2];
    BrickMask masks[2];
    for (int which = 0; which < 2; ++which) {
      const int count = random.chance(0.2) ? 0 : random.integer(1, 600);
      for (int n = 0; n < count; ++n) {
        const int voxel = random.integer(0, kBrickVoxels - 1);
        sets[which].insert(voxel);
        masks[which].set(voxel);
      }
    }
    const auto& [a, b] = masks;
    bool is_shared = false;
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const bool in_a = sets[0].count(voxel) != 0;
      const bool in_b = sets[1].count(voxel) != 0;
      ASSERT_EQ(a.test(voxel), in_a) << test::seedNote(i);
      ASSERT_EQ((a | b).test(voxel), in_a || in_b) << test::seedNote(i);
      ASSERT_EQ((a & b).test(voxel), in_a && in_b) << test::seedNote(i);
      ASSERT_EQ((a ^ b).test(voxel), in_a != in_b) << test::seedNote(i);
      ASSERT_EQ((~a).test(voxel), !in_a) << test::seedNote(i);
      ASSERT_EQ(a.without(b).test(voxel), in_a && !in_b) << test::seedNote(i);
      is_shared |= in_a && in_b;
    }
    std::vector<int> visited;
    a.forEach([&visited](int voxel) { visited.push_back(voxel); });
    ASSERT_EQ(visited, std::vector<int>(sets[0].begin(), sets[0].end())) << test::seedNote(i);
    std::vector<Cell> cells;
    forEachCell({-8, 0, 16}, a, [&cells](const Cell& cell) { cells.push_back(cell); });
    ASSERT_EQ(cells.size(), visited.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
      ASSERT_EQ(cells[c], cellAt({-8, 0, 16}, visited[c])) << test::seedNote(i);
    }
    ASSERT_EQ(a.count(), static_cast<int>(sets[0].size())) << test::seedNote(i);
    ASSERT_EQ(a.intersects(b), is_shared) << test::seedNote(i);
    ASSERT_TRUE(a.contains(a & b) && (a | b).contains(b)) << test::seedNote(i);
    ASSERT_EQ(a.contains(b),
              std::includes(sets[0].begin(), sets[0].end(), sets[1].begin(), sets[1].end()))
        << test::seedNote(i);
    ASSERT_EQ(a == b, sets[0] == sets[1]) << test::seedNote(i);
  }
}

}  // namespace
}  // namespace cuboid_mapping
