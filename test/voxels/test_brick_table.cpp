// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/brick_table.h"

#include "support/modelled_brick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

struct Item {
  Cell brick;
  int number = 0;
};

using Table = BrickTable<Item>;

constexpr std::int32_t kFar = 1 << 30;
constexpr CellBox kEverything{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};

/// The items that a table visits, each exactly once.
std::map<Cell, int> contentOf(const Table& table) {
  std::map<Cell, int> content;
  table.forEach([&](const Item& item) {
    EXPECT_TRUE(content.emplace(item.brick, item.number).second) << item.brick << " comes twice";
  });
  return content;
}

TEST(BrickTable, holdsNothingAtFirst) {
  Table table;
  EXPECT_EQ(table.size(), 0U);
  EXPECT_TRUE(table.isEmpty());
  EXPECT_EQ(table.find({0, 0, 0}), nullptr);
  EXPECT_EQ(table.numBytes(), 0U);
  table.erase({0, 0, 0});
  EXPECT_TRUE(contentOf(table).empty());
}

TEST(BrickTable, makesAnItemAnewAfterItWasErased) {
  Table table;
  table.findOrAdd({8, 0, 0}).number = 5;
  EXPECT_EQ(table.findOrAdd({8, 0, 0}).number, 5);
  table.erase({8, 0, 0});
  EXPECT_EQ(table.find({8, 0, 0}), nullptr);
  EXPECT_EQ(table.findOrAdd({8, 0, 0}).number, 0);
  EXPECT_EQ(table.size(), 1U);
}

TEST(BrickTable, givesBackWhatAnErasedItemHolds) {
  struct Owner {
    Cell brick;
    std::shared_ptr<int> held;
  };
  BrickTable<Owner> table;
  const auto held = std::make_shared<int>(1);
  table.findOrAdd({0, 0, 0}).held = held;
  table.erase({0, 0, 0});
  EXPECT_EQ(held.use_count(), 1);
}

TEST(BrickTable, keepsItemsInTheirPlaces) {
  Table table;
  std::vector<const Item*> places;
  for (int i = 0; i < 3000; ++i) places.push_back(&table.findOrAdd({8 * i, 0, 0}));
  for (int i = 0; i < 3000; i += 2) table.erase({8 * i, 0, 0});
  for (int i = 1; i < 3000; i += 2) {
    ASSERT_EQ(table.find({8 * i, 0, 0}), places[static_cast<std::size_t>(i)]);
  }
}

TEST(BrickTable, usesFreePlacesAgain) {
  Table table;
  for (int i = 0; i < 1000; ++i) table.findOrAdd({8 * i, 0, 0});
  for (int i = 0; i < 1000; ++i) table.erase({8 * i, 0, 0});
  const std::size_t num_bytes = table.numBytes();
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 1000; ++i) table.findOrAdd({0, 8 * i, 8 * round});
    EXPECT_EQ(table.numBytes(), num_bytes);
    for (int i = 0; i < 1000; ++i) table.erase({0, 8 * i, 8 * round});
  }
  table.clear();
  EXPECT_EQ(table.numBytes(), 0U);
}

/// Compares the items in a box that a table visits with a test of each.
void checkBox(const Table& table, const std::map<Cell, int>& model, const CellBox& box) {
  std::set<Cell> found;
  table.forEachIn(box, [&](const Item& item) {
    EXPECT_TRUE(found.insert(item.brick).second) << item.brick << " comes twice";
  });
  std::set<Cell> expected;
  for (const auto& [brick, number] : model) {
    if (!intersect(brickBox(brick), box).isEmpty()) expected.insert(brick);
  }
  EXPECT_EQ(found, expected) << box;
}

