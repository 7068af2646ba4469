// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/marker_cache.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "ros/marker_picture.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::Cuboid;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::FusionKind;
using cuboid_mapping::Grid;
using cuboid_mapping::MapConfig;
using cuboid_mapping::ScanUpdater;
using cuboid_mapping::UniformBox;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;
using test::expectedCubes;
using test::MarkerViewer;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

std_msgs::Header makeMapHeader() {
  std_msgs::Header header;
  header.frame_id = "map";
  header.stamp = ros::Time(12, 34);
  return header;
}

/// The markers that changes of a map have changed.
MarkerArray update(MarkerCache& cache, const CuboidMap& map, const std_msgs::Header& header) {
  cache.read(map, cuboid_mapping::Budget::unlimited());
  return cache.takeDifference(header);
}

std::vector<MarkerStyle> allStyles() {
  return {{CuboidFilter::kOccupied, {-1.0, 2.0}}, {CuboidFilter::kFree}};
}

/// A scan from a random place in a hall of 40 x 40 x 40 voxels around `center_m`.
cuboid_mapping::Scan scanAround(Random& random, const Eigen::Vector3f& center_m) {
  cuboid_mapping::test::ScanShape shape;
  shape.num_points = random.integer(1, 40);
  shape.half_edge_m = 4.0;
  cuboid_mapping::Scan scan = cuboid_mapping::test::randomScan(random, shape);
  scan.origin += center_m;
  for (Eigen::Vector3f& point : scan.points) point += center_m;
  for (Eigen::Vector3f& point : scan.no_returns) point += center_m;
  return scan;
}

/// A robot that drives back and forth over several chunks, and a map that is cleared sometimes.
class Drive {
 public:
  Drive(Random& random, FusionKind fusion)
      : random_(random), map_(makeConfig(fusion)), updater_(map_.grid()) {}

  ChangeSet step() {
    if (random_.chance(0.03)) return map_.clear();
    const float x = static_cast<float>(random_.integer(-2, 2)) * 10.0F;
    return map_.apply(updater_.compute(scanAround(random_, {x, -0.5F * x, 0.0F})));
  }

  [[nodiscard]] const CuboidMap& map() const { return map_; }

 private:
  static MapConfig makeConfig(FusionKind fusion) {
    MapConfig config;
    config.resolution_m = 0.2;
    config.fusion = fusion;
    return config;
  }

  Random& random_;
  CuboidMap map_;
  ScanUpdater updater_;
};

TEST(MarkerCache, OtherColoursCountForMarkersThatAreThereAlready) {
  Random random(76);
  Drive drive(random, FusionKind::kClass);
  for (int i = 0; i < 5; ++i) drive.step();
  MarkerStyle style;
  MarkerCache cache(drive.map().grid(), style);
  MarkerViewer viewer;
  viewer.apply(update(cache, drive.map(), makeMapHeader()));
  EXPECT_FALSE(cache.hasChanges());
  const auto expect_shown = [&] {
    EXPECT_TRUE(cache.hasChanges());
    viewer.apply(update(cache, drive.map(), makeMapHeader()));
    const auto expected = expectedCubes(drive.map(), drive.map().grid(), style);
    EXPECT_GT(expected.size(), 10U);
    EXPECT_EQ(viewer.cubes(), expected) << seedNote(0);
    EXPECT_FALSE(cache.hasChanges());
  };
  for (const double low_m : {-2.0, 0.0}) {
    cache.setColorSpan(style.color_span = {low_m, 3.0});
    expect_shown();
  }
}

TEST(MarkerCache, DifferencesAddUpToTheWholeMap) {
  std::size_t num_compared = 0;
  std::size_t num_cubes = 0;
  std::size_t num_deletes = 0;
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kNone}) {
    for (std::size_t i = 0; i < allStyles().size(); ++i) {
      SCOPED_TRACE(seedNote(i));
      const MarkerStyle style = allStyles()[i];
      Random random(i);
      Drive drive(random, fusion);
      MarkerCache cache(drive.map().grid(), style);
      MarkerViewer viewer;
      for (int step = 0; step < 120; ++step) {
        cache.noteChanges(drive.step());
        if (random.chance(0.4)) continue;  // changes of several clouds add up
        viewer.apply(update(cache, drive.map(), makeMapHeader()));
        const auto expected = expectedCubes(drive.map(), drive.map().grid(), style);
        ASSERT_EQ(viewer.cubes(), expected) << "step " << step;
        ++num_compared;
        num_cubes += expected.size();
      }
      EXPECT_LE(viewer.numKept(), static_cast<std::size_t>(MarkerCache::kNumSizes));
      num_deletes += viewer.numDeletes();
      EXPECT_EQ(viewer.numNeedlessDeletes(), 0U);
    }
  }
  EXPECT_GT(num_compared, 200U);
  EXPECT_GT(num_cubes, 100'000U);
  EXPECT_GT(num_deletes, 50U);
}

