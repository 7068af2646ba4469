// SPDX-License-Identifier: BSD-3-Clause
// The panel beside a scene of rviz, and a node /panel/mapping with a map. Run by test_rviz_display.py, on a
// virtual screen.
#include "cuboid_mapping/QueryBox.h"
#include "rviz_display/box_marker.h"
#include "rviz_display/rviz_window.h"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/display_group.h>
#include <rviz/panel.h>
#include <rviz/panel_factory.h>

#include <QCheckBox>
#include <QLabel>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QTimer>

#include <filesystem>
#include <memory>

namespace cuboid_mapping_rviz {
namespace {

using cuboid_mapping::QueryBox;
using visualization_msgs::InteractiveMarkerFeedback;

class MapPanelTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { the_window = std::make_unique<test::RvizWindow>(QSize(320, 240)); }
  static void TearDownTestSuite() { the_window.reset(); }
  static test::RvizWindow& window() { return *the_window; }

  void SetUp() override {
    panel_.reset(factory_.make("cuboid_mapping/MapPanel"));
    panel_->initialize(&window().manager());
    child<QLineEdit>("server")->setText("/panel/mapping");
    panel_->show();
  }

  template <typename WidgetT>
  WidgetT* child(const char* name) {
    auto* found = panel_->findChild<WidgetT*>(name);
    EXPECT_NE(found, nullptr) << name;
    return found;
  }
  std::string text(const char* label) { return child<QLabel>(label)->text().toStdString(); }
  bool says(const char* label, const std::string& part) {
    return window().updateUntil([&] { return text(label).find(part) != std::string::npos; }, 30.0);
  }
  void click(const char* button) { child<QPushButton>(button)->click(); }

  /// Clicks a button that asks for confirmation, and answers. @return Whether it has asked.
  bool clickAndAnswer(const char* button, QMessageBox::StandardButton answer) {
    bool has_asked = false;
    QTimer::singleShot(200, [&] {
      auto* box = qobject_cast<QMessageBox*>(QApplication::activeModalWidget());
      if (box == nullptr) return;
      has_asked = true;
      box->button(answer)->click();
    });
    click(button);
    return has_asked;
  }

  /// Content of a box, by class.
  static QueryBox::Response ask(const Ogre::Vector3& min, const Ogre::Vector3& max) {
    QueryBox query;
    query.request.min = toPoint(min);
    query.request.max = toPoint(max);
    EXPECT_TRUE(ros::service::call("/panel/mapping/query_box", query));
    return query.response;
  }

  static inline std::unique_ptr<test::RvizWindow> the_window;  ///< One for all: rviz has one Ogre.
  rviz::PanelFactory factory_;
  std::unique_ptr<rviz::Panel> panel_;
};

TEST_F(MapPanelTest, ShowsTheStateOfTheNodeAndItsServicesAsButtons) {
  EXPECT_TRUE(says("figures", "revision ")) << text("state");

  click("pause");
  EXPECT_TRUE(says("answer", "clouds are ignored"));
  EXPECT_TRUE(
      window().updateUntil([&] { return child<QPushButton>("pause")->text() == "Resume"; }, 10.0));
  click("pause");
  EXPECT_TRUE(says("answer", "clouds are inserted again"));

  const std::string file = testing::TempDir() + "panel.cuboids";
  child<QLineEdit>("file")->setText(QString::fromStdString(file));
  click("save");
  EXPECT_TRUE(says("answer", " bytes")) << text("answer");
  EXPECT_GT(std::filesystem::file_size(file), 1000U);

  EXPECT_TRUE(clickAndAnswer("reset", QMessageBox::No));
  EXPECT_FALSE(text("answer").find("Reset") != std::string::npos);
  EXPECT_TRUE(clickAndAnswer("reset", QMessageBox::Yes));
  EXPECT_TRUE(says("answer", "the map is empty"));
  EXPECT_TRUE(says("figures", " 0 occupied"));
  EXPECT_TRUE(clickAndAnswer("load", QMessageBox::Yes));
  EXPECT_TRUE(says("answer", " cuboids"));
  EXPECT_TRUE(window().updateUntil(
      [&] { return text("figures").find(" 0 occupied") == std::string::npos; }, 10.0));
}

TEST_F(MapPanelTest, ClearsAndLocksTheBoxThatTheUserPulls) {
  click("lock");
  EXPECT_TRUE(says("answer", "show the box first"));
  child<QCheckBox>("box")->setChecked(true);
  rviz::DisplayGroup* displays = window().manager().getRootDisplayGroup();
  ASSERT_EQ(displays->numDisplays(), 1);
  EXPECT_EQ(displays->getDisplayAt(0)->getClassId(), "rviz/InteractiveMarkers");

  // The user moves the upper side along x to 3 m: rviz sends a message.
  ros::NodeHandle nh;
  const ros::Publisher feedback = nh.advertise<InteractiveMarkerFeedback>(
      std::string(BoxMarker::kTopic) + "/feedback", 1, true);
  InteractiveMarkerFeedback pull;
  pull.header.frame_id = "map";
  pull.client_id = "test";
  pull.marker_name = "x+";
  pull.event_type = InteractiveMarkerFeedback::POSE_UPDATE;
  pull.pose.position = toPoint({3.0F, 0.0F, 0.0F});
  pull.pose.orientation.w = 1.0;
  feedback.publish(pull);
  const double end_s = ros::WallTime::now().toSec() + 1.0;
  window().updateUntil([&] { return ros::WallTime::now().toSec() > end_s; });

  click("clear");
  EXPECT_TRUE(says("answer", "the box is free")) << text("answer");
  const QueryBox::Response cleared = ask({-1, -1, -1}, {3, 1, 1});
  EXPECT_EQ(cleared.occupied_volume, 0.0);
  EXPECT_EQ(cleared.unknown_volume, 0.0);
  EXPECT_GT(ask({3.2F, -1, -1}, {4, 1, 1}).unknown_volume, 0.0);
  click("lock");
  EXPECT_TRUE(says("answer", "clouds do not change the box"));
  EXPECT_TRUE(says("locks", "locked boxes: 1\n(-1, -1, -1) to (3, 1, 1) m")) << text("locks");
  click("unlock");
  EXPECT_TRUE(says("answer", "clouds change the box again"));
  EXPECT_TRUE(window().updateUntil([&] { return text("locks").empty(); }, 30.0)) << text("locks");
}

TEST_F(MapPanelTest, SaysWhenThereIsNoSuchServer) {
  child<QLineEdit>("server")->setText("/nobody");
  click("save");
  EXPECT_TRUE(says("answer", "nobody offers /nobody/save_map"));
  EXPECT_TRUE(says("state", "no diagnostics of /nobody"));
  child<QLineEdit>("server")->setText("no name!");
  click("save");
  EXPECT_TRUE(says("answer", "no name!"));
}

}  // namespace
}  // namespace cuboid_mapping_rviz
