// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/cell_box.h"

#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <set>
#include <sstream>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kFar = 1 << 30;

using test::visitCells;

TEST(Cell, hasCoordinatesByAxisAndAsMembers) {
  Cell cell{1, -2, 3};
  EXPECT_EQ(cell[0], 1);
  EXPECT_EQ(cell[1], -2);
  EXPECT_EQ(cell[2], 3);
  cell[1] = 7;
  EXPECT_EQ(cell, (Cell{1, 7, 3}));
  EXPECT_EQ(cell + (Cell{1, 1, 1}), (Cell{2, 8, 4}));
  EXPECT_EQ(cell - (Cell{1, 1, 1}), (Cell{0, 6, 2}));
}

TEST(Cell, isOrderedByZThenYThenX) {
  EXPECT_LT((Cell{9, 9, 0}), (Cell{0, 0, 1}));
  EXPECT_LT((Cell{9, 0, 1}), (Cell{0, 1, 1}));
  EXPECT_LT((Cell{0, 1, 1}), (Cell{1, 1, 1}));
  EXPECT_FALSE((Cell{1, 1, 1}) < (Cell{1, 1, 1}));
  EXPECT_FALSE((Cell{0, 0, 1}) < (Cell{9, 9, 0}));
}

/// A cell with small, arbitrary, or extreme coordinates.
Cell randomCellOfAnySize(test::Random& random) {
  constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t kGreatest = std::numeric_limits<std::int32_t>::max();
  const int limit = random.chance(0.5) ? 4 : 100;
  Cell cell = test::randomCell(random, {{-limit, -limit, -limit}, {limit, limit, limit}});
  if (random.chance(0.3)) cell[random.integer(0, 2)] = random.integer(kLeast, kGreatest);
  if (random.chance(0.1)) cell[random.integer(0, 2)] = random.chance(0.5) ? kLeast : kGreatest;
  return cell;
}

TEST(MortonCurve, isAnOrderOfAllCells) {
  test::Random random(4);
  std::size_t num_equal = 0;
  constexpr std::size_t kCases = 50000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const Cell a = randomCellOfAnySize(random);
    const Cell b = i % 10 == 0 ? a : randomCellOfAnySize(random);
    const Cell c = randomCellOfAnySize(random);
    ASSERT_EQ((isBeforeOnMortonCurve(a, b) ? 1 : 0) + (isBeforeOnMortonCurve(b, a) ? 1 : 0),
              a == b ? 0 : 1)
        << a << b << test::seedNote(i);
    if (isBeforeOnMortonCurve(a, b) && isBeforeOnMortonCurve(b, c)) {
      ASSERT_TRUE(isBeforeOnMortonCurve(a, c)) << a << b << c << test::seedNote(i);
    }
    num_equal += a == b ? 1 : 0;
  }
  EXPECT_GT(num_equal, kCases / 20);
}

TEST(MortonCurve, passesThroughAlignedCubesOneAfterTheOther) {
  test::Random random(5);
  std::size_t num_cases = 0;
  for (int i = 0; i < 50000; ++i) {
    const Cell a = randomCellOfAnySize(random);
    const int edge = 1 << random.integer(1, 20);
    const Cell cube{a.x & -edge, a.y & -edge, a.z & -edge};
    const Cell b = cube + test::randomCell(random, {{0, 0, 0}, {edge, edge, edge}});
    const Cell outside = randomCellOfAnySize(random);
    if ((outside.x & -edge) == cube.x && (outside.y & -edge) == cube.y &&
        (outside.z & -edge) == cube.z) {
      continue;
    }
    ++num_cases;
    ASSERT_EQ(isBeforeOnMortonCurve(outside, a), isBeforeOnMortonCurve(outside, b))
        << outside << a << b << " edge " << edge << test::seedNote(num_cases);
  }
  EXPECT_GT(num_cases, 10000U);
}

TEST(CellBox, isPrintedWithBothCorners) {
  std::ostringstream out;
  out << CellBox{{-1, 0, 2}, {3, 4, 5}};
  EXPECT_EQ(out.str(), "[(-1 0 2) (3 4 5))");
}

TEST(CellBox, holdsItsLeastCellButNotItsGreatestCorner) {
  const CellBox box{{-2, -2, -2}, {2, 3, 4}};
  EXPECT_TRUE(box.contains(box.min));
  EXPECT_TRUE(box.contains(Cell{1, 2, 3}));
  for (int axis = 0; axis < 3; ++axis) {
    Cell cell = box.min;
    cell[axis] = box.max[axis];
    EXPECT_FALSE(box.contains(cell)) << "axis " << axis;
    cell[axis] = box.min[axis] - 1;
    EXPECT_FALSE(box.contains(cell)) << "axis " << axis;
  }
}