TEST(MarkerCache, FarAwayPosesCarryWhatFloatsCannot) {
  MapConfig config;
  config.resolution_m = 0.5;
  CuboidMap map(config);
  MarkerCache cache(map.grid(), MarkerStyle());
  EXPECT_TRUE(update(cache, map, makeMapHeader())
                  .markers.empty());  // For a listener before the first cloud.
  const Cell far{1000001, 10000003, 5};
  cache.noteChanges(
      map.replace(CellBox::ofCell(far), std::vector<UniformBox>{{CellBox::ofCell(far), 1.0F}}));
  const MarkerArray array = update(cache, map, makeMapHeader());
  ASSERT_EQ(array.markers.size(), 1U);
  const Marker& marker = array.markers[0];
  EXPECT_LT(std::abs(marker.points.at(0).y), 1024.0);
  EXPECT_EQ(marker.points[0].x + marker.pose.position.x, 0.5 * (far.x + 0.5));
  EXPECT_EQ(marker.points[0].y + marker.pose.position.y, 0.5 * (far.y + 0.5));
}

TEST(MarkerCache, PictureShowsALateListenerWhatTheOthersHave) {
  Random random(10);
  Drive drive(random, FusionKind::kClass);
  MarkerCache cache(drive.map().grid(), MarkerStyle());
  MarkerViewer viewer;
  std::size_t num_compared = 0;
  for (int step = 0; step < 60; ++step) {
    viewer.apply(update(cache, drive.map(), makeMapHeader()));
    // It is not published yet: in neither picture.
    cache.noteChanges(drive.step());
    MarkerViewer late;
    Marker stale;
    stale.ns = "from an earlier run";
    stale.type = Marker::CUBE_LIST;
    stale.points.resize(1);
    stale.pose.orientation.w = 1.0;
    MarkerArray earlier;
    earlier.markers = {stale};
    late.apply(earlier);
    late.apply(cache.makePicture(makeMapHeader()));
    ASSERT_EQ(late.cubes(), viewer.cubes()) << "step " << step;
    num_compared += late.cubes().empty() ? 0 : 1;
  }
  EXPECT_GT(num_compared, 40U);
}

TEST(MarkerCache, OthersChangeTheMapBetweenTwoPages) {
  using cuboid_mapping::Budget;
  Random random(77);
  Drive drive(random, FusionKind::kClass);
  MarkerCache cache(drive.map().grid(), MarkerStyle());
  MarkerViewer viewer;
  std::vector<ChangeSet> meanwhile;
  const auto change = [&] { meanwhile.push_back(drive.step()); };
  std::size_t num_changes = 0;
  for (int step = 0; step < 30; ++step) {
    cache.noteChanges(drive.step());
    Budget budget({}, {change, 0.0, nullptr});
    cache.read(drive.map(), budget);
    viewer.apply(cache.takeDifference(makeMapHeader()));
    num_changes += meanwhile.size();
    for (const ChangeSet& changes : meanwhile) cache.noteChanges(changes);
    meanwhile.clear();
    viewer.apply(update(cache, drive.map(), makeMapHeader()));
    ASSERT_EQ(viewer.cubes(), expectedCubes(drive.map(), drive.map().grid(), MarkerStyle()))
        << "step " << step;
  }
  EXPECT_GE(num_changes, 60U) << "a turn for others after each page";
}

TEST(MarkerCache, LearnsTheMapAnewAfterARelease) {
  Random random(20);
  Drive drive(random, FusionKind::kClass);
  MarkerCache cache(drive.map().grid(), MarkerStyle());
  for (int step = 0; step < 20; ++step) {
    for (int i = 0; i < 3; ++i) cache.noteChanges(drive.step());
    (void)update(cache, drive.map(), makeMapHeader());
    cache.release();
    EXPECT_EQ(cache.makePicture(makeMapHeader()).markers.size(), 1U) << "only DELETEALL";
    cache.noteChanges(drive.step());
    EXPECT_TRUE(cache.hasChanges());
    MarkerViewer viewer;
    viewer.apply(update(cache, drive.map(), makeMapHeader()));
    ASSERT_EQ(viewer.cubes(), expectedCubes(drive.map(), drive.map().grid(), MarkerStyle()));
  }
}

