// SPDX-License-Identifier: BSD-3-Clause
// What the display draws besides the map. Run by test_rviz_display.py, on a virtual screen.
#include "rviz_display/cuboid_map_display.h"
#include "rviz_display/distance_layer.h"
#include "rviz_display/frontier_layer.h"
#include "rviz_display/offered_map.h"
#include "rviz_display/rviz_window.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>

#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreTextureManager.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;
using rviz::StatusProperty;

constexpr double kResolution_m = 0.1;
constexpr float kOccupied = 1.0F;
constexpr float kFree = -1.0F;

CuboidMap makeLayeredMap(const std::vector<UniformBox>& boxes = {}) {
  MapConfig config;
  config.resolution_m = kResolution_m;
  CuboidMap map(config);
  map.replace(kAllCells, boxes);
  return map;
}

/// Free space on both sides of a wall through the origin.
std::vector<UniformBox> makeRoom() {
  return {{{{-40, -40, 0}, {-1, 40, 8}}, kFree},
          {{{-1, -40, 0}, {1, 40, 8}}, kOccupied},
          {{{1, -40, 0}, {40, 40, 8}}, kFree}};
}

double bruteForceDistance(const CuboidMap& map, const Cell& cell, int reach) {
  double nearest = std::numeric_limits<double>::infinity();
  Cell step;
  for (step.z = -reach; step.z <= reach; ++step.z) {
    for (step.y = -reach; step.y <= reach; ++step.y) {
      for (step.x = -reach; step.x <= reach; ++step.x) {
        if (map.voxels().at(cell + step) != Occupancy::kOccupied) continue;
        nearest = std::min(nearest, toVector(step).norm());
      }
    }
  }
  return kResolution_m * nearest;
}

/// Place of a colour between red (0) and blue (1).
double ratioOf(const FlatImage::Pixel& pixel) {
  if (pixel[0] == 255) return pixel[1] / 255.0 / 4.0;
  if (pixel[2] == 255) return 1.0 - pixel[1] / 255.0 / 4.0;
  return 0.5 + (pixel[2] - pixel[0]) / 255.0 / 4.0;
}

/// @return Number of known voxels.
std::size_t expectColors(const std::vector<FlatImage::Pixel>& pixels, const CuboidMap& map,
                         const CellBox& layer, int bound) {
  EXPECT_EQ(pixels.size(), static_cast<std::size_t>(layer.numVoxels()));
  std::size_t num_known = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto at = static_cast<std::int32_t>(i);
    const Cell cell = layer.min + Cell{at % layer.size().x, at / layer.size().x, 0};
    const bool is_known = map.voxels().at(cell) != Occupancy::kUnknown;
    EXPECT_EQ(pixels[i][3], is_known ? 255 : 0);
    if (!is_known) continue;
    ++num_known;
    const double distance_m = bruteForceDistance(map, cell, bound);
    EXPECT_NEAR(ratioOf(pixels[i]), std::min(1.0, distance_m / (bound * kResolution_m)), 0.01);
  }
  return num_known;
}

TEST(DistanceColors, RunFromRedAtAnObstacleToBlueAtTheBound) {
  cuboid_mapping::test::Random random(5);
  CuboidMap map = makeLayeredMap();
  map.apply(cuboid_mapping::test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 20));
  const CellBox layer{{-9, -12, 3}, {14, 11, 4}};
  constexpr int kBound = 4;
  const auto pixels = DistanceColors().update(copyOf(map), layer, kBound * kResolution_m);
  EXPECT_GT(expectColors(pixels, map, layer, kBound), 40U);
}

TEST(DistanceColors, FollowTheMapAndTheLayer) {
  cuboid_mapping::test::Random random(6);
  CuboidMap map = makeLayeredMap();
  DistanceColors colors;
  CellBox layer{{-9, -12, 3}, {14, 11, 4}};
  int bound = 4;
  for (int i = 0; i < 40; ++i) {
    map.apply(cuboid_mapping::test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 3));
    if (random.chance(0.2))
      map.replace(cuboid_mapping::test::randomBox(random, layer, 12), std::vector<UniformBox>{});
    if (random.chance(0.1)) layer = {layer.min + Cell{1, 0, 1}, layer.max + Cell{1, 0, 1}};
    if (random.chance(0.1)) bound = 7 - bound;
    expectColors(colors.update(copyOf(map), layer, bound * kResolution_m), map, layer, bound);
    if (i == 20) {
      EXPECT_THROW((void)colors.update(copyOf(map), layer, 100.0), std::invalid_argument);
    }
  }
}

