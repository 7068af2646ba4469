// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_files.h"

#include "cuboid_mapping/geometry/page.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/as_nobody.h"
#include "support/full_disk.h"
#include "support/map_cuboids.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::TemporaryFolder;

MapSnapshot makeSnapshot() {
  Random random(61);
  MapSnapshot snapshot = test::randomSnapshot(random);
  snapshot.resolution_m = 0.125;
  return snapshot;
}

std::map<Cell, float> occupiedVoxels(const MapSnapshot& snapshot) {
  std::map<Cell, float> voxels = test::voxelsOf(snapshot.bricks);
  for (auto voxel = voxels.begin(); voxel != voxels.end();) {
    voxel = voxel->second < 0.0F ? voxels.erase(voxel) : std::next(voxel);
  }
  return voxels;
}

TEST(MapFiles, areReadBackByTheirBytes) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  for (const std::string ending : {".cuboids", ".sqlite", ".ot", ".OT"}) {
    const std::string file = folder / ("map" + ending);
    const std::size_t num_bytes = writeMapFile(file, snapshot);
    const std::string renamed = folder / "renamed";
    replaceFile(renamed, readFile(file));
    const MapFile read = readMapFile(renamed);
    EXPECT_EQ(read.format, *formatOfName(file));
    EXPECT_EQ(read.num_bytes, num_bytes);
    EXPECT_EQ(test::voxelsOf(read.snapshot.bricks), test::voxelsOf(snapshot.bricks)) << ending;
  }
  writeMapFile(folder / "map.bt", snapshot);
  const MapFile read = readMapFile(folder / "map.bt");
  EXPECT_EQ(read.format, MapFormat::kOctomapBinary);
  EXPECT_EQ(occupiedVoxels(read.snapshot).size(), occupiedVoxels(snapshot).size());
}

TEST(MapFiles, areMapsAgainAndNeverRescaled) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  CuboidMap map(config);
  restoreSnapshot(snapshot, map);
  const std::string file = folder / "map.cuboids";
  EXPECT_GT(saveMap(map, file, "odom"), 0U);
  EXPECT_EQ(readMapFile(file).snapshot.frame_id, "odom");
  const CuboidMap loaded = loadMap(file);
  EXPECT_EQ(loaded.grid().resolution(), snapshot.resolution_m);
  EXPECT_TRUE(loaded.config().sensor_model == snapshot.sensor_model);
  EXPECT_EQ(test::voxelsOf(takeSnapshot(loaded, "").bricks), test::voxelsOf(snapshot.bricks));
  CuboidMap same(config);
  EXPECT_TRUE(loadMap(file, same).is_everything);
  EXPECT_EQ(test::voxelsOf(takeSnapshot(same, "").bricks), test::voxelsOf(snapshot.bricks));
  CuboidMap other;
  try {
    loadMap(file, other);
    ADD_FAILURE() << "a file of 0.125 m in a map of 0.05 m";
  } catch (const MapFileError& error) {
    EXPECT_NE(std::string(error.what()).find("0.125 m, and the map of 0.05 m"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(other.revision(), 0U);
  EXPECT_THROW((void)loadMap(folder / "none.cuboids"), MapFileError);
}

TEST(MapFiles, ofTheNativeFormatAreSmallerThanOctomapsFullOnes) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  EXPECT_LT(writeMapFile(folder / "map.cuboids", snapshot),
            writeMapFile(folder / "map.ot", snapshot));
}

template <typename CloudT>
void expectOccupiedCenters(const CloudT& points, const MapSnapshot& snapshot) {
  std::map<Cell, float> expected = occupiedVoxels(snapshot);
  EXPECT_EQ(points.size(), expected.size());
  const Grid grid(snapshot.resolution_m);
  for (const auto& point : points) {
    const auto cell = grid.toCell(Eigen::Vector3d(point.x, point.y, point.z));
    ASSERT_TRUE(cell);
    ASSERT_EQ(expected.count(*cell), 1U) << *cell;
    EXPECT_NEAR(point.intensity, toProbability(expected[*cell]), 1e-6);
    EXPECT_LT(
        (grid.centerOf(CellBox::ofCell(*cell)) - Eigen::Vector3d(point.x, point.y, point.z)).norm(),
        1e-5);
  }
}

TEST(MapFiles, ofPointsHoldTheOccupiedVoxels) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  ASSERT_GT(occupiedVoxels(snapshot).size(), 100U);
  writeMapFile(folder / "map.pcd", snapshot);
  writeMapFile(folder / "map.ply", snapshot);
  pcl::PointCloud<pcl::PointXYZI> points;
  ASSERT_EQ(pcl::io::loadPCDFile(folder / "map.pcd", points), 0);
  expectOccupiedCenters(points, snapshot);
  points.clear();
  ASSERT_EQ(pcl::io::loadPLYFile(folder / "map.ply", points), 0);
  expectOccupiedCenters(points, snapshot);
  MapSnapshot empty;
  EXPECT_GT(writeMapFile(folder / "empty.pcd", empty), 0U);
  EXPECT_GT(writeMapFile(folder / "empty.ply", empty), 0U);
}

