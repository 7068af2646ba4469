// SPDX-License-Identifier: BSD-3-Clause
// Leaves keep any boxes, in as few bytes as their extent allows.
#include "cuboid_mapping/rtree/node_pool.h"

#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kGreatest = std::numeric_limits<std::int32_t>::max();
constexpr int kCapacity = 8;

Branch branchOf(const CellBox& box, bool is_occupied = false) {
  return {box, is_occupied, kNoNode};
}

/// A box from x to max_x along the first axis.
CellBox along(std::int32_t x, std::int32_t max_x) { return {{x, 0, 0}, {max_x, 1, 1}}; }

/// A pool with one leaf.
class OneLeaf : public testing::Test {
 protected:
  OneLeaf() : pool_(kCapacity, true), index_(pool_.allocate()) {}

  void append(const CellBox& box) { pool_.append(index_, branchOf(box)); }
  [[nodiscard]] const Node& leaf() const { return pool_[index_]; }
  [[nodiscard]] bool isWide() const {
    EXPECT_EQ(pool_.numWideLeaves(), leaf().kind() == NodeKind::kWideLeaf ? 1U : 0U);
    return leaf().kind() == NodeKind::kWideLeaf;
  }

  NodePool pool_;
  NodeIndex index_;
};

TEST_F(OneLeaf, isCompactUpTo255VoxelsAlongEachAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    CellBox box{{-7, -7, -7}, {-6, -6, -6}};
    box.max[axis] = box.min[axis] + 255;
    pool_[index_].clear();
    append(box);
    EXPECT_FALSE(isWide());
    EXPECT_EQ(leaf().box(0), box);
    box.max[axis] += 1;
    pool_.set(index_, 0, branchOf(box));
    EXPECT_TRUE(isWide());
    EXPECT_EQ(leaf().box(0), box);
  }
}

TEST_F(OneLeaf, movesItsOriginWithItsBoxes) {
  const std::vector<CellBox> boxes{along(1000, 1010), along(900, 905), along(1100, 1155),
                                   along(950, 951)};
  for (const CellBox& box : boxes) append(box);
  EXPECT_FALSE(isWide());
  for (int slot = 0; slot < leaf().count(); ++slot) {
    EXPECT_EQ(leaf().box(slot), boxes[static_cast<std::size_t>(slot)]);
  }
  EXPECT_EQ(leaf().summary().box, along(900, 1155));
}

TEST_F(OneLeaf, becomesWideByAnAppendedBoxAndCompactWhenItIsRemoved) {
  append(along(0, 1));
  append(along(255, 256));
  EXPECT_TRUE(isWide());
  append(along(100, 101));
  pool_.remove(index_, 0);
  EXPECT_FALSE(isWide());
  EXPECT_EQ(leaf().count(), 2);
  EXPECT_EQ(leaf().summary().box, along(100, 256));
}

TEST_F(OneLeaf, becomesCompactWhenTheWideBoxIsOverwritten) {
  append(along(0, 300));
  append(along(10, 20));
  EXPECT_TRUE(isWide());
  pool_.set(index_, 0, branchOf(along(5, 8), true));
  EXPECT_FALSE(isWide());
  EXPECT_EQ(leaf().cuboid(0), (Cuboid{along(5, 8), Occupancy::kOccupied}));
  EXPECT_EQ(leaf().cuboid(1), (Cuboid{along(10, 20), Occupancy::kFree}));
}

TEST_F(OneLeaf, becomesCompactWhenItIsFilledAnew) {
  append(along(0, 300));
  pool_[index_].clear();
  append(along(5, 8));
  EXPECT_FALSE(isWide());
  EXPECT_EQ(leaf().box(0), along(5, 8));
}