TEST(FrontierPicture, HasEachVoxelOnceAndAPlaceInTheColorOfItsCluster) {
  const Grid grid(kResolution_m);
  Frontier first;
  first.voxels = {{0, 0, 0}, {1, 0, 0}};
  first.center_map = {0.05, 0.05, 0.05};
  Frontier second;
  second.voxels = {{20, 0, 0}};
  second.center_map = {2.05, 0.05, 0.05};
  second.place_map = Eigen::Vector3d(1.0, 0.5, 0.25);
  const Eigen::Vector3d corner_map(1.0, 0.0, 0.0);
  const FrontierPicture picture = drawFrontiers(grid, {first, second}, corner_map);
  EXPECT_EQ(picture.num_clusters, 2U);
  ASSERT_EQ(picture.voxels.size(), 3U);
  ASSERT_EQ(picture.places.size(), 1U);
  EXPECT_TRUE(picture.voxels[1].position.positionEquals({-0.85F, 0.05F, 0.05F}));
  EXPECT_TRUE(picture.places[0].position.positionEquals({0.0F, 0.5F, 0.25F}));
  EXPECT_EQ(picture.voxels[0].color, picture.voxels[1].color);
  EXPECT_NE(picture.voxels[0].color, picture.voxels[2].color);
  EXPECT_EQ(picture.places[0].color, picture.voxels[2].color);
}

TEST(ViewedPart, LiesWhereTheViewMeetsThePlaneOrAroundTheEye) {
  const CuboidMap map = makeLayeredMap({{{{-4000, -10, 0}, {4000, 10, 8}}, kFree}});
  const CellBox there = findViewedPart(map, {{0.0, 0.0, 100.5}, {1.0, 0.0, -1.0}}, 0.5);
  EXPECT_EQ(there.size(), (Cell{kViewedEdge, 20, 8}));
  EXPECT_LT(there.min.x, 1000 - 200);
  EXPECT_GT(there.max.x, 1000 + 200);
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 1), Eigen::Vector3d(1, 0, 0)}) {
    const CellBox here = findViewedPart(map, {{100.0, 0.0, 100.5}, direction}, 0.5);
    EXPECT_EQ(here, there);
  }
  EXPECT_TRUE(findViewedPart(map, {{0.0, 100.0, 1.0}, {0.0, 0.0, -1.0}}, 0.5).isEmpty());
  EXPECT_TRUE(findViewedPart(makeLayeredMap(), {{0.0, 0.0, 1.0}, {0.0, 0.0, -1.0}}, 0.5).isEmpty());
}

class MapLayers : public testing::Test {
 protected:
  static void SetUpTestSuite() { the_window = std::make_unique<test::RvizWindow>(QSize(320, 240)); }
  static void TearDownTestSuite() { the_window.reset(); }
  static test::RvizWindow& window() { return *the_window; }

  void SetUp() override {
    window().look(6.0, 0.0, 1.5);  // From above.
    publisher_ = test::offer(nh_, map_, "map");
    auto* display = window().addDisplay("cuboid_mapping/CuboidMap");
    display_.reset(dynamic_cast<CuboidMapDisplay*>(display));
    display_->subProp("Topic namespace")->setValue("/layers");
    display_->subProp("Occupied")->setValue(false);
  }

  CuboidMapDisplay& display() { return *display_; }
  bool becomes(const char* name, StatusProperty::Level level, const QString& begin = "") {
    return window().updateUntil([&] {
      const StatusProperty* status = test::findStatus(*display_, name);
      return status != nullptr && status->getLevel() == level &&
             status->getValue().toString().startsWith(begin);
    });
  }
  void change(const CellBox& box, const std::vector<UniformBox>& boxes) {
    map_.replace(box, boxes);
    publisher_ = test::offer(nh_, map_, "map");
  }
  const CuboidMap& map() const { return map_; }

  /// Pixels that are red, green or blue: channel 0, 1 or 2.
  std::size_t countPixels(std::size_t channel) {
    window().drawFrame();
    const std::vector<unsigned char> pixels = window().readPixels();
    std::size_t count = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
      const bool is_other =
          pixels[i + (channel + 1) % 3] > 60 || pixels[i + (channel + 2) % 3] > 60;
      count += !is_other && pixels[i + channel] > 200 ? 1 : 0;
    }
    return count;
  }
  /// Pixels with a colour.
  std::size_t countColored() {
    window().drawFrame();
    const std::vector<unsigned char> pixels = window().readPixels();
    std::size_t count = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
      const auto ends = std::minmax_element(&pixels[i], &pixels[i] + 3);
      count += *ends.second - *ends.first > 60 ? 1 : 0;
    }
    return count;
  }

 private:
  static inline std::unique_ptr<test::RvizWindow> the_window;  ///< One for all: rviz has one Ogre.
  ros::NodeHandle nh_{"/layers"};
  CuboidMap map_ = makeLayeredMap(makeRoom());
  ros::Publisher publisher_;
  std::unique_ptr<CuboidMapDisplay> display_;
};

TEST_F(MapLayers, ShowDistancesOfTheMapAsItIsNow) {
  display().subProp("Distances")->setValue(true);
  ASSERT_TRUE(becomes("Distances", StatusProperty::Ok, "80 x 80 voxels"));
  EXPECT_GT(countPixels(0), 100U);
  EXPECT_GT(countPixels(2), 1000U);
  EXPECT_GT(countPixels(1), 100U) << "half way";
  change({{-40, -40, 0}, {40, 40, 8}}, {{{{-40, -40, 0}, {40, 40, 8}}, kFree}});
  EXPECT_TRUE(window().updateUntil([&] { return countPixels(0) == 0; })) << "the wall is gone";
  EXPECT_GT(countPixels(2), 10000U);
  display().subProp("Distances")->subProp("Height")->setValue(5.0);
  EXPECT_TRUE(becomes("Distances", StatusProperty::Ok, "nothing is known"));
  EXPECT_EQ(countColored(), 0U);
}

