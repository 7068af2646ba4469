// SPDX-License-Identifier: BSD-3-Clause
// The display in a scene of rviz must neither crash nor block. Run by test_rviz_display.py, on a
// virtual screen.
#include "cuboid_mapping/io/map_files.h"
#include "rviz_display/cuboid_map_display.h"
#include "rviz_display/offered_map.h"
#include "rviz_display/rviz_window.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/properties/property.h>
#include <std_msgs/String.h>

#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;
using rviz::StatusProperty;

CuboidMap makeMap(int num_updates) {
  cuboid_mapping::test::Random random(3);
  MapConfig config;
  config.resolution_m = 0.2;
  CuboidMap map(config);
  const CellBox bricks{{-3, -3, -3}, {3, 3, 3}};
  for (int i = 0; i < num_updates; ++i)
    map.apply(cuboid_mapping::test::randomUpdate(random, bricks, 20));
  return map;
}

/// Single voxels, with grooves between them.
CuboidMap makeTiles() {
  std::vector<UniformBox> tiles;
  for (std::int32_t x = 0; x < 64; x += 2) {
    for (std::int32_t y = 0; y < 64; y += 2)
      tiles.push_back({{{x, y, 0}, {x + 1, y + 1, 1}}, 1.0F});
  }
  CuboidMap map = makeMap(0);
  map.replace(kAllCells, tiles);
  return map;
}

class DisplayLife : public testing::Test {
 protected:
  static void SetUpTestSuite() { the_window = std::make_unique<test::RvizWindow>(QSize(320, 240)); }
  static void TearDownTestSuite() { the_window.reset(); }
  static test::RvizWindow& window() { return *the_window; }

  static CuboidMapDisplay* add(const std::string& topic_namespace) {
    auto* display =
        dynamic_cast<CuboidMapDisplay*>(window().addDisplay("cuboid_mapping/CuboidMap"));
    display->subProp("Topic namespace")->setValue(QString::fromStdString(topic_namespace));
    return display;
  }

  static int levelOf(const CuboidMapDisplay& display, const char* name) {
    const StatusProperty* status = test::findStatus(display, name);
    return status == nullptr ? -1 : status->getLevel();
  }

  static bool isDrawn(const CuboidMapDisplay& display) {
    const FaceScene* scene = display.scene();
    return scene != nullptr && scene->counts(FaceSet::kOccupied).faces > 0 &&
           scene->numWaiting() == 0;
  }

  static std::string writeMap(const CuboidMap& map = makeMap(5),
                              const std::string& name = "display_life.cuboids") {
    std::string file = testing::TempDir() + name;
    writeMapFile(file, takeSnapshot(map, "map"));
    return file;
  }

 private:
  static inline std::unique_ptr<test::RvizWindow> the_window;  ///< One for all: rviz has one Ogre.
};

std::size_t countMaterials() {
  std::size_t count = 0;
  for (const auto& item : Ogre::MaterialManager::getSingleton().getResourceIterator()) {
    count += item.second->getName().find("cuboid_mapping") == 0 ? 1 : 0;
  }
  return count;
}

/// Color in the middle of the picture.
std::array<unsigned char, 3> middleOf(test::RvizWindow& window) {
  window.drawFrame();
  const std::vector<unsigned char> pixels = window.readPixels();
  const std::size_t first = 3 * (320 * 120 + 160);
  return {pixels[first], pixels[first + 1], pixels[first + 2]};
}

TEST_F(DisplayLife, followsTheTopicThatItIsAddedBy) {
  CuboidMapDisplay* display = add("elsewhere");
  display->subProp("Map file")->setValue("/a.cuboids");
  display->setTopic("/robot1/mapping/cuboid_map", "cuboid_mapping/FullCuboidMap");
  EXPECT_EQ(display->subProp("Topic namespace")->getValue().toString().toStdString(),
            "/robot1/mapping");
  EXPECT_TRUE(display->subProp("Map file")->getValue().toString().isEmpty());
  delete display;
}

TEST_F(DisplayLife, CutCuboidsLookSolid) {
  CuboidMap map = makeMap(0);
  map.replace(kAllCells, {{{{-8, -8, -8}, {8, 8, 8}}, 1.0F}});
  CuboidMapDisplay* display = add("nowhere");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(map)));
  window().look(8.0, 0.0, 1.5);  // From above.
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  const auto whole = middleOf(window());
  display->subProp("Height range")->setValue(true);
  display->subProp("Height range")->subProp("Min")->setValue(-5.0);
  display->subProp("Height range")->subProp("Max")->setValue(0.3);
  const auto cut = middleOf(window());
  display->subProp("Height range")->subProp("Max")->setValue(-9.0);
  display->subProp("Height range")->subProp("Min")->setValue(-10.0);
  const auto nothing = middleOf(window());
  EXPECT_NE(whole, nothing);
  EXPECT_NE(cut, nothing) << "the inside of the block is seen through the cut";
  EXPECT_NE(cut, whole);
  delete display;
}