/// The x coordinates of a file of points, which are float64.
std::vector<double> readX(const pcl::PCLPointCloud2& cloud) {
  EXPECT_EQ(cloud.fields.at(0).name, "x");
  EXPECT_EQ(cloud.fields.at(0).datatype, pcl::PCLPointField::FLOAT64);
  std::vector<double> x(cloud.width * cloud.height);
  for (std::size_t i = 0; i < x.size(); ++i) {
    std::memcpy(&x[i], &cloud.data[i * cloud.point_step + cloud.fields[0].offset], sizeof(x[i]));
  }
  return x;
}

TEST(MapFiles, ofPointsTellVoxelsApartFarFromTheOrigin) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.1;
  constexpr std::int32_t kUtm = 53000000;  // 5,300 km
  snapshot.bricks = {{brickOf({kUtm, kUtm, 0}), PackedVoxels(BrickMask::all(), 1.0F)}};
  writeMapFile(folder / "map.pcd", snapshot);
  writeMapFile(folder / "map.ply", snapshot);
  std::vector<double> expected;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    expected.push_back((cellAt(snapshot.bricks[0].brick, voxel).x + 0.5) * 0.1);
  }
  pcl::PCLPointCloud2 points;
  ASSERT_EQ(pcl::PCDReader().read(folder / "map.pcd", points), 0);
  const std::vector<double> of_pcd = readX(points);
  ASSERT_EQ(pcl::PLYReader().read(folder / "map.ply", points), 0);
  const std::vector<double> of_ply = readX(points);
  ASSERT_EQ(of_pcd.size(), expected.size());
  ASSERT_EQ(of_ply.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(of_pcd[i], expected[i], 1e-6);
    EXPECT_NEAR(of_ply[i], expected[i], 1e-6);
  }
}

TEST(MapFiles, ofTextHaveALineForEachCuboidWithItsMeanProbability) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.5;
  snapshot.bricks = toBricks({{{{2, 0, 0}, {3, 1, 1}}, 0.0F},
                              {{{-4, 0, 0}, {0, 1, 2}}, toLogOdds(0.25)},
                              {{{0, 0, 0}, {1, 1, 2}}, toLogOdds(0.1)},
                              {{{1, 0, 0}, {2, 1, 2}}, toLogOdds(0.3)}})
                        .bricks;
  writeMapFile(folder / "map.csv", snapshot);
  EXPECT_EQ(readFile(folder / "map.csv"),
            "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n"
            "-2,0,0,0,0.5,1,0.25,free\n"
            "1,0,0,1.5,0.5,0.5,0.5,occupied\n"
            "0,0,0,1,0.5,1,0.2,free\n");
}

/// The cuboids of a .csv, in the order of their least cells.
std::vector<Cuboid> readCsv(const std::string& file, double resolution_m) {
  std::istringstream lines(readFile(file));
  std::string line;
  std::getline(lines, line);
  std::vector<Cuboid> cuboids;
  while (std::getline(lines, line)) {
    const bool is_occupied = line.find("occupied") != std::string::npos;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    Cuboid cuboid{{}, is_occupied ? Occupancy::kOccupied : Occupancy::kFree};
    for (Cell* corner : {&cuboid.box.min, &cuboid.box.max}) {
      for (int axis = 0; axis < 3; ++axis) {
        double coordinate_m = 0.0;
        numbers >> coordinate_m;
        (*corner)[axis] = static_cast<std::int32_t>(std::lround(coordinate_m / resolution_m));
      }
    }
    cuboids.push_back(cuboid);
  }
  std::sort(cuboids.begin(), cuboids.end(),
            [](const Cuboid& a, const Cuboid& b) { return a.box.min < b.box.min; });
  return cuboids;
}