/// Long thin walls that come and go: growth makes cuboids of them that reach through many bricks.
class GrowingWalls {
 public:
  explicit GrowingWalls(Random& random) : random_(random), map_(makeConfig()) {}

  /// Removes voxels at some place, and observes other walls.
  ChangeSet step() {
    ChangeSet changes;
    const auto add = [&changes](const ChangeSet& more) {
      changes.bricks.insert(changes.bricks.end(), more.bricks.begin(), more.bricks.end());
    };
    const CellBox everywhere{{-150, -150, -20}, {150, 150, 20}};
    add(map_.replace(cuboid_mapping::test::randomBox(random_, everywhere, 30),
                     std::vector<UniformBox>{}));
    for (int i = 0; i < 3; ++i) {
      CellBox wall = CellBox::ofCell(cuboid_mapping::test::randomCell(random_, everywhere));
      wall.max[random_.integer(0, 2)] += random_.integer(1, 100);
      wall.max[random_.integer(0, 2)] += random_.integer(0, 2);
      constexpr int kCloudsUntilStable = 6;
      for (int cloud = 0; cloud < kCloudsUntilStable; ++cloud) add(map_.apply(hitsOf(wall)));
    }
    return changes;
  }

  [[nodiscard]] const CuboidMap& map() const { return map_; }

 private:
  static MapConfig makeConfig() {
    MapConfig config;
    config.fusion = FusionKind::kGrowth;
    config.growth.settle_clouds = 0;
    return config;
  }
  static cuboid_mapping::ScanUpdate hitsOf(const CellBox& box) {
    cuboid_mapping::ScanUpdate update;
    forEachBrick(box, [&](const Cell& brick) {
      update.bricks.emplace_back();
      update.bricks.back().brick = brick;
      update.bricks.back().hits =
          cuboid_mapping::BrickMask::ofBox(intersect(box, cuboid_mapping::brickBox(brick)));
    });
    return update;
  }

  Random& random_;
  CuboidMap map_;
};

TEST(MarkerCache, CutsLongCuboidsAndKeepsThoseThatCrossChunks) {
  const Grid grid(0.1);
  Random random(30);
  GrowingWalls walls(random);
  MarkerCache cache(grid, MarkerStyle());
  MarkerViewer viewer;
  std::size_t num_crossing = 0;
  for (int step = 0; step < 100; ++step) {
    cache.noteChanges(walls.step());
    viewer.apply(update(cache, walls.map(), makeMapHeader()));
    ASSERT_EQ(viewer.cubes(), expectedCubes(walls.map(), grid, MarkerStyle())) << "step " << step;
    visitAll(walls.map(), CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
      num_crossing += (cuboid.box.min.x & ~63) != ((cuboid.box.max.x - 1) & ~63) ? 1 : 0;
      return cuboid_mapping::Visit::kContinue;
    });
  }
  EXPECT_GT(num_crossing, 100U);
  EXPECT_GT(viewer.cubes().size(), 1000U);
}

ChangeSet insert(const UniformBox& box, CuboidMap& map) { return map.replace(box.box, {box}); }

TEST(MarkerCache, ShowsEveryVoxelOfItsClassOnce) {
  Random random(60);
  Drive drive(random, FusionKind::kClass);
  for (const MarkerStyle& style : allStyles()) {
    MarkerCache cache(drive.map().grid(), style);
    MarkerViewer viewer;
    for (int step = 0; step < 40; ++step) {
      cache.noteChanges(drive.step());
      viewer.apply(update(cache, drive.map(), makeMapHeader()));
      const bool is_free = style.filter == CuboidFilter::kFree;
      const auto& voxels = drive.map().voxels();
      double volume_m3 = 0.0;
      for (const auto& cube : viewer.cubes()) {
        const auto& um = cube.geometry_um;
        volume_m3 += 1e-18 * static_cast<double>(um[3]) * static_cast<double>(um[4]) *
                     static_cast<double>(um[5]);
      }
      ASSERT_NEAR(volume_m3 / drive.map().grid().voxelVolume(),
                  is_free ? voxels.numFreeVoxels() : voxels.numOccupiedVoxels(), 1e-3);
      const auto counts = countCuboids(drive.map());
      ASSERT_EQ(viewer.cubes().size(), is_free ? counts.free : counts.occupied);
    }
  }
}