TEST_F(DisplayLife, leavesNothingBehindWhenAddedAndRemoved100Times) {
  const QString file = QString::fromStdString(writeMap());
  Ogre::SceneNode* root = window().manager().getSceneManager()->getRootSceneNode();
  const std::size_t num_nodes = root->numChildren();
  for (int round = 0; round < 100; ++round) {
    CuboidMapDisplay* display = add("");
    display->subProp("Map file")->setValue(file);
    // Some are removed at once, some while the file is read, some when it is shown.
    if (round % 3 == 1) window().update();
    if (round % 3 == 2) {
      ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
    }
    delete display;
  }
  window().update();
  EXPECT_EQ(root->numChildren(), num_nodes);
  EXPECT_EQ(countMaterials(), 0U);
}

TEST_F(DisplayLife, uploadsNoVertexForColorsAlphaHeightsAndBoxes) {
  CuboidMapDisplay* display = add("");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap()));
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  const std::uint64_t num_bytes = display->scene()->numUploadedBytes();
  EXPECT_GT(num_bytes, 1000U);
  const FaceScene::Counts counts = display->scene()->counts(FaceSet::kOccupied);
  EXPECT_LE(counts.bytes, 100 * counts.faces);
  for (const char* mode : {"Probability", "Cuboid size", "Class", "Height"}) {
    display->subProp("Color by")->setValue(mode);
    window().update();
  }
  display->subProp("Color by")->subProp("Fit to heights")->setValue(false);
  display->subProp("Occupied")->subProp("Color")->setValue(QColor(255, 0, 0));
  display->subProp("Occupied")->subProp("Alpha")->setValue(0.5);
  display->subProp("Edges")->setValue(false);
  for (const char* part : {"Height range", "Clip box"}) {
    display->subProp(part)->setValue(true);
    window().update();
  }
  display->subProp("Height range")->subProp("Max")->setValue(0.3);
  display->subProp("Changed in last")->setValue(5.0);
  window().update();
  EXPECT_EQ(display->scene()->numUploadedBytes(), num_bytes);
  delete display;
}

TEST_F(DisplayLife, drawsFewerTrianglesFarAwayAndUploadsNothingForIt) {
  CuboidMapDisplay* display = add("");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(makeTiles())));
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  const std::uint64_t num_bytes = display->scene()->numUploadedBytes();
  const auto countTriangles = [](double distance_m) {
    window().look(distance_m, 0.7, 0.7);
    window().updateFor(0.5);  // A slow renderer draws fewer while it moves.
    return window().statistics().triangleCount;
  };
  rviz::Property* finest_detail = display->subProp("Finest detail");
  const QVariant usual_detail = finest_detail->getValue();
  finest_detail->setValue(0.0);
  const std::size_t whole = countTriangles(200.0);
  EXPECT_GT(whole, 1000U);
  finest_detail->setValue(usual_detail);
  EXPECT_GE(countTriangles(20.0), whole);
  EXPECT_LT(100 * countTriangles(200.0), whole);
  display->subProp("Color by")->setValue("Cuboid size");  // Coarse cells show none of these.
  EXPECT_EQ(countTriangles(200.0), whole);
  EXPECT_EQ(display->scene()->numUploadedBytes(), num_bytes);
  delete display;
}

TEST_F(DisplayLife, drawsOnlySidesThatFaceTheCamera) {
  CuboidMapDisplay* display = add("");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(makeTiles())));
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  display->subProp("Finest detail")->setValue(0.0);
  const std::size_t num_faces = display->scene()->counts(FaceSet::kOccupied).faces;
  for (const double yaw_rad : {0.7, 2.3, 3.9, 5.5}) {  // Three of the six sides of a tile.
    window().look(200.0, yaw_rad, 0.7);
    window().updateFor(0.5);
    EXPECT_EQ(window().statistics().triangleCount, num_faces) << yaw_rad;
  }
  delete display;
}

TEST_F(DisplayLife, showsWhatIsNewInAChunk) {
  std::vector<UniformBox> voxels{{{{60, 60, 0}, {61, 61, 1}}, 1.0F}};
  CuboidMap map = makeMap(0);
  map.replace(kAllCells, voxels);
  CuboidMapDisplay* display = add("");
  window().look(1.0, 0.7, 0.7);
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(map)));
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  window().updateFor(0.2);
  EXPECT_EQ(window().statistics().triangleCount, 0U);  // It is outside the picture.
  voxels.push_back({{{0, 0, 0}, {1, 1, 1}}, 1.0F});
  map.replace(kAllCells, voxels);
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(map, "more.cuboids")));
  EXPECT_TRUE(window().updateUntil([] { return window().statistics().triangleCount > 0; }, 10.0));
  delete display;
}

