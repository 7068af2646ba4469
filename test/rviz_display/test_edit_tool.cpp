// SPDX-License-Identifier: BSD-3-Clause
// The tool that edits a box with the mouse, in a scene of rviz, and a node /panel/mapping with a map. Run by
// test_rviz_display.py, on a virtual screen.
#include "cuboid_mapping/GetLocks.h"
#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/SetBox.h"
#include "rviz_display/box_marker.h"
#include "rviz_display/rviz_window.h"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/geometry.h>
#include <rviz/properties/property.h>
#include <rviz/tool.h>
#include <rviz/tool_manager.h>

#include <OgreCamera.h>

#include <QKeyEvent>
#include <QMouseEvent>

#include <memory>

namespace cuboid_mapping_rviz {
namespace {

using cuboid_mapping::GetLocks;
using cuboid_mapping::QueryBox;
using cuboid_mapping::SetBox;

template <typename ServiceT>
typename ServiceT::Response call(const char* service, const typename ServiceT::Request& request) {
  ServiceT asked;
  asked.request = request;
  EXPECT_TRUE(ros::service::call(std::string("/panel/mapping/") + service, asked)) << service;
  return asked.response;
}

constexpr std::uint8_t kMixed = 9;

/// Class of the voxels that a box overlaps.
std::uint8_t classIn(const Ogre::Vector3& min, const Ogre::Vector3& max) {
  QueryBox::Request request;
  request.min = toPoint(min);
  request.max = toPoint(max);
  const auto in = call<QueryBox>("query_box", request);
  EXPECT_TRUE(in.success) << in.message;
  if (in.unknown_volume + in.occupied_volume == 0.0) return QueryBox::Response::FREE;
  if (in.unknown_volume + in.free_volume == 0.0) return QueryBox::Response::OCCUPIED;
  if (in.free_volume + in.occupied_volume == 0.0) return QueryBox::Response::UNKNOWN;
  return kMixed;
}

class EditToolTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { the_window = std::make_unique<test::RvizWindow>(QSize(640, 480)); }
  static void TearDownTestSuite() { the_window.reset(); }
  static test::RvizWindow& window() { return *the_window; }

  void SetUp() override {
    rviz::ToolManager* tools = window().manager().getToolManager();
    tool_ = tools->addTool("cuboid_mapping/EditBox");
    ASSERT_NE(tool_, nullptr);
    tools->setCurrentTool(tool_);
    set("Server", "/panel/mapping");
    connection_ = QObject::connect(&window().manager(), &rviz::VisualizationManager::statusUpdate,
                                   [this](const QString& text) { status_ = text.toStdString(); });
    window().look(15.0, 0.3, 1.2);
    window().updateFor(0.2);
  }
  void TearDown() override {
    QObject::disconnect(connection_);
    window().manager().getToolManager()->removeAll();
  }

  void set(const char* property, const QVariant& value) {
    tool_->getPropertyContainer()->subProp(property)->setValue(value);
  }
  double height() {
    return tool_->getPropertyContainer()->subProp("Height")->getValue().toDouble();
  }

  /// Pixel of a point of the map.
  static QPoint pixelOf(const Ogre::Vector3& point) {
    const auto at = rviz::project3DPointToViewportXY(window().panel().getViewport(), point);
    return {static_cast<int>(at.x), static_cast<int>(at.y)};
  }
  static void mouse(QEvent::Type type, const Ogre::Vector3& point,
                    Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    const bool is_move = type == QEvent::MouseMove;
    const bool is_up = type == QEvent::MouseButtonRelease;
    const QPoint at = pixelOf(point);
    QMouseEvent event(type, at, window().panel().mapToGlobal(at),
                      is_move ? Qt::NoButton : Qt::LeftButton,
                      is_up ? Qt::NoButton : Qt::LeftButton, modifiers);
    QApplication::sendEvent(&window().panel(), &event);
    window().update();
  }
  static void drag(const Ogre::Vector3& from, const Ogre::Vector3& to) {
    mouse(QEvent::MouseButtonPress, from);
    mouse(QEvent::MouseMove, 0.5F * (from + to));
    mouse(QEvent::MouseMove, to);
    mouse(QEvent::MouseButtonRelease, to);
  }
  static void press(int key) {
    QKeyEvent event(QEvent::KeyPress, key, Qt::NoModifier);
    QApplication::sendEvent(&window().panel(), &event);
  }
  /// Whether the tool shows a text within some seconds.
  bool says(const std::string& part) {
    return window().updateUntil([&] { return status_.find(part) != std::string::npos; }, 20.0);
  }
  /// Pixels in the color of the edges of locked boxes.
  static int numLockPixels() {
    const auto pixels = window().readPixels();
    int count = 0;
    for (std::size_t i = 0; i + 2 < pixels.size(); i += 3) {
      count += pixels[i] > 240 && pixels[i + 1] < 100 && pixels[i + 2] > 200 ? 1 : 0;
    }
    return count;
  }

