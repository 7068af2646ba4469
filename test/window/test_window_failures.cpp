// SPDX-License-Identifier: BSD-3-Clause
// A window whose store cannot be written or read.
#include "support/failing_reads.h"
#include "support/full_disk.h"
#include "tools/run_program.h"
#include "window/window_pair.h"

#include <sqlite3.h>

#include <set>

namespace cuboid_mapping {
namespace {

using test::FullDisk;
using test::placeOf;
using test::Random;
using test::randomConfig;
using test::TemporaryFolder;
using test::tenthOfAMetre;
using test::updateOf;
using test::Walk;
using test::WindowPair;

TEST(MapWindow, losesNothingWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  Random random(961);
  WindowPair pair(randomConfig(random), {3.0, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Walk walk(random);
  for (int step = 0; step < 60; ++step) walk.step(pair);
  const std::size_t num_before = pair.window->figures().num_in_memory;
  {
    const FullDisk full;
    for (int step = 0; step < 60; ++step) walk.step(pair);
    EXPECT_FALSE(pair.window->save());
    const WindowFigures figures = pair.window->figures();
    EXPECT_GT(figures.num_failures, 0U);
    EXPECT_LT(figures.num_failures, 10U);  // It does not retry in each step.
    EXPECT_GT(figures.num_in_memory, num_before);
    EXPECT_EQ(figures.last_failure.rfind(pair.file, 0), 0U) << figures.last_failure;
    EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
  }
  for (int step = 0; step < 60; ++step) walk.step(pair);
  pair.startAgain();
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
}

/// Opens the window again on a store in which the page at x = 0 is damaged.
void damageFirstPage(WindowPair& pair) {
  EXPECT_TRUE(pair.window->save());
  pair.window.reset();
  pair.map.clear();
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(pair.file.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "UPDATE pages SET content = x'0102' WHERE x = 0", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  pair.open();
}

TEST(MapWindow, tellsWhatHasComeWhenAPageCannotBeRead) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  for (int page = 0; page < 40; ++page) {
    pair.integrate(updateOf({64 * page, 0, 0}), placeOf(pair, {64 * page, 0, 0}));
  }
  damageFirstPage(pair);
  pair.changes = {};
  EXPECT_THROW(pair.window->load(kAllCells, pair.changes), MapFileError);
  EXPECT_GT(pair.map.voxels().size(), 0U) << "else nothing can be lost";
  std::set<Cell> told;
  for (const ChangedBrick& changed : pair.changes.bricks) told.insert(changed.brick);
  EXPECT_EQ(told.size(), pair.map.voxels().size());
  pair.map.voxels().forEach(
      [&](const VoxelBrick& brick) { EXPECT_EQ(told.count(brick.brick), 1U) << brick.brick; });
  EXPECT_EQ(pair.changes.revision, pair.map.revision());
}

TEST(MapWindow, takesNothingInAPageThatCannotBeRead) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  const Cell bad{0, 0, 0};
  const Cell good{640, 0, 0};
  for (const Cell& brick : {bad, good}) pair.integrate(updateOf(brick), placeOf(pair, brick));
  damageFirstPage(pair);
  for (int i = 0; i < 3; ++i) {
    for (const Cell& brick : {bad, good}) {
      pair.integrate(updateOf(brick), placeOf(pair, {320, 0, 0}));
    }
  }
  EXPECT_EQ(pair.map.voxels().at(good), Occupancy::kOccupied);
  EXPECT_EQ(pair.map.voxels().at(bad), Occupancy::kUnknown);
  EXPECT_EQ(pair.window->countNotLoaded(pageBox(bad)), 1U);  // It does not count as unknown.
  const WindowFigures figures = pair.window->figures();
  EXPECT_EQ(figures.num_unreadable, 3U);
  EXPECT_EQ(figures.num_failures, 1U);
  EXPECT_NE(figures.last_failure.find("page (0 0 0)"), std::string::npos) << figures.last_failure;
  EXPECT_THROW(pair.window->load(pageBox(bad), pair.changes), MapFileError);
  EXPECT_THROW((void)pair.voxels(), MapFileError);
}

TEST(MapWindow, takesObservationsAgainInAPageThatCouldNotBeReadForAWhile) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Random random(972);
  const auto see = [&] {
    pair.integrate(test::randomUpdate(random, {{1, 1, 1}, {7, 7, 7}}, 300), {3.0, 3.0, 3.0});
  };
  for (int i = 0; i < 10; ++i) see();
  pair.startAgain();
  {
    const test::FailingReads gone;
    see();
  }
  const WindowFigures figures = pair.window->figures();
  EXPECT_EQ(figures.num_failures, 1U) << figures.last_failure;
  EXPECT_GT(figures.num_unreadable, 0U);
  for (int i = 0; i < 30; ++i) see();
  EXPECT_EQ(pair.window->countNotLoaded(kAllCells), 0U);
  const std::uint64_t num_unreadable = pair.window->figures().num_unreadable;
  see();
  EXPECT_EQ(pair.window->figures().num_unreadable, num_unreadable);
}

TEST(MapWindow, prefetchesAPageThatCouldNotBeReadForAWhile) {
  const TemporaryFolder folder;
  WindowPair pair(tenthOfAMetre(), {6.4, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  const Cell near{0, 0, 0};
  const Cell far{640, 0, 0};
  pair.integrate(updateOf(near), placeOf(pair, near));
  pair.startAgain();
  const auto see_far = [&] { pair.integrate(updateOf(far), placeOf(pair, near)); };
  {
    const test::FailingReads gone;
    see_far();
  }
  EXPECT_EQ(pair.window->figures().num_failures, 1U);
  EXPECT_EQ(pair.window->countNotLoaded(pageBox(near)), 1U);
  for (int i = 0; i < 30; ++i) see_far();  // The window stays where it is.
  EXPECT_EQ(pair.window->countNotLoaded(pageBox(near)), 0U);
}

TEST(MapWindow, hasAMapThatWasReplacedInItsStore) {
  const TemporaryFolder folder;
  Random random(971);
  WindowPair pair(randomConfig(random), {3.0, 0.0, OutsideWindow::kKeep}, folder / "map.sqlite");
  Walk walk(random);
  for (int step = 0; step < 60; ++step) walk.step(pair);
  ASSERT_GT(pair.window->figures().num_on_disk_only, 0U);
  // While writing fails, existing pages are not loaded, either.
  {
    const FullDisk full;
    pair.clear();
    for (int step = 0; step < 30; ++step) walk.step(pair);
    EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
  }
  for (int step = 0; step < 60; ++step) walk.step(pair);
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
  pair.startAgain();
  EXPECT_EQ(pair.voxels(), test::voxelsOf(pair.plain));
  pair.clear();
  pair.startAgain();
  EXPECT_TRUE(pair.voxels().empty());
}

}  // namespace
}  // namespace cuboid_mapping