TEST(MarkerCache, SendsOnlySizesThatHaveChanged) {
  const Grid grid(0.5);
  CuboidMap map;
  (void)insert({{{0, 0, 0}, {1, 1, 1}}, 1.0F}, map);
  (void)insert({{{8, 0, 0}, {10, 3, 4}}, 1.0F}, map);
  MarkerCache cache(grid, MarkerStyle());
  EXPECT_EQ(update(cache, map, makeMapHeader()).markers.size(), 2U);
  EXPECT_FALSE(cache.hasChanges());

  // The whole chunk is read again, but only one list comes out different.
  ChangeSet changes = insert({{{16, 0, 0}, {18, 3, 4}}, 1.0F}, map);
  changes.bricks.push_back({{0, 0, 0}, true});
  cache.noteChanges(changes);
  EXPECT_TRUE(cache.hasChanges());
  const MarkerArray difference = update(cache, map, makeMapHeader());
  EXPECT_FALSE(cache.hasChanges());
  ASSERT_EQ(difference.markers.size(), 1U) << "the size of one voxel is as it was";
  const Marker& marker = difference.markers.front();
  EXPECT_EQ(marker.id, (2 - 1) + 8 * (3 - 1) + 64 * (4 - 1));
  EXPECT_EQ(marker.ns, "occupied");
  EXPECT_EQ(marker.action, static_cast<int>(Marker::ADD));
  EXPECT_EQ(marker.header.frame_id, "map");
  EXPECT_EQ(marker.header.stamp, ros::Time(12, 34));
  EXPECT_TRUE(marker.frame_locked) << "to be seen in other fixed frames, however old the stamp";
  EXPECT_EQ(marker.points.size(), 2U);
  EXPECT_DOUBLE_EQ(marker.scale.x, 1.0);
  EXPECT_DOUBLE_EQ(marker.scale.y, 1.5);
  EXPECT_DOUBLE_EQ(marker.scale.z, 2.0);
  EXPECT_DOUBLE_EQ(marker.points.front().x, 4.5);
}

TEST(MarkerCache, ReadsAllChunksThatHaveAChangedBrick) {
  const UniformBox first{{{0, 0, 0}, {1, 1, 1}}, 1.0F};
  const UniformBox second{{{100, 0, 0}, {102, 1, 1}}, 1.0F};  // in the next chunk
  CuboidMap map;
  MarkerCache cache(Grid(0.1), MarkerStyle());
  (void)update(cache, map, makeMapHeader());
  (void)insert(first, map);
  (void)insert(second, map);
  ChangeSet changes;
  for (const std::int32_t x : {0, 96, 104}) changes.bricks.push_back({{x, 0, 0}, true});
  cache.noteChanges(changes);
  EXPECT_EQ(update(cache, map, makeMapHeader()).markers.size(), 2U);
}

TEST(MarkerCache, DeletesASizeThatHasVanished) {
  CuboidMap map;
  const CellBox box{{0, 0, 0}, {2, 1, 1}};
  (void)insert({box, 1.0F}, map);
  MarkerCache cache(Grid(0.1), MarkerStyle());
  (void)update(cache, map, makeMapHeader());
  cache.noteChanges(insert({box, -1.0F}, map));  // free now
  const MarkerArray difference = update(cache, map, makeMapHeader());
  ASSERT_EQ(difference.markers.size(), 1U);
  EXPECT_EQ(difference.markers.front().action, static_cast<int>(Marker::DELETE));
  EXPECT_EQ(difference.markers.front().id, 1);
  EXPECT_EQ(difference.markers.front().header.frame_id, "map");
}

TEST(MarkerCache, SendsNothingWhenTheContentIsAsBefore) {
  Random random(40);
  Drive drive(random, FusionKind::kClass);
  MarkerCache cache(drive.map().grid(), MarkerStyle());
  for (int step = 0; step < 10; ++step) cache.noteChanges(drive.step());
  EXPECT_FALSE(update(cache, drive.map(), makeMapHeader()).markers.empty());
  ChangeSet everything;
  everything.is_everything = true;
  cache.noteChanges(everything);
  EXPECT_TRUE(cache.hasChanges());
  EXPECT_TRUE(update(cache, drive.map(), makeMapHeader()).markers.empty());
}

TEST(MarkerCache, AMapOfEverySizeHas512Markers) {
  CuboidMap map;
  for (int x = 1; x <= 8; ++x) {
    for (int y = 1; y <= 8; ++y) {
      for (int z = 1; z <= 8; ++z) {
        const Cell min{8 * x, 8 * y, 8 * z};
        (void)insert({{min, min + Cell{x, y, z}}, 1.0F}, map);
      }
    }
  }
  MarkerCache cache(Grid(0.1), MarkerStyle());
  const MarkerArray picture = update(cache, map, makeMapHeader());
  std::set<int> ids;
  for (const Marker& marker : picture.markers) ids.insert(marker.id);
  EXPECT_EQ(picture.markers.size(), 512U);
  EXPECT_EQ(ids.size(), 512U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