TEST_F(OneLeaf, givesBackTheMemoryOfWideBoxes) {
  append(along(0, 1));
  const std::size_t compact_bytes = pool_.numBytes();
  pool_.set(index_, 0, branchOf(along(0, 300)));
  EXPECT_GT(pool_.numBytes(), compact_bytes + Node::numWideBytes(kCapacity));
  pool_.release(index_);
  EXPECT_EQ(pool_.numWideLeaves(), 0U);
  EXPECT_LT(pool_.numBytes(), compact_bytes + Node::numWideBytes(kCapacity));
}

TEST_F(OneLeaf, holdsBoxesAtTheLimitsOfTheCoordinates) {
  const CellBox everything{{kLeast, kLeast, kLeast}, {kGreatest, kGreatest, kGreatest}};
  const CellBox at_least{{kLeast, kLeast, kLeast}, {kLeast + 255, kLeast + 1, kLeast + 1}};
  const CellBox at_greatest{{kGreatest - 255, kGreatest - 1, kGreatest - 1},
                            {kGreatest, kGreatest, kGreatest}};
  for (const CellBox& box : {at_least, at_greatest, everything}) {
    pool_[index_].clear();
    append(box);
    EXPECT_EQ(isWide(), box == everything);
    EXPECT_EQ(leaf().box(0), box);
    EXPECT_EQ(leaf().findOverlapping(everything), 1U);
    EXPECT_EQ(leaf().findOverlapping(at_least), box == at_greatest ? 0U : 1U);
    EXPECT_EQ(leaf().findOverlapping(at_greatest), box == at_least ? 0U : 1U);
  }
  pool_[index_].clear();
  append(at_least);
  append(at_greatest);
  EXPECT_TRUE(isWide());
  EXPECT_EQ(leaf().summary().box, everything);
}

/// A box of a kind that has all representations, next to one another and far apart.
CellBox randomLeafBox(test::Random& random) {
  const int corner = 1000 * random.integer(0, random.chance(0.1) ? 2 : 0);
  return test::randomBox(random, {{corner, -50, -50}, {corner + 100, 50, 50}},
                         random.chance(0.03) ? 400 : 30);
}

/// A box anywhere, as a window.
CellBox randomWindow(test::Random& random) {
  const int edge = random.chance(0.5) ? 20 : 3000;
  return test::randomBox(random, {{-500, -100, -100}, {2600, 100, 100}}, edge);
}

TEST_F(OneLeaf, keepsWhatWasSetThroughRandomChanges) {
  test::Random random(7);
  std::vector<Branch> model;
  std::size_t num_wide = 0;
  constexpr std::size_t kCases = 20000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const Branch branch = branchOf(randomLeafBox(random), random.chance(0.5));
    const int slot = model.empty() ? 0 : static_cast<int>(random.index(model.size()));
    if (model.empty() || (random.chance(0.4) && model.size() < kCapacity)) {
      pool_.append(index_, branch);
      model.push_back(branch);
    } else if (random.chance(0.5)) {
      pool_.set(index_, slot, branch);
      model[static_cast<std::size_t>(slot)] = branch;
    } else {
      pool_.remove(index_, slot);
      model[static_cast<std::size_t>(slot)] = model.back();
      model.pop_back();
    }
    num_wide += isWide() ? 1 : 0;
    ASSERT_EQ(leaf().count(), static_cast<int>(model.size()));
    const CellBox window = randomWindow(random);
    SlotSet overlapping = 0;
    SlotSet occupied = 0;
    for (std::size_t s = 0; s < model.size(); ++s) {
      ASSERT_EQ(leaf().box(static_cast<int>(s)), model[s].box) << test::seedNote(i);
      overlapping |= SlotSet{model[s].box.intersects(window) ? 1U : 0U} << s;
      occupied |= SlotSet{model[s].has_occupied ? 1U : 0U} << s;
    }
    ASSERT_EQ(leaf().findOverlapping(window), overlapping) << test::seedNote(i);
    ASSERT_EQ(leaf().occupiedSlots(), occupied) << test::seedNote(i);
  }
  EXPECT_GT(num_wide, kCases / 10);
  EXPECT_LT(num_wide, kCases - kCases / 10);
}

}  // namespace
}  // namespace cuboid_mapping