TEST_F(MapLayers, AreGoneWithoutATraceWhenTheyAreSwitchedOff) {
  ASSERT_TRUE(window().updateUntil([&] { return display().scene() != nullptr; }));
  const Ogre::SceneNode* node = display().getSceneNode();
  const unsigned num_nodes = node->numChildren();
  for (const char* name : {"Distances", "Frontier clusters"}) {
    display().subProp(name)->setValue(true);
    ASSERT_TRUE(becomes(name, StatusProperty::Ok));
    EXPECT_GT(countColored(), 1000U) << name;
    EXPECT_GT(node->numChildren(), num_nodes);
    display().subProp(name)->setValue(false);
    window().updateFor(0.1);
    EXPECT_EQ(countColored(), 0U) << name;
    EXPECT_EQ(node->numChildren(), num_nodes);
    EXPECT_EQ(test::findStatus(display(), name), nullptr);
  }
  for (const auto& item : Ogre::TextureManager::getSingleton().getResourceIterator()) {
    EXPECT_NE(item.second->getName().find("cuboid_mapping/image"), 0U);
  }
}

TEST_F(MapLayers, LookAtAMapFarFromTheOriginOnceItIsThere) {
  change(kAllCells, {{{{4000, 0, 0}, {4080, 60, 8}}, kOccupied}});
  rviz::Property* look = display().subProp("Look at map");
  rviz::Property* view = window().manager().getViewManager()->getCurrent();
  const auto focus = [&](const char* axis) {
    return view->subProp("Focal Point")->subProp(axis)->getValue().toDouble();
  };
  look->setValue(true);
  EXPECT_TRUE(window().updateUntil([&] {
    const bool has_looked = !look->getValue().toBool();
    if (has_looked && focus("X") < 100.0) look->setValue(true);  // The display had the map before.
    return has_looked && focus("X") > 100.0;
  }));
  EXPECT_NEAR(focus("X"), 404.0, 1e-3);
  EXPECT_NEAR(focus("Y"), 3.0, 1e-3);
  EXPECT_NEAR(focus("Z"), 0.4, 1e-3);
  EXPECT_NEAR(view->subProp("Distance")->getValue().toDouble(), 10.0, 0.1);
  for (const char* axis : {"X", "Y", "Z"}) view->subProp("Focal Point")->subProp(axis)->setValue(0);
}

TEST_F(MapLayers, SayWhatIsWrongWithAProperty) {
  display().subProp("Distances")->setValue(true);
  ASSERT_TRUE(becomes("Distances", StatusProperty::Ok));
  rviz::Property* bound = display().subProp("Distances")->subProp("Max distance");
  bound->setValue(100.0);
  EXPECT_TRUE(becomes("Distances", StatusProperty::Error, "the bound of a distance field"));
  EXPECT_EQ(countColored(), 0U);
  bound->setValue(1.0);
  EXPECT_TRUE(becomes("Distances", StatusProperty::Ok));
  display().subProp("Frontier clusters")->setValue(true);
  ASSERT_TRUE(becomes("Frontier clusters", StatusProperty::Ok));
  display().subProp("Frontier clusters")->subProp("Robot")->subProp("X")->setValue(0.0);
  EXPECT_TRUE(becomes("Frontier clusters", StatusProperty::Error, "Robot"));
}

TEST_F(MapLayers, ShowTheClustersOfFrontiersWithPlacesToStand) {
  FrontierTask task;
  task.view_range_m = 0.0;
  const auto found = findFrontiers(map(), task, cuboid_mapping::Budget::unlimited()).value;
  ASSERT_EQ(found.size(), 2U);
  ASSERT_TRUE(found[0].place_map && found[1].place_map);
  display().subProp("Frontier clusters")->setValue(true);
  const std::size_t num_voxels = found[0].voxels.size() + found[1].voxels.size();
  EXPECT_TRUE(becomes("Frontier clusters", StatusProperty::Ok,
                      QString("clusters: 2, voxels: %1, places to stand: 2").arg(num_voxels)));
  EXPECT_GT(countColored(), 1000U);
  change({{1, -40, 0}, {40, 40, 8}}, {});
  EXPECT_TRUE(becomes("Frontier clusters", StatusProperty::Ok, "clusters: 1,"));
}

TEST_F(MapLayers, SurviveThatTheDisplayIsSwitchedOffWhileTheyAreComputed) {
  for (int round = 0; round < 20; ++round) {
    for (const char* name : {"Distances", "Frontier clusters"}) {
      display().subProp(name)->setValue(true);
    }
    window().updateFor(0.02 * round);
    display().setEnabled(false);
    window().update();
    EXPECT_EQ(countColored(), 0U);
    display().setEnabled(true);
  }
  EXPECT_TRUE(becomes("Distances", StatusProperty::Ok));
}

}  // namespace
}  // namespace cuboid_mapping_rviz
