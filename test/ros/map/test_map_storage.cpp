// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/map_storage.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "ros/known_parameters.h"
#include "ros/random_guarded_map.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <future>
#include <map>
#include <thread>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::TemporaryFolder;
using test::fill;
using test::makeConfig;
using test::voxelsOf;

TEST(MapStorage, savesWhatTheLastCloudHasLeftAndLoadsIt) {
  const TemporaryFolder folder;
  Random random(95);
  for (const std::string name : {"map.cuboids", "map.ot"}) {
    GuardedMap map(makeConfig());
    fill(map, random);
    const StorageAnswer saved = saveMap(map, "/odom", folder / name);
    EXPECT_EQ(saved.error, "");
    EXPECT_GT(saved.num_cuboids, 100U);
    EXPECT_EQ(saved.num_bytes, std::filesystem::file_size(folder / name));
    GuardedMap other(makeConfig());
    fill(other, random);
    (void)other.takeChanges();
    const auto load_into = [&](const char* frame_id) {
      return loadMap(other, folder / name, {}, {std::nullopt, std::nullopt, frame_id});
    };
    const StorageAnswer loaded = load_into("/odom");
    EXPECT_EQ(loaded.error, "");
    EXPECT_EQ(loaded.notes, "");
    const bool has_frame = name == "map.cuboids";
    EXPECT_EQ(load_into("map").notes.find("the file has a map in 'odom'") == 0, has_frame) << name;
    EXPECT_EQ(voxelsOf(other), voxelsOf(map)) << name;
    EXPECT_TRUE(other.takeChanges().is_everything);
  }
  EXPECT_EQ(cuboid_mapping::readMapFile(folder / "map.cuboids").snapshot.frame_id, "odom");
}

TEST(MapStorage, keepsLocksWhenAMapIsLoaded) {
  const TemporaryFolder folder;
  Random random(98);
  GuardedMap map(makeConfig());
  fill(map, random);
  ASSERT_EQ(saveMap(map, "map", folder / "map.cuboids").error, "");
  const cuboid_mapping::CellBox zone{{0, 0, 0}, {9, 9, 9}};
  map.edit([&](CuboidMap& content, const ros::Time&) {
    content.lock(zone);
    return cuboid_mapping::ChangeSet{content.revision(), false, {}};
  });
  ASSERT_EQ(loadMap(map, folder / "map.cuboids").error, "");
  map.read([&](const CuboidMap& content, const ros::Time&) {
    EXPECT_EQ(content.lockedBoxes(), std::vector<cuboid_mapping::CellBox>{zone});
  });
}

TEST(MapStorage, putsAMapIntoAnotherOneByRuleAndTransform) {
  const TemporaryFolder folder;
  Random random(100);
  GuardedMap map(makeConfig());
  fill(map, random);
  GuardedMap other(makeConfig());
  fill(other, random);
  ASSERT_EQ(saveMap(other, "map", folder / "other.cuboids").error, "");
  MapSnapshot expected = map.read(
      [](const CuboidMap& content, const ros::Time&) { return takeSnapshot(content, ""); });
  MapSnapshot moved = cuboid_mapping::readMapFile(folder / "other.cuboids").snapshot;
  Eigen::Isometry3d T_map_file(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  T_map_file.translation() = Eigen::Vector3d(0.3, 0.0, -0.1);
  ASSERT_TRUE(moveMap(T_map_file, moved));
  const auto rule = cuboid_mapping::MergeRule::kSum;
  const auto overlap = mergeMaps(expected, moved, rule);
  EXPECT_GT(overlap.known_to_both, 10.0);
  const cuboid_mapping::CellBox zone{{0, 0, 0}, {9, 9, 9}};
  map.edit([&](CuboidMap& content, const ros::Time&) {
    content.lock(zone);
    return cuboid_mapping::ChangeSet{content.revision(), false, {}};
  });
  const StorageAnswer answer = loadMap(map, folder / "other.cuboids", {}, {rule, T_map_file, ""});
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.notes, "moved by whole voxels: exact. " + describe(overlap, rule));
  EXPECT_EQ(voxelsOf(map), cuboid_mapping::test::voxelsOf(expected.bricks));
  map.read([&](const CuboidMap& content, const ros::Time&) {
    EXPECT_EQ(content.lockedBoxes(), std::vector<cuboid_mapping::CellBox>{zone});
  });
  EXPECT_EQ(loadMap(map, folder / "other.cuboids", {}, {std::nullopt, T_map_file, ""}).error, "");
  EXPECT_EQ(voxelsOf(map), cuboid_mapping::test::voxelsOf(moved.bricks)) << "in the place of all";
  T_map_file.linear() *= 2.0;
  EXPECT_NE(loadMap(map, folder / "other.cuboids", {}, {rule, T_map_file, ""}).error, "");
  EXPECT_EQ(voxelsOf(map), cuboid_mapping::test::voxelsOf(moved.bricks));
}