TEST_F(DisplayLife, drawsCoarserCellsWhileTheViewMovesWhereFramesAreSlow) {
  CuboidMapDisplay* display = add("");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap(makeTiles())));
  ASSERT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  const auto countTriangles = [](double yaw_rad) {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    window().look(200.0, yaw_rad, 0.7);
    window().update();
    return window().statistics().triangleCount;
  };
  const auto countAtRest = [&] {
    for (int i = 0; i < 8; ++i) (void)countTriangles(0.7);
    return countTriangles(0.7);
  };
  rviz::Property* finest_detail = display->subProp("Finest detail");
  finest_detail->setValue(0.0);
  const std::size_t whole = countAtRest();
  float pixels = 0.5F;  // With this size, twice as many make a difference.
  for (; pixels < 100.0F; pixels *= 2.0F) {
    finest_detail->setValue(2.0F * pixels);
    if (countAtRest() < whole) break;
  }
  finest_detail->setValue(pixels);
  EXPECT_EQ(countAtRest(), whole);
  EXPECT_LT(countTriangles(0.701), whole);
  EXPECT_EQ(countAtRest(), whole);
  delete display;
}

TEST_F(DisplayLife, uploadsNothingWhenASliceMovesInsideItsLayer) {
  CuboidMapDisplay* display = add("");
  display->subProp("Map file")->setValue(QString::fromStdString(writeMap()));
  display->subProp("Free")->setValue(true);
  display->subProp("Slice")->setValue(true);
  display->subProp("Slice")->subProp("Height")->setValue(0.05);
  const auto is_cut = [&] {
    return display->scene()->numWaiting() == 0 &&
           display->scene()->counts(FaceSet::kFreeSlice).faces > 0;
  };
  ASSERT_TRUE(window().updateUntil(is_cut));
  EXPECT_EQ(display->scene()->counts(FaceSet::kFree).faces, 0U);
  const std::uint64_t num_bytes = display->scene()->numUploadedBytes();
  display->subProp("Slice")->subProp("Height")->setValue(0.15);
  window().update();
  EXPECT_EQ(display->scene()->numUploadedBytes(), num_bytes);
  display->subProp("Slice")->subProp("Height")->setValue(-0.15);
  ASSERT_TRUE(window().updateUntil(is_cut));
  EXPECT_GT(display->scene()->numUploadedBytes(), num_bytes);
  delete display;
}

TEST_F(DisplayLife, saysThatThereIsNoTransformAndShowsTheMapWhenThereIs) {
  ros::NodeHandle nh("/no_tf");
  const ros::Publisher publisher = test::offer(nh, makeMap(5), "nowhere");
  CuboidMapDisplay* display = add("/no_tf");
  EXPECT_TRUE(window().updateUntil(
      [&] { return levelOf(*display, "Transform") == StatusProperty::Error; }));
  window().manager().setFixedFrame("nowhere");
  EXPECT_TRUE(window().updateUntil([&] {
    return levelOf(*display, "Transform") != StatusProperty::Error && isDrawn(*display);
  }));
  window().manager().setFixedFrame("map");
  delete display;
}

TEST_F(DisplayLife, survivesTopicsOfAnotherTypeAndNamesThatAreNone) {
  ros::NodeHandle nh("/wrong");
  ros::Publisher publisher = nh.advertise<std_msgs::String>("cuboid_map", 1, true);
  publisher.publish(std_msgs::String());
  CuboidMapDisplay* display = add("/wrong");
  EXPECT_TRUE(
      window().updateUntil([&] { return levelOf(*display, "Map") == StatusProperty::Warn; }));
  display->subProp("Topic namespace")->setValue("no name!");
  window().update();
  EXPECT_EQ(levelOf(*display, "Map"), StatusProperty::Error);
  delete display;
}

TEST_F(DisplayLife, survivesAnEmptyMapAndJumpsOfTime) {
  ros::NodeHandle nh("/empty");
  ros::Publisher publisher = test::offer(nh, makeMap(0), "map");
  CuboidMapDisplay* display = add("/empty");
  EXPECT_TRUE(window().updateUntil([&] { return levelOf(*display, "Map") == StatusProperty::Ok; }));
  EXPECT_EQ(display->scene()->counts(FaceSet::kOccupied).faces, 0U);
  publisher = test::offer(nh, makeMap(5), "map");
  for (int round = 0; round < 5; ++round) {
    window().manager().resetTime();  // rviz does this when time jumps back.
    window().update();
  }
  EXPECT_TRUE(window().updateUntil([&] { return isDrawn(*display); }));
  delete display;
}

}  // namespace
}  // namespace cuboid_mapping_rviz
