// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/map_window.h"

#include "tools/run_program.h"
#include "window/window_pair.h"

namespace cuboid_mapping {
namespace {

using test::placeOf;
using test::Random;
using test::randomConfig;
using test::TemporaryFolder;
using test::tenthOfAMetre;
using test::updateOf;
using test::Walk;
using test::WindowPair;

/// Voxels of a map in a box.
std::map<Cell, float> voxelsIn(const CuboidMap& map, const CellBox& box) {
  std::map<Cell, float> voxels;
  for (const auto& [cell, value] : test::voxelsOf(map)) {
    if (box.contains(cell)) voxels.emplace(cell, value);
  }
  return voxels;
}

TEST(MapWindow, thatKeepsIsTheMapWithoutOneVoxelByVoxel) {
  std::size_t num_loads = 0;
  std::size_t num_checked = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const TemporaryFolder folder;
    Random random(901 + i);
    const WindowConfig config{random.real(1.0, 20.0), random.real(0.0, 8.0), OutsideWindow::kKeep};
    WindowPair pair(randomConfig(random), config, folder / "map.sqlite");
    Walk walk(random);
    for (int step = 0; step < 150; ++step) {
      walk.step(pair);
      if (step % 25 == 0) {
        // An edit anywhere, and a read of a place that may be on disk.
        const CellBox box = test::randomBox(random, {{-400, -400, -30}, {400, 400, 30}}, 70);
        pair.replace(box, random.chance(0.5) ? std::vector<UniformBox>{{box, 0.5F}}
                                             : std::vector<UniformBox>());
        const CellBox asked = test::randomBox(random, {{-500, -500, -40}, {500, 500, 40}}, 200);
        pair.window->load(asked, pair.changes);
        EXPECT_EQ(pair.window->countNotLoaded(asked), 0U);
        const auto voxels = voxelsIn(pair.map, asked);
        EXPECT_EQ(voxels, voxelsIn(pair.plain, asked));
        num_checked += voxels.size();
      }
      if (step == 75) {
        num_loads += pair.window->figures().num_loads;
        pair.startAgain();
      }
    }
    EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
    EXPECT_EQ(pair.window->figures().num_failures, 0U);
    EXPECT_EQ(pair.window->figures().num_refused + pair.window->figures().num_unreadable, 0U);
    num_loads += pair.window->figures().num_loads;
    ASSERT_TRUE(pair.window->save());
    pair.window.reset();
    const MapStore store(folder / "map.sqlite", StoreAccess::kRead);
    EXPECT_EQ(test::voxelsOf(readStore(store).bricks), test::voxelsOf(pair.plain));
  }
  EXPECT_GT(num_loads, 500U);
  EXPECT_GT(num_checked, 10000U);
}

TEST(MapWindow, tellsOfAllThatComesAndLeaves) {
  const TemporaryFolder folder;
  Random random(931);
  WindowPair pair(randomConfig(random), {6.0, 1.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Walk walk(random);
  std::map<Cell, float> seen;  // A copy that reads changed bricks again.
  for (int step = 0; step < 120; ++step) {
    walk.step(pair);
    for (const ChangedBrick& changed : pair.changes.bricks) {
      forEachCell(changed.brick, BrickMask::all(), [&](const Cell& cell) {
        seen.erase(cell);
        if (const auto value = pair.map.voxels().logOddsAt(cell)) seen.emplace(cell, *value);
      });
    }
    EXPECT_EQ(pair.changes.revision, pair.map.revision());
  }
  EXPECT_EQ(seen, test::voxelsOf(pair.map));
  EXPECT_GT(pair.window->figures().num_on_disk_only, 20U);
  EXPECT_EQ(pair.window->countNotLoaded(kAllCells), pair.window->figures().num_on_disk_only);
}

TEST(MapWindow, keepsWhatIsInItAndInItsMargin) {
  const TemporaryFolder folder;
  // The window reaches 64 voxels to each side, the margin as many more.
  WindowPair pair(tenthOfAMetre(), {12.8, 6.4, OutsideWindow::kKeep}, folder / "map.sqlite");
  const Cell old{0, 0, 0};
  pair.integrate(updateOf(old), placeOf(pair, {32, 32, 32}));
  const auto is_here = [&] { return pair.map.voxels().at(old) == Occupancy::kOccupied; };
  const auto stay_at = [&](std::int32_t x) {
    const Cell at{x, 32, 32};
    for (std::uint64_t i = 0; i <= WindowConfig::kIdleSteps + MapWindow::kStepsAWrite; ++i) {
      pair.integrate(updateOf(brickOf(at)), placeOf(pair, at));
    }
  };
  stay_at(180);  // The window starts at 116, the margin at 52: the page ends at 64.
  EXPECT_TRUE(is_here());
  stay_at(200);
  EXPECT_FALSE(is_here());
  stay_at(180);  // It is loaded for the window, not for the margin.
  EXPECT_FALSE(is_here());
  EXPECT_EQ(pair.window->countNotLoaded(pageBox(old)), 1U);
  stay_at(120);
  EXPECT_TRUE(is_here());
}

TEST(MapWindow, doesNotLetPagesComeAndGoThatEachCloudTouches) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  ScanUpdate update = updateOf({0, 0, 0});
  update.bricks.push_back(updateOf({640, 0, 0}).bricks.front());
  for (int i = 0; i < 100; ++i) pair.integrate(update, placeOf(pair, {0, 0, 0}));
  EXPECT_EQ(pair.window->figures().num_loads + pair.window->figures().num_writes, 0U);
}

TEST(MapWindow, keepsUpWithADriveThatDiscoversManyPages) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  const auto drive = [&](std::int32_t begin) {  // Eight new pages a cloud.
    for (std::int32_t x = begin; x < begin + 100; ++x) {
      ScanUpdate update;
      for (std::int32_t y = 0; y < 8; ++y) {
        update.bricks.push_back(updateOf({64 * x, 64 * y, 0}).bricks.front());
      }
      pair.integrate(update, placeOf(pair, {64 * x, 0, 0}));
    }
    return pair.window->figures().num_in_memory;
  };
  for (const std::int32_t begin : {0, 100, 200}) EXPECT_LT(drive(begin), 350U);
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
}

TEST(MapWindow, letsNothingLeaveWhileItIsHeld) {
  const TemporaryFolder folder;
  Random random(941);
  WindowPair pair(randomConfig(random), {3.0, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Walk walk(random);
  pair.window->hold(true);
  for (int step = 0; step < 60; ++step) walk.step(pair);
  EXPECT_EQ(pair.window->figures().num_on_disk_only, 0U);
  // Meanwhile it can be saved, some pages at a time.
  int num_turns = 1;
  while (pair.window->saveSome()) ++num_turns;
  EXPECT_GT(num_turns, 3);
  const std::uint64_t num_writes = pair.window->figures().num_writes;
  EXPECT_EQ(num_writes, pair.window->figures().num_in_memory);
  EXPECT_TRUE(pair.window->save());
  EXPECT_EQ(pair.window->figures().num_writes, num_writes);  // Nothing has changed since.
  pair.window->hold(false);
  for (int step = 0; step < 60; ++step) walk.step(pair);
  EXPECT_GT(pair.window->figures().num_on_disk_only, 0U);
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
}

TEST(MapWindow, thatForgetsHasWhatCloudsReach) {
  WindowPair pair(tenthOfAMetre(), {12.8, 0.0, OutsideWindow::kForget}, "");
  const Cell locked{0, 64, 0};
  pair.map.lock(brickBox(locked));
  pair.map.replace(brickBox(locked), std::vector<UniformBox>{{brickBox(locked), 1.0F}});
  const CellBox beside{{8, 64, 0}, {9, 65, 1}};
  pair.replace(beside, {{beside, 1.0F}});
  for (int x = 0; x < 2000; x += 8) {
    const Cell brick{x, 0, 0};
    pair.integrate(updateOf(brick), placeOf(pair, brick));
    if (x < 400) continue;
    EXPECT_EQ(pair.map.voxels().at({x - 64, 0, 0}), Occupancy::kOccupied);
    EXPECT_EQ(pair.map.voxels().at({x - 300, 0, 0}), Occupancy::kUnknown);
  }
  EXPECT_EQ(pair.map.voxels().at(locked), Occupancy::kOccupied);
  EXPECT_GE(pair.window->figures().num_forgotten, 25U);
  EXPECT_LE(pair.window->figures().num_in_memory, 8U);
  EXPECT_FALSE(pair.window->saveSome());  // Nothing to do.
  EXPECT_TRUE(pair.window->save());
}

TEST(MapWindow, refusesAMiddleThatIsNotFinite) {
  WindowPair pair(tenthOfAMetre(), {12.8, 0.0, OutsideWindow::kForget}, "");
  pair.integrate(updateOf({0, 0, 0}), placeOf(pair, {0, 0, 0}));
  const auto voxels = test::voxelsOf(pair.map);
  const CellBox window = pair.window->window();
  for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d center = Eigen::Vector3d::Zero();
      center[axis] = wrong;
      ChangeSet changes;
      EXPECT_THROW((void)pair.window->admit(updateOf({0, 0, 0}), center, changes),
                   std::invalid_argument);
    }
  }
  EXPECT_EQ(pair.window->window(), window);
  EXPECT_EQ(test::voxelsOf(pair.map), voxels);
}

TEST(MapWindow, thatRefusesTakesNothingFromOutside) {
  Random random(951);
  WindowPair pair(randomConfig(random), {8.0, 2.0, OutsideWindow::kRefuse}, "");
  Walk walk(random);
  for (int step = 0; step < 100; ++step) {
    walk.step(pair);
    const CellBox window = pair.window->window();
    // A page belongs to the window if it shares a voxel with it, or with its margin of 20 voxels.
    const Cell edge = Cell{20, 20, 20} + Cell{kPageEdge, kPageEdge, kPageEdge};
    const CellBox limit{window.min - edge, window.max + edge};
    ASSERT_TRUE(pair.map.voxels().size() == 0 || limit.contains(*pair.map.bounds()));
    const CellBox inner{window.min + Cell{40, 40, 40}, window.max - Cell{40, 40, 40}};
    if (inner.isEmpty()) continue;
    for (const auto& [cell, value] : voxelsIn(pair.map, inner)) {
      ASSERT_TRUE(pair.plain.voxels().logOddsAt(cell)) << cell << ' ' << value;
    }
  }
  EXPECT_GT(pair.window->figures().num_refused, 100U);
}

TEST(MapWindow, bringsPagesBackSomeAtATime) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  for (int page = 0; page < 40; ++page) {
    pair.replace(brickBox({64 * page, 0, 0}), {{brickBox({64 * page, 0, 0}), 1.0F}});
  }
  pair.startAgain();
  for (const std::size_t num_left : {24U, 8U, 0U, 0U}) {
    pair.window->load(kAllCells, pair.changes, MapWindow::kPagesAStep);
    EXPECT_EQ(pair.window->countNotLoaded(kAllCells), num_left);
  }
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
}