TEST(BrickTable, agreesWithAnOrderedMapThroughRandomChanges) {
  constexpr std::size_t kSteps = 60000;
  std::size_t most = 0;
  for (const int reach : {1, 3, 12, 1 << 26}) {
    test::Random random(static_cast<std::uint64_t>(reach));
    Table table;
    std::map<Cell, int> model;
    for (std::size_t step = 0; step < kSteps; ++step) {
      const double growth = step / 10000 % 2 == 0 ? 0.7 : 0.3;  // Up, and down again.
      Cell brick = test::randomBrick(random, reach);
      if (random.chance(0.4) && !model.empty()) {  // A brick that is in the table, or is next.
        const auto next = model.lower_bound(brick);
        brick = next == model.end() ? model.begin()->first : next->first;
      }
      if (random.chance(growth)) {
        const int number = random.integer(1, 1 << 20);
        table.findOrAdd(brick).number = number;
        model[brick] = number;
      } else {
        table.erase(brick);
        model.erase(brick);
      }
      const Cell asked = test::randomBrick(random, reach);
      const Item* found = table.find(asked);
      const auto expected = model.find(asked);
      ASSERT_EQ(found != nullptr, expected != model.end()) << test::seedNote(step);
      ASSERT_TRUE(found == nullptr || found->number == expected->second) << test::seedNote(step);
      ASSERT_EQ(table.size(), model.size());
      most = std::max(most, model.size());
      if (step % 500 != 0) continue;
      ASSERT_EQ(contentOf(table), model) << test::seedNote(step);
      checkBox(table, model, test::randomBoxInside(random, {{-40, -40, -40}, {40, 40, 40}}));
      checkBox(table, model, kEverything);
      ASSERT_FALSE(HasFailure()) << test::seedNote(step);
    }
    if (random.chance(0.5)) table.clear();
  }
  EXPECT_GT(most, 5000U);
}

TEST(BrickTable, findsNothingInAnEmptyBox) {
  Table table;
  table.findOrAdd({0, 0, 0});
  for (const CellBox& box : {CellBox{{3, 3, 3}, {3, 3, 3}}, CellBox{{3, 3, 3}, {5, 3, 5}},
                             CellBox{{5, 5, 5}, {3, 3, 3}}}) {
    table.forEachIn(box, [&](const Item&) { ADD_FAILURE() << box; });
  }
}

/// Bricks whose numbers lie in a box.
std::vector<Cell> bricksIn(const CellBox& numbers) {
  std::vector<Cell> bricks;
  for (int z = numbers.min.z; z < numbers.max.z; ++z) {
    for (int y = numbers.min.y; y < numbers.max.y; ++y) {
      for (int x = numbers.min.x; x < numbers.max.x; ++x) bricks.push_back({8 * x, 8 * y, 8 * z});
    }
  }
  return bricks;
}

/// Mean and maximum number of slots that a search for a brick of a full table reads.
std::pair<double, std::size_t> probesOf(const std::vector<Cell>& bricks) {
  Table table;
  for (const Cell& brick : bricks) table.findOrAdd(brick);
  std::size_t sum = 0;
  std::size_t most = 0;
  for (const Cell& brick : bricks) {
    sum += table.numProbes(brick);
    most = std::max(most, table.numProbes(brick));
  }
  return {static_cast<double>(sum) / static_cast<double>(bricks.size()), most};
}

TEST(BrickTable, findsTheBricksOfMapsOfAnyShapeAtOnce) {
  // With random slots a search reads 1.5 of them on average if half are taken.
  std::size_t num_shapes = 0;
  for (const Cell& size :
       {Cell{2, 2, 2}, Cell{4, 4, 4}, Cell{8, 8, 8}, Cell{20, 20, 20}, Cell{40, 40, 40},
        Cell{1, 1, 30}, Cell{1, 1, 500}, Cell{1, 500, 1}, Cell{500, 1, 1}, Cell{3, 3, 200},
        Cell{30, 30, 3}, Cell{200, 200, 2}, Cell{1, 60, 60}, Cell{63, 1, 63}}) {
    for (const Cell& least : {Cell{0, 0, 0}, Cell{-5, -7, -3}, Cell{1000, -2000, 0},
                              Cell{-(1 << 26), (1 << 26) - 500, 1 << 20}}) {
      const auto [mean, most] = probesOf(bricksIn({least, least + size}));
      const double count = static_cast<double>(size.x) * size.y * size.z;
      EXPECT_LT(mean, count < 100.0 ? 2.5 : 2.0) << size << " from " << least;
      EXPECT_LT(most, 60U) << size << " from " << least;
      ++num_shapes;
    }
  }
  EXPECT_EQ(num_shapes, 14U * 4U);
}

}  // namespace
}  // namespace cuboid_mapping