TEST(MapFiles, ofTextHaveTheCuboidsOfTheMapWhateverItsFusion) {
  const TemporaryFolder folder;
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    SCOPED_TRACE(toString(fusion));
    Random random(62);
    MapConfig config;
    config.resolution_m = 0.25;
    config.fusion = fusion;
    const CuboidMap map = std::move(test::randomMap(random, config).map);
    const std::vector<Cuboid> expected = test::allCuboids(map);
    ASSERT_GT(expected.size(), 1000U);
    saveMap(map, folder / "map.csv");
    EXPECT_EQ(readCsv(folder / "map.csv", 0.25), expected);
  }
}

TEST(MapFiles, ofTextDivideTheBricksWhoseCuboidsAreNotTold) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;  // As with a window: a grown cuboid in memory, a brick on disk.
  snapshot.resolution_m = 1.0;
  const CellBox grown{{4, 0, 0}, {12, 1, 1}};
  snapshot.bricks = toBricks({{grown, toLogOdds(0.25)},
                              {{{12, 0, 0}, {14, 1, 1}}, 0.0F},
                              {{{32, 0, 0}, {34, 1, 1}}, 0.0F}})
                        .bricks;
  snapshot.cuboids = {{grown, Occupancy::kFree}};
  writeMapFile(folder / "map.csv", snapshot);
  EXPECT_EQ(readFile(folder / "map.csv"),
            "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n"
            "4,0,0,12,1,1,0.25,free\n"
            "12,0,0,13,1,1,0.5,occupied\n"
            "13,0,0,14,1,1,0.5,occupied\n"
            "32,0,0,34,1,1,0.5,occupied\n");
}

/// A window writes pages one by one, and a page may keep a grown cuboid that reached into another one.
TEST(MapFiles, ofTextLeaveOutGrownCuboidsThatTheVoxelsContradict) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  const CellBox grown{{62, 0, 0}, {66, 1, 1}};
  snapshot.bricks = toBricks({{grown, toLogOdds(0.25)}}).bricks;
  snapshot.cuboids = {{grown, Occupancy::kFree}};
  for (const bool is_known : {false, true}) {
    writeMapFile(folder / "map.sqlite", snapshot);
    MapStore(folder / "map.sqlite", StoreAccess::kWrite).write({{64, 0, 0}}, [&](const Cell&) {
      return is_known ? toBricks({{{{64, 0, 0}, {66, 1, 1}}, 0.0F}}).bricks
                      : std::vector<VoxelBrick>();
    });
    writeMapFile(folder / "map.csv", readMapFile(folder / "map.sqlite").snapshot);
    EXPECT_EQ(readFile(folder / "map.csv"),
              std::string("min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n"
                          "62,0,0,64,1,1,0.25,free\n") +
                  (is_known ? "64,0,0,66,1,1,0.5,occupied\n" : ""));
  }
}

TEST(MapFiles, keepTheCuboidsThatHaveGrown) {
  const TemporaryFolder folder;
  for (const std::uint64_t seed : {71U, 72U, 73U}) {
    Random random(seed);
    MapConfig config;
    config.resolution_m = 0.25;
    config.fusion = FusionKind::kGrowth;
    config.growth.alpha_min = config.growth.alpha_max = 0.5;
    CuboidMap map = std::move(test::randomMap(random, config).map);
    ScanUpdate update;
    const CellBox wall{{-40, 40, 0}, {40, 43, 3}};
    forEachBrick(wall, [&](const Cell& brick) {
      update.bricks.emplace_back();
      update.bricks.back().brick = brick;
      update.bricks.back().hits = BrickMask::ofBox(intersect(wall, brickBox(brick)));
    });
    map.apply(update);
    const std::vector<Cuboid> expected = test::allCuboids(map);
    const bool is_across = std::any_of(expected.begin(), expected.end(), [](const Cuboid& cuboid) {
      return pageOf(cuboid.box.min) != pageOf(cuboid.box.max - Cell{1, 1, 1});
    });
    EXPECT_TRUE(is_across) << "a cuboid lies in two pages of the store";
    for (const char* name : {"map.cuboids", "map.sqlite"}) {
      SCOPED_TRACE(name);
      saveMap(map, folder / name);
      CuboidMap copy(config);
      loadMap(folder / name, copy);
      EXPECT_EQ(test::allCuboids(copy), expected);
      EXPECT_EQ(test::voxelsOf(copy), test::voxelsOf(map));
      EXPECT_EQ(test::voxelsOf(loadMap(folder / name)), test::voxelsOf(map)) << "other fusion";
    }
  }
}