TEST(MapStorage, mergesAMapInPartsBetweenWhichOthersChangeIt) {
  const TemporaryFolder folder;
  GuardedMap other(makeConfig());
  other.edit([](CuboidMap& content) {
    return content.replace(cuboid_mapping::kAllCells, {{{{0, 0, 0}, {1000, 1000, 1}}, 1.0F}});
  });
  ASSERT_EQ(saveMap(other, "map", folder / "other.cuboids").error, "");
  GuardedMap map(makeConfig());
  const StorageAnswer answer = loadMap(map, folder / "other.cuboids", {},
                                       {cuboid_mapping::MergeRule::kSum, std::nullopt, ""});
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.num_cuboids, 125U * 125U);
  map.read([&](const CuboidMap& content) {
    EXPECT_EQ(content.voxels().numOccupiedVoxels(), 1e6);
    EXPECT_GT(content.revision(), 50U);
    return 0;
  });
}

Eigen::Isometry3d makeQuarterTurn(const Eigen::Vector3d& shift_m) {
  Eigen::Isometry3d turn(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  turn.translation() = shift_m;
  return turn;
}

TEST(MapStorage, movesAWholeMapWithItsLocks) {
  Random random(101);
  for (const auto fusion :
       {cuboid_mapping::FusionKind::kClass, cuboid_mapping::FusionKind::kGrowth}) {
    MapConfig config = makeConfig();
    config.fusion = fusion;
    GuardedMap map(config);
    fill(map, random);
    map.edit([&](CuboidMap& content, const ros::Time&) {
      content.lock({{0, 0, 0}, {9, 5, 2}});
      content.lock({{-100, 0, 0}, {-99, 1, 1}});
      return cuboid_mapping::ChangeSet{content.revision(), false, {}};
    });
    const auto before = voxelsOf(map);
    (void)map.takeChanges();
    const auto motion = cuboid_mapping::VoxelMotion::of(makeQuarterTurn({0.3, 0.0, -0.1}), 0.1);
    const StorageAnswer answer = moveWholeMap(map, *motion);
    EXPECT_EQ(answer.error, "");
    std::map<cuboid_mapping::Cell, float> expected;
    for (const auto& [cell, value] : before) expected[{2 - cell.y, cell.x, cell.z - 1}] = value;
    EXPECT_EQ(voxelsOf(map), expected);
    EXPECT_TRUE(map.takeChanges().is_everything) << "so that all who follow get all";
    map.read([&](const CuboidMap& content, const ros::Time& stamp) {
      const std::vector<cuboid_mapping::CellBox> locked{{{2, -100, -1}, {3, -99, 0}},
                                                        {{-2, 0, -1}, {3, 9, 1}}};
      EXPECT_EQ(content.lockedBoxes(), locked);
      EXPECT_EQ(stamp, ros::Time(3.0));
      EXPECT_EQ(answer.num_cuboids, countCuboids(content).total());
    });
  }
}

TEST(MapStorage, movesNoMapBeyondItsLimits) {
  Random random(102);
  GuardedMap map(makeConfig());
  fill(map, random);
  const auto before = voxelsOf(map);
  const Eigen::Isometry3d far(Eigen::Translation3d(0.0, 0.1 * 2147483000.0, 0.0));
  EXPECT_NE(moveWholeMap(map, *cuboid_mapping::VoxelMotion::of(far, 0.1)).error.find("beyond"),
            std::string::npos);
  EXPECT_EQ(voxelsOf(map), before);
}

/// A slow save: clouds arrive while pages are read, and while the file is written.
TEST(MapStorage, savesAMapWithAWindowWhileCloudsGoOn) {
  const TemporaryFolder folder;
  NodeParameters parameters;
  parameters.map = makeConfig();
  parameters.window.frame_id = "base";
  parameters.window.config.size_m = 10.0;
  parameters.window.config.margin_m = 1.0;
  parameters.window.file = folder / "map.sqlite";
  GuardedMap map(parameters.map);
  map.setWindow([&](CuboidMap& content) { return makeWindow(parameters, content); });
  Random random(104);
  std::int32_t place = 0;
  const auto integrate = [&] {
    ++place;
    auto update = cuboid_mapping::test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 9);
    for (auto& brick : update.bricks) brick.brick.x += 16 * place;
    map.integrate(ros::Time(place), update, cuboid_mapping::SensorModel(), {1.6 * place, 0.0, 0.0});
  };
  for (int i = 0; i < 100; ++i) integrate();
  ASSERT_GT(map.windowFigures()->num_on_disk_only, 5U);
  ASSERT_EQ(saveMap(map, "map", folder / "before.cuboids").error, "");
  int num_clouds = 0;
  std::future<void> cloud;
  const auto listener = [&](std::uint64_t /*done*/, std::uint64_t /*total*/) {
    cloud = std::async(std::launch::async, integrate);
    if (cloud.wait_for(std::chrono::seconds(20)) != std::future_status::ready) {
      throw std::runtime_error("the save keeps a cloud waiting");
    }
    ++num_clouds;
  };
  EXPECT_EQ(saveMap(map, "map", folder / "meanwhile.cuboids", {}, listener).error, "");
  EXPECT_GT(num_clouds, 7) << "at each page that it reads, and as it writes";
  EXPECT_EQ(cuboid_mapping::readFile(folder / "meanwhile.cuboids"),
            cuboid_mapping::readFile(folder / "before.cuboids"))
      << "the map as it was when the save began";
  ASSERT_EQ(saveMap(map, "map", folder / "after.cuboids").error, "");
  EXPECT_GT(std::filesystem::file_size(folder / "after.cuboids"),
            std::filesystem::file_size(folder / "before.cuboids"));
}

