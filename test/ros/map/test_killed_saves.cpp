// SPDX-License-Identifier: BSD-3-Clause
// Saves of a process that may be killed at any moment.
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "ros/random_guarded_map.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::TemporaryFolder;
using test::fill;
using test::makeConfig;
using test::voxelsOf;

/// Runs endless work in a process, and kills the process. @return Whether it still ran.
template <typename WorkT>
bool killAfter(int time_us, const WorkT& work) {
  const pid_t child = fork();
  if (child == 0) work();
  usleep(static_cast<useconds_t>(time_us));
  kill(child, SIGKILL);
  int state = 0;
  return waitpid(child, &state, 0) == child && WIFSIGNALED(state);
}

/// Maximum time in microseconds after which a process that repeats some work is killed.
template <typename WorkT>
int findKillWindow(const WorkT& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::micro> time_us =
      std::chrono::steady_clock::now() - start;
  return std::max(8000, static_cast<int>(4 * time_us.count()));
}

/// A merging node continues with its store, or starts with none if it was killed while it created it.
TEST(MapStorage, startsFromAStoreThatWasMadeWhenItsNodeWasKilled) {
  const TemporaryFolder folder;
  Random random(98);
  GuardedMap map(makeConfig());
  fill(map, random);
  const auto voxels = voxelsOf(map);
  NodeParameters parameters;
  parameters.map = makeConfig();
  parameters.robots = {"/robot1"};
  int window_us =
      findKillWindow([&] { ASSERT_EQ(saveMap(map, "map", folder / "first.sqlite").error, ""); });
  int num_made = 0;
  for (int kills = 0; kills < 60; ++kills) {
    parameters.autosave_file = folder / ("site" + std::to_string(kills) + ".sqlite");
    // First too soon, finally late enough.
    ASSERT_TRUE(killAfter(window_us / 60 * kills, [&] {
      (void)saveMap(map, "map", parameters.autosave_file);
      for (;;) pause();
    }));
    const auto found = readStartMap(findStartMap(parameters), parameters);
    num_made += found ? 1 : 0;
    if (kills % 20 == 19 && num_made == 0) window_us *= 2;  // The machine is busy.
    if (found) {
      ASSERT_EQ(cuboid_mapping::test::voxelsOf(found->bricks), voxels);
    }
  }
  EXPECT_GT(num_made, 0);
  EXPECT_LT(num_made, 60);
  parameters.autosave_file = folder / "tables.sqlite";
  cuboid_mapping::MapStore(parameters.autosave_file, cuboid_mapping::StoreAccess::kWrite);
  EXPECT_FALSE(readStartMap(findStartMap(parameters), parameters)) << "a store with tables only";
}

/// Kills a process that saves again and again, 200 times at any moment of its first saves: the file is always whole.
TEST(MapStorage, leavesAWholeFileWhateverKillsIt) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  Random random(97);
  GuardedMap map(makeConfig());
  fill(map, random);
  int window_us = findKillWindow([&] { ASSERT_EQ(saveMap(map, "map", file).error, ""); });
  GuardedMap other(makeConfig());
  fill(other, random);
  const auto first = voxelsOf(map);
  const auto second = voxelsOf(other);
  ASSERT_NE(first, second);
  int num_first = 0;
  for (int kills = 0; kills < 200; ++kills) {
    ASSERT_TRUE(killAfter(random.integer(0, window_us), [&] {
      for (;;) {
        (void)saveMap(other, "map", file);
        (void)saveMap(map, "map", file);
      }
    }));
    const auto found =
        cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(file).snapshot.bricks);
    ASSERT_TRUE(found == first || found == second)
        << cuboid_mapping::test::seedNote(static_cast<std::size_t>(kills));
    num_first += found == first ? 1 : 0;
    if (kills % 20 == 19 && num_first == kills + 1) window_us *= 2;  // The machine is busy.
  }
  EXPECT_GT(num_first, 0);
  EXPECT_LT(num_first, 200) << "some kills came after a save";
}

}  // namespace
}  // namespace cuboid_mapping_ros