TEST(CellBox, ofCellHoldsThatCellOnly) {
  const Cell cell{-5, 0, 7};
  const CellBox box = CellBox::ofCell(cell);
  EXPECT_EQ(box.numVoxels(), 1.0);
  EXPECT_TRUE(box.contains(cell));
  EXPECT_FALSE(box.contains(cell + Cell{1, 0, 0}));
}

TEST(CellBox, sharesNoCellWithANeighbourAtItsFace) {
  const CellBox box{{0, 0, 0}, {4, 4, 4}};
  for (int axis = 0; axis < 3; ++axis) {
    CellBox neighbour = box;
    neighbour.min[axis] = 4;
    neighbour.max[axis] = 8;
    EXPECT_FALSE(box.intersects(neighbour)) << "axis " << axis;
    EXPECT_FALSE(neighbour.intersects(box)) << "axis " << axis;
    EXPECT_TRUE(intersect(box, neighbour).isEmpty()) << "axis " << axis;
    neighbour.min[axis] = 3;
    EXPECT_TRUE(box.intersects(neighbour)) << "axis " << axis;
  }
}

TEST(CellBox, isEmptyWhenFlatOrInvertedOnAnyAxis) {
  EXPECT_TRUE(CellBox{}.isEmpty());
  for (int axis = 0; axis < 3; ++axis) {
    CellBox box{{0, 0, 0}, {2, 2, 2}};
    EXPECT_FALSE(box.isEmpty());
    box.max[axis] = 0;
    EXPECT_TRUE(box.isEmpty()) << "axis " << axis;
    EXPECT_EQ(box.numVoxels(), 0.0) << "axis " << axis;
    box.max[axis] = -1;
    EXPECT_TRUE(box.isEmpty()) << "axis " << axis;
    EXPECT_EQ(box.numVoxels(), 0.0) << "axis " << axis;
  }
}