TEST(MapWindow, encodesABrickOnceWhenItReadsItsPage) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Random random(971);
  for (int i = 0; i < 10; ++i) {
    pair.integrate(test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 200), {0.0, 0.0, 0.0});
  }
  pair.startAgain();
  const std::uint64_t before = PackedVoxels::numEncoded();
  pair.window->load(kAllCells, pair.changes);
  const std::size_t num_bricks = pair.map.voxels().size();
  EXPECT_GT(num_bricks, 500U);
  EXPECT_EQ(PackedVoxels::numEncoded() - before, num_bricks);
}

TEST(MapWindow, needsAStoreToKeepAndNoneElse) {
  const TemporaryFolder folder;
  CuboidMap map;
  const auto make = [&](const WindowConfig& config, bool has_store) {
    MapWindow(config,
              has_store ? openStoreOf(test::headOf(map.config()), folder / "a.sqlite") : nullptr,
              map);
  };
  EXPECT_THROW(make({10.0, 1.0, OutsideWindow::kKeep}, false), std::invalid_argument);
  EXPECT_THROW(make({10.0, 1.0, OutsideWindow::kForget}, true), std::invalid_argument);
  EXPECT_THROW(make({0.0, 1.0, OutsideWindow::kForget}, false), std::invalid_argument);
  EXPECT_THROW(make({10.0, -1.0, OutsideWindow::kForget}, false), std::invalid_argument);
  EXPECT_NO_THROW(make({10.0, 0.0, OutsideWindow::kKeep}, true));
}

}  // namespace
}  // namespace cuboid_mapping