TEST(MapFiles, ofTheNativeFormatKeepLocks) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {3, 3, 3}}, 1.0F}});
  map.lock({{-5, 2, 7}, {1, 900, 8}});
  map.lock({{-Grid::kMaxCell, 1000, -Grid::kMaxCell}, {Grid::kMaxCell, 1001, Grid::kMaxCell}});
  saveMap(map, file);
  EXPECT_EQ(loadMap(file).lockedBoxes(), map.lockedBoxes());
  CuboidMap other;
  other.lock({{70, 0, 0}, {71, 1, 1}});
  loadMap(file, other);
  EXPECT_EQ(other.lockedBoxes(), map.lockedBoxes()) << "in the place of all that was there";
  EXPECT_EQ(test::voxelsOf(other), test::voxelsOf(map));
  map.setLocked({});
  saveMap(map, file);
  EXPECT_TRUE(loadMap(file).lockedBoxes().empty());
}

TEST(MapFiles, areRefusedWithTheNameOfTheFile) {
  const TemporaryFolder folder;
  const auto error_of = [](const std::function<void()>& action) -> std::string {
    try {
      action();
    } catch (const MapFileError& error) {
      return error.what();
    }
    return "none";
  };
  const std::string file = folder / "map.txt";
  MapSnapshot far = makeSnapshot();
  far.bricks = {{{1 << 16, 0, 0}, PackedVoxels(BrickMask::all(), 1.0F)}};
  EXPECT_EQ(error_of([&] {
              writeMapFile(folder / "far.ot", far);
            }).rfind(folder / "far.ot" + std::string(" cannot hold"), 0),
            0U);
  EXPECT_NE(error_of([&] { writeMapFile(file, {}); }).find(".cuboids, .sqlite, .ot, .bt"),
            std::string::npos);
  EXPECT_NE(error_of([&] { (void)readMapFile(file); }).find(file), std::string::npos);
  replaceFile(file, "");
  EXPECT_EQ(error_of([&] { (void)readMapFile(file); }), file + " is empty");
  replaceFile(file, "A poem about maps");
  EXPECT_EQ(error_of([&] { (void)readMapFile(file); }).find(file + " is not a map"), 0U);
}

TEST(MapFiles, ofAllFormatsPromiseTheirOwnErrorsForWhateverIsWrongWithAPath) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  for (const std::string ending : {"cuboids", "sqlite", "ot", "bt", "pcd", "ply", "csv"}) {
    const std::string pipe = folder / ("pipe." + ending);
    ASSERT_EQ(mkfifo(pipe.c_str(), 0666), 0);
    const std::string loop = folder / ("loop." + ending);
    ASSERT_EQ(symlink(loop.c_str(), loop.c_str()), 0);
    const std::string directory = folder / ("folder." + ending);
    ASSERT_EQ(mkdir(directory.c_str(), 0777), 0);
    const std::string closed = folder / ("closed" + ending);
    ASSERT_EQ(mkdir(closed.c_str(), 0), 0);
    const std::string link = folder / ("link." + ending);
    ASSERT_EQ(symlink((closed + "/map").c_str(), link.c_str()), 0);
    ASSERT_EQ(chmod((folder / ".").c_str(), 0777), 0);
    const test::AsNobody nobody;
    for (const std::string& file : {pipe, loop, directory, closed + "/map." + ending, link,
                                    std::string(5000, 'x') + "." + ending}) {
      EXPECT_THROW((void)readMapFile(file), MapFileError) << file.substr(0, 100);
      EXPECT_THROW(writeMapFile(file, snapshot), MapFileError) << file.substr(0, 100);
    }
  }
}

TEST(MapFiles, ofPointsOnAFullDiskAreErrors) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  const test::FullDisk full(2);
  for (const std::string ending : {"ply", "pcd", "csv", "ot", "bt", "cuboids"}) {
    const std::string file = folder / ("map." + ending);
    EXPECT_THROW(writeMapFile(file, snapshot), MapFileError) << ending;
    EXPECT_FALSE(std::filesystem::exists(file));
  }
}

TEST(MapFiles, ATextThatIsCalledAnOctomapFileIsSaidNotToBeOne) {
  const TemporaryFolder folder;
  for (const std::string name : {"map.bt", "map.ot"}) {
    std::ofstream(folder / name) << "no octree\n";
    try {
      (void)readMapFile(folder / name);
      FAIL() << name;
    } catch (const MapFileError& error) {
      EXPECT_EQ(error.defect(), MapFileDefect::kForeign);
      EXPECT_NE(std::string(error.what()).find("is not an OctoMap file"), std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