/// Another thread edits all the time: none of its edits is lost.
TEST(MapStorage, movesNoMapThatIsChangedMeanwhile) {
  Random random(103);
  GuardedMap map(makeConfig());
  fill(map, random);
  const auto nowhere = cuboid_mapping::VoxelMotion::of(Eigen::Isometry3d::Identity(), 0.1);
  const cuboid_mapping::CellBox voxel{{77, 0, 0}, {78, 1, 1}};
  std::atomic<bool> is_done{false};
  std::thread editor([&] {
    for (int i = 1; !is_done; ++i) {
      const auto value = static_cast<float>(i % 100 + 1);
      map.edit([&](CuboidMap& content, const ros::Time&) {
        return content.replace(voxel, std::vector<cuboid_mapping::UniformBox>{{voxel, value}});
      });
      const float found = map.read([&](const CuboidMap& content, const ros::Time&) {
        return content.voxels().logOddsAt(voxel.min).value_or(0.0F);
      });
      EXPECT_EQ(found, value) << i;
    }
  });
  std::string error;
  for (int i = 0; i < 10000 && error.empty(); ++i) error = moveWholeMap(map, *nowhere).error;
  is_done = true;
  editor.join();
  EXPECT_NE(error.find("call again"), std::string::npos) << error;
}