  static inline std::unique_ptr<test::RvizWindow> the_window;  ///< One for all: rviz has one Ogre.
  rviz::Tool* tool_ = nullptr;
  std::string status_;
  QMetaObject::Connection connection_;
};

TEST_F(EditToolTest, SetsTheBoxThatIsDraggedOnTheGroundAndUndoesIt) {
  const Ogre::Vector3 min(1.1F, 0.7F, 0.5F);
  const Ogre::Vector3 max(2.5F, 1.7F, 0.7F);
  const auto before = classIn(min, max);
  set("Bottom", 0.4);
  set("Height", 0.4);
  for (const auto& [action, occupancy] :
       {std::pair("Occupied", QueryBox::Response::OCCUPIED), {"Free", QueryBox::Response::FREE}}) {
    set("Action", action);
    drag({2.7F, 0.5F, 0.0F}, {0.9F, 1.9F, 0.0F});
    EXPECT_TRUE(says(std::string(action) + ": done")) << status_;
    EXPECT_EQ(classIn(min, max), occupancy) << action;
  }
  press(Qt::Key_U);
  EXPECT_TRUE(says("1 more can be undone")) << status_;
  EXPECT_EQ(classIn(min, max), QueryBox::Response::OCCUPIED);
  press(Qt::Key_U);
  EXPECT_TRUE(says("0 more can be undone")) << status_;
  EXPECT_EQ(classIn(min, max), before);
  press(Qt::Key_U);
  EXPECT_TRUE(says("nothing to undo")) << status_;
  set("Server", "/nobody");
  drag({2.7F, 0.5F, 0.0F}, {0.9F, 1.9F, 0.0F});
  EXPECT_TRUE(says("nobody offers /nobody/set_box")) << status_;
}

TEST_F(EditToolTest, BeginsAtTheCuboidThatIsSeen) {
  rviz::Display* display = window().addDisplay("cuboid_mapping/CuboidMap");
  display->subProp("Topic namespace")->setValue("/panel");
  display->subProp("Server")->setValue("mapping");
  SetBox::Request block;
  block.occupancy = SetBox::Request::OCCUPIED;
  block.boxes.resize(1);
  block.boxes[0].min = toPoint({-1.0F, -1.0F, -0.2F});
  block.boxes[0].max = toPoint({1.0F, 1.0F, 3.0F});
  EXPECT_TRUE(call<SetBox>("set_box", block).info.success);
  window().updateFor(3.0);
  set("Action", "Free");
  set("Bottom", -0.5);
  set("Height", 0.4);
  drag({-0.5F, -0.5F, 3.0F}, {0.5F, 0.5F, 3.0F});
  EXPECT_TRUE(says("Free: done")) << status_;
  EXPECT_EQ(classIn({-0.4F, -0.4F, 2.6F}, {0.4F, 0.4F, 2.8F}), QueryBox::Response::FREE);
  EXPECT_EQ(classIn({-0.9F, -0.9F, 0.1F}, {0.9F, 0.9F, 2.3F}), QueryBox::Response::OCCUPIED);
}

TEST_F(EditToolTest, ShowsLockedBoxesAndUnlocks) {
  EXPECT_EQ(numLockPixels(), 0);
  set("Action", "Lock");
  drag({0.0F, -2.0F, 0.0F}, {2.0F, -1.2F, 0.0F});
  EXPECT_TRUE(window().updateUntil([] { return numLockPixels() > 50; }, 20.0));
  EXPECT_EQ(call<GetLocks>("get_locks", {}).boxes.size(), 1U);
  set("Action", "Unlock");
  drag({-0.5F, -2.5F, 0.0F}, {2.5F, 0.0F, 0.0F});
  EXPECT_TRUE(window().updateUntil([] { return numLockPixels() == 0; }, 20.0));
  EXPECT_TRUE(call<GetLocks>("get_locks", {}).boxes.empty());
}

TEST_F(EditToolTest, TakesTheHeightFromADragWithShiftAndIgnoresAClick) {
  const auto revision = call<GetLocks>("get_locks", {}).info.revision;
  set("Bottom", 0.0);
  mouse(QEvent::MouseButtonPress, {3.0F, 3.0F, 0.0F});
  mouse(QEvent::MouseMove, {3.0F, 3.0F, 1.5F}, Qt::ShiftModifier);
  EXPECT_NEAR(height(), 1.5, 0.1);
  mouse(QEvent::MouseButtonRelease, {3.0F, 3.0F, 1.5F});
  window().updateFor(0.5);
  EXPECT_EQ(call<GetLocks>("get_locks", {}).info.revision, revision);
}

}  // namespace
}  // namespace cuboid_mapping_rviz