TEST(CellBox, countsVoxelsOfTheWholeGridWithoutOverflow) {
  const CellBox grid{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  EXPECT_EQ(grid.numVoxels(), 0x1p93);
  constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t kGreatest = std::numeric_limits<std::int32_t>::max();
  EXPECT_EQ((CellBox{{kLeast, 0, 0}, {kGreatest, 1, 1}}).numVoxels(), 4294967295.0);
}

TEST(CellBox, containsEveryEmptyBox) {
  const CellBox box{{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(box.contains(CellBox{{5, 5, 5}, {5, 9, 9}}));
  EXPECT_TRUE(box.contains(CellBox{{5, 5, 5}, {4, 4, 4}}));
  EXPECT_FALSE(box.contains(CellBox{{0, 0, 0}, {1, 1, 2}}));
  EXPECT_TRUE(box.contains(box));
}

TEST(CellBox, relationsAgreeWithCountedCells) {
  test::Random random(1);
  const CellBox area{{-4, -4, -4}, {5, 5, 5}};
  int num_intersecting = 0;
  int num_containing = 0;
  constexpr int kCases = 20000;
  for (int i = 0; i < kCases; ++i) {
    const CellBox a = test::randomBox(random, area, 6);
    const CellBox b = test::randomBox(random, area, 6);
    int num_common = 0;
    visitCells(a, [&](const Cell& cell) { num_common += b.contains(cell) ? 1 : 0; });
    ASSERT_EQ(intersect(a, b).numVoxels(), num_common) << a << b;
    ASSERT_EQ(a.intersects(b), num_common > 0) << a << b;
    ASSERT_EQ(a.contains(b), num_common == b.numVoxels()) << a << b;
    const CellBox both = unite(a, b);
    ASSERT_TRUE(both.contains(a) && both.contains(b)) << a << b;
    for (int axis = 0; axis < 3; ++axis) {  // No smaller box contains both.
      ASSERT_TRUE(both.min[axis] == a.min[axis] || both.min[axis] == b.min[axis]);
      ASSERT_TRUE(both.max[axis] == a.max[axis] || both.max[axis] == b.max[axis]);
    }
    num_intersecting += num_common > 0 ? 1 : 0;
    num_containing += a.contains(b) ? 1 : 0;
  }
  EXPECT_GT(num_intersecting, kCases / 10);
  EXPECT_LT(num_intersecting, kCases * 9 / 10);
  EXPECT_GT(num_containing, kCases / 500);
}

/// Number of pieces of a hole in the box [0, 6) on each axis.
int numPieces(const CellBox& hole) { return subtract({{0, 0, 0}, {6, 6, 6}}, hole).size(); }

TEST(Subtract, givesOneSlabForEachFaceThatTheHoleDoesNotReach) {
  EXPECT_EQ(numPieces({{2, 2, 2}, {4, 4, 4}}), 6) << "in the middle";
  EXPECT_EQ(numPieces({{2, 2, 0}, {4, 4, 2}}), 5) << "at a face";
  EXPECT_EQ(numPieces({{2, 0, 0}, {4, 2, 2}}), 4) << "at an edge";
  EXPECT_EQ(numPieces({{0, 0, 0}, {2, 2, 2}}), 3) << "at a corner";
  EXPECT_EQ(numPieces({{2, 0, 0}, {4, 6, 6}}), 2) << "a slab";
  EXPECT_EQ(numPieces({{-1, -1, 3}, {9, 9, 9}}), 1) << "half of the box";
  EXPECT_EQ(numPieces({{0, 0, 0}, {6, 6, 6}}), 0) << "the box";
  EXPECT_EQ(numPieces({{-9, -9, -9}, {9, 9, 9}}), 0) << "more than the box";
}

TEST(Subtract, givesTheBoxWhereThereIsNothingToCut) {
  const CellBox box{{0, 0, 0}, {2, 2, 2}};
  for (const CellBox& hole : {CellBox{{2, 0, 0}, {4, 2, 2}}, CellBox{{1, 1, 1}, {1, 2, 2}},
                              CellBox{{1, 1, 1}, {0, 0, 0}}, CellBox{{9, 9, 9}, {10, 10, 10}}}) {
    const BoxPieces pieces = subtract(box, hole);
    ASSERT_EQ(pieces.size(), 1) << hole;
    EXPECT_EQ(*pieces.begin(), box) << hole;
  }
  EXPECT_EQ(subtract({{0, 0, 0}, {2, 0, 2}}, box).size(), 0) << "an empty box has no pieces";
  EXPECT_EQ(subtract({{0, 0, 0}, {2, 0, 2}}, {{9, 9, 9}, {10, 10, 10}}).size(), 0);
}

TEST(Subtract, cutsAlongZThenYThenX) {
  const BoxPieces pieces = subtract({{0, 0, 0}, {3, 3, 3}}, CellBox::ofCell({1, 1, 1}));
  const std::vector<CellBox> expected{{{0, 0, 0}, {3, 3, 1}}, {{0, 0, 2}, {3, 3, 3}},
                                      {{0, 0, 1}, {3, 1, 2}}, {{0, 2, 1}, {3, 3, 2}},
                                      {{0, 1, 1}, {1, 2, 2}}, {{2, 1, 1}, {3, 2, 2}}};
  EXPECT_EQ(std::vector<CellBox>(pieces.begin(), pieces.end()), expected);
}

TEST(Subtract, coversExactlyTheRestWithDisjointPieces) {
  test::Random random(2);
  const CellBox area{{-4, -4, -4}, {5, 5, 5}};
  std::array<int, 7> num_by_pieces{};
  constexpr std::size_t kCases = 30000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const CellBox box = test::randomBox(random, area, 7);
    const CellBox hole =
        random.chance(0.3) ? test::randomBoxInside(random, box) : test::randomBox(random, area, 9);
    const BoxPieces pieces = subtract(box, hole);
    ASSERT_LE(pieces.size(), 6);
    std::set<Cell> cells;
    for (const CellBox& piece : pieces) {
      ASSERT_FALSE(piece.isEmpty()) << box << hole;
      visitCells(piece, [&](const Cell& cell) {
        ASSERT_TRUE(cells.insert(cell).second) << "two pieces hold " << cell << box << hole;
      });
    }
    visitCells(box, [&](const Cell& cell) {
      ASSERT_EQ(cells.count(cell) == 1, !hole.contains(cell)) << cell << box << hole;
    });
    ASSERT_EQ(static_cast<double>(cells.size()) + intersect(box, hole).numVoxels(),
              box.numVoxels());
    ++num_by_pieces[static_cast<std::size_t>(pieces.size())];
  }
  for (std::size_t pieces = 0; pieces < num_by_pieces.size(); ++pieces) {
    EXPECT_GT(num_by_pieces[pieces], 100) << pieces << " pieces";
  }
}

TEST(Subtract, isExactAtTheBordersOfTheGrid) {
  test::Random random(3);
  const CellBox grid{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  for (int i = 0; i < 5000; ++i) {
    const CellBox box = test::randomBoxInside(random, grid);
    const CellBox hole = test::randomBoxInside(random, grid);
    CellBox bounds = intersect(box, hole);
    long double sum = bounds.numVoxels();
    const BoxPieces pieces = subtract(box, hole);
    for (const CellBox& piece : pieces) {
      ASSERT_TRUE(box.contains(piece));
      ASSERT_FALSE(piece.intersects(hole));
      for (const CellBox& other : pieces) ASSERT_TRUE(&piece == &other || !piece.intersects(other));
      sum += piece.numVoxels();
    }
    ASSERT_NEAR(static_cast<double>(sum / box.numVoxels()), 1.0, 1e-12) << box << hole;
  }
}

}  // namespace
}  // namespace cuboid_mapping