TEST(MapStorage, saysWhichTransformWouldBeExact) {
  const auto advice = [](const Eigen::Isometry3d& transform) {
    return describeRefusal(transform, 0.1);
  };
  const std::string shifted = advice(makeQuarterTurn({0.32, -0.07, 5.0}));
  EXPECT_NE(shifted.find("translation (0.3, -0.1, 5)"), std::string::npos) << shifted;
  const std::string turned =
      advice(Eigen::Isometry3d(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())));
  EXPECT_EQ(turned.find("nearest"), std::string::npos) << turned;
  for (const std::string& text : {shifted, turned}) {
    EXPECT_NE(text.find("~load_map"), std::string::npos);
    EXPECT_NE(text.find("multiples of 0.1 m"), std::string::npos);
  }
}

TEST(MapStorage, namesTheLimitOfALargerFile) {
  const TemporaryFolder folder;
  Random random(99);
  GuardedMap map(makeConfig());
  fill(map, random);
  ASSERT_EQ(saveMap(map, "map", folder / "map.cuboids").error, "");
  cuboid_mapping::SnapshotLimits limits;
  limits.max_bricks = 2;
  const auto before = voxelsOf(map);
  EXPECT_NE(loadMap(map, folder / "map.cuboids", limits).error.find("the memory of this machine"),
            std::string::npos);
  EXPECT_EQ(voxelsOf(map), before);
}

TEST(MapStorage, leavesTheMapAsItWasWhenAFileIsBad) {
  const TemporaryFolder folder;
  Random random(96);
  GuardedMap map(makeConfig());
  fill(map, random);
  const auto before = voxelsOf(map);
  ASSERT_EQ(saveMap(map, "map", folder / "good.cuboids").error, "");
  const std::string good = cuboid_mapping::readFile(folder / "good.cuboids");
  std::string newer = good;
  newer[8] = 99;
  std::string damaged = good;
  damaged[good.size() / 2] ^= 1;
  const std::string whole("# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n\0\0\0\0\0",
                          57);
  const std::vector<std::pair<std::string, std::string>> files{
      {"poem", "is not a map"},   {good.substr(0, good.size() - 5), "ends too early"},
      {newer, "newer"},           {damaged, "damaged"},
      {whole, "bricks of 8 x 8"}, {"", "is empty"}};
  for (const auto& [bytes, reason] : files) {
    const std::string file = folder / "bad";
    cuboid_mapping::replaceFile(file, bytes);
    const StorageAnswer answer = loadMap(map, file);
    const std::string text = reason == "newer" ? "update cuboid_mapping" : reason;
    EXPECT_NE(answer.error.find(text), std::string::npos) << answer.error;
    EXPECT_EQ(answer.error.find(file), 0U) << answer.error;
    EXPECT_EQ(voxelsOf(map), before);
  }
  EXPECT_NE(loadMap(map, folder / "none").error.find("No such file"), std::string::npos);
  EXPECT_NE(loadMap(map, folder / ".").error.find("Is a directory"), std::string::npos);
  MapSnapshot coarse;
  coarse.resolution_m = 0.2;
  writeMapFile(folder / "coarse.cuboids", coarse);
  EXPECT_NE(loadMap(map, folder / "coarse.cuboids").error.find("resolution 0.2"),
            std::string::npos);
  EXPECT_EQ(voxelsOf(map), before);
}

TEST(MapStorage, saysWhyItCannotSave) {
  const TemporaryFolder folder;
  GuardedMap map(makeConfig());
  EXPECT_NE(saveMap(map, "map", folder / "no/map.ot").error.find("No such file"),
            std::string::npos);
  EXPECT_NE(saveMap(map, "map", folder / "map").error.find(".cuboids"), std::string::npos);
  EXPECT_NE(saveMap(map, "map", "/proc/map.bt").error, "");
  EXPECT_NE(saveMap(map, "map", "").error, "");
  std::filesystem::create_directory(folder / "x.cuboids");
  EXPECT_NE(saveMap(map, "map", folder / "x.cuboids").error.find("Is a directory"),
            std::string::npos);
}

TEST(MapStorage, startsFromAFileWithItsResolution) {
  const TemporaryFolder folder;
  NodeParameters parameters;
  EXPECT_FALSE(readStartMap(findStartMap(parameters), parameters));
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.25;
  snapshot.bricks = cuboid_mapping::toBricks({{{{0, 0, 0}, {2, 2, 2}}, 1.0F}}).bricks;
  writeMapFile(folder / "start.bt", snapshot);
  parameters.map_file = folder / "start.bt";
  const auto start = readStartMap(findStartMap(parameters), parameters);
  ASSERT_TRUE(start);
  EXPECT_EQ(parameters.map.resolution_m, 0.25);
  EXPECT_EQ(start->bricks.size(), 1U);
  parameters.map_file = folder / "none.bt";
  EXPECT_THROW((void)readStartMap(findStartMap(parameters), parameters),
               cuboid_mapping::MapFileError);
}

TEST(MapStorage, startsWithTheLastSaveAndOtherwiseWithMapFile) {
  const TemporaryFolder folder;
  NodeParameters parameters;
  parameters.map = makeConfig();
  parameters.autosave_file = folder / "map.cuboids";
  EXPECT_FALSE(readStartMap(findStartMap(parameters), parameters)) << "the first run";
  Random random(101);
  GuardedMap first(makeConfig());
  fill(first, random);
  parameters.map_file = folder / "first.cuboids";
  ASSERT_EQ(saveMap(first, "map", parameters.map_file).error, "");
  const auto start = readStartMap(findStartMap(parameters), parameters);
  ASSERT_TRUE(start);
  EXPECT_EQ(cuboid_mapping::test::voxelsOf(start->bricks), voxelsOf(first));
  EXPECT_FALSE(parameters.autosave_version);
  GuardedMap later(makeConfig());
  fill(later, random);
  ASSERT_EQ(saveMap(later, "map", parameters.autosave_file).error, "");
  const auto found = readStartMap(findStartMap(parameters), parameters);
  ASSERT_TRUE(found);
  EXPECT_EQ(cuboid_mapping::test::voxelsOf(found->bricks), voxelsOf(later))
      << "a node that is started again and again goes on";
  EXPECT_EQ(parameters.autosave_version, cuboid_mapping::versionOf(parameters.autosave_file));
  std::ofstream(parameters.autosave_file) << "no map";
  EXPECT_THROW((void)readStartMap(findStartMap(parameters), parameters),
               cuboid_mapping::MapFileError);
}

TEST(MapStorage, looksForAMapWithoutAChangeOfItsFile) {
  const TemporaryFolder folder;
  Random random(102);
  GuardedMap map(makeConfig());
  fill(map, random);
  for (const char* name : {"map.cuboids", "map.sqlite"}) {
    ASSERT_EQ(saveMap(map, "map", folder / name).error, "");
    const auto version = cuboid_mapping::versionOf(folder / name);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // Beyond the tick of the clock.
    EXPECT_TRUE(hasMap(folder / name));
    EXPECT_EQ(cuboid_mapping::versionOf(folder / name), version) << name;
  }
}

TEST(MapStorage, autosavesOnlyToAFileFromWhichItStarts) {
  if (!test::hasParameters({"window/frame", "merge/robots", "autosave_file"})) GTEST_SKIP();
  const auto errors_of = [](const std::string& file, const std::string& window,
                            const std::string& robots) {
    XmlRpc::XmlRpcValue group;
    group["autosave_file"] = file;
    group["window"]["frame"] = window;
    group["window"]["file"] = window.empty() ? "" : "window.sqlite";
    group["merge"]["robots"] = robots;
    std::string text;
    for (const ParameterError& error : readParameters(group).errors) {
      text += error.key + ' ' + error.message;
    }
    return text;
  };
  EXPECT_EQ(errors_of("map.cuboids", "", ""), "");
  EXPECT_EQ(errors_of("map.sqlite", "base", ""),
            "autosave_file does not go with window/outside: keep, which saves to window/file: "
            "remove it; ~save_map or map_convert makes a copy");
  EXPECT_EQ(errors_of("map.sqlite", "", "/robot1"), "");
  EXPECT_EQ(errors_of("map.cuboids", "", "/robot1"),
            "autosave_file must end in .sqlite with merge/robots: such a file also keeps which "
            "observations are merged");
}

}  // namespace
}  // namespace cuboid_mapping_ros
