// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_intake.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <boost/make_shared.hpp>

#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Clouds that go into an intake whose tf keeps 10 s, and what has become of them, by stamp.
class CloudIntakeTest : public ::testing::Test {
 protected:
  CloudIntakeTest() {
    parameters_.frame_id = "map";
    intake_ = std::make_unique<CloudIntake>(
        callbacks_, tf_, parameters_,
        CloudIntake::Callbacks{[this](const SensorMessage& cloud, const CloudPoses& /*poses*/) {
                                 handled_.push_back(cloud.header().stamp.toSec());
                               },
                               [this](std::size_t /*source*/, DropReason reason,
                                      const std::string& /*text*/) { drops_.push_back(reason); }});
  }

  void setTransform(double stamp_s) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.header.stamp.fromSec(stamp_s);
    transform.child_frame_id = "lidar";
    transform.transform.rotation.w = 1.0;
    tf_.setTransform(transform, "test");
  }
  void receive(double stamp_s) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->header.frame_id = "lidar";
    cloud->header.stamp.fromSec(stamp_s);
    intake_->receive({cloud}, now_);
    callAll();
  }
  /// Lets the node's clock go on.
  void pass(double duration_s) {
    now_ += ros::Duration(duration_s);
    intake_->update(now_);
    callAll();
  }
  void callAll() {
    while (callbacks_.callOne() == ros::CallbackQueue::Called) {
    }
  }
  /// A drive up to 120 s, with a cloud at its end, and one that comes much too late.
  void driveUntilALateCloud() {
    for (const double stamp_s : {110.0, 120.0}) setTransform(stamp_s);
    receive(119.0);
    receive(105.0);
  }

  NodeParameters parameters_;
  ros::CallbackQueue callbacks_;
  tf2::BufferCore tf_{ros::Duration(10.0)};
  ros::Time now_{1000.0};
  std::vector<double> handled_;
  std::vector<DropReason> drops_;
  std::unique_ptr<CloudIntake> intake_;
};

TEST_F(CloudIntakeTest, CloudsThatTfKnowsAreHandled) {
  for (const double stamp_s : {110.0, 120.0}) setTransform(stamp_s);
  for (const double stamp_s : {112.0, 111.0, 119.0}) receive(stamp_s);
  pass(0.1);
  EXPECT_EQ(handled_, (std::vector<double>{112.0, 111.0, 119.0}));
  EXPECT_TRUE(drops_.empty());
  EXPECT_EQ(intake_->numWaiting(), 0U);
}

TEST_F(CloudIntakeTest, ACloudThatWaitsForTfHasNoTurn) {
  receive(112.0);
  EXPECT_EQ(intake_->numWaiting(), 1U);
  EXPECT_FALSE(intake_->hasTurn());
  for (const double stamp_s : {110.0, 120.0}) setTransform(stamp_s);
  intake_->update(now_);
  EXPECT_TRUE(intake_->hasTurn());
  callAll();
  EXPECT_EQ(handled_, std::vector<double>{112.0});
  EXPECT_FALSE(intake_->hasTurn());
}

TEST_F(CloudIntakeTest, ACloudThatMayBeTheFirstAfterAJumpIsHeld) {
  driveUntilALateCloud();
  pass(0.5 * parameters_.tf_wait_s);
  EXPECT_EQ(intake_->numWaiting(), 1U);
  EXPECT_TRUE(drops_.empty());
  receive(105.5);  // The second one in a row: time has jumped, and tf is forgotten.
  for (const double stamp_s : {104.0, 106.0}) setTransform(stamp_s);
  pass(0.0);
  EXPECT_EQ(handled_, (std::vector<double>{119.0, 105.0, 105.5}));
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudIntakeTest, ACloudAfterWhichNoneComesIsNotHeldForLong) {
  driveUntilALateCloud();
  pass(1.1 * parameters_.tf_wait_s);
  EXPECT_EQ(intake_->numWaiting(), 0U);
  EXPECT_EQ(drops_, std::vector<DropReason>{DropReason::kTooOldForTf});
}

TEST_F(CloudIntakeTest, ALateCloudIsDroppedWhenTheNextOneIsInOrder) {
  driveUntilALateCloud();
  receive(119.5);
  EXPECT_EQ(handled_, (std::vector<double>{119.0, 119.5}));
  EXPECT_EQ(drops_, std::vector<DropReason>{DropReason::kTooOldForTf});
}

TEST_F(CloudIntakeTest, WithoutAHeldCloudTimePasses) {
  pass(0.1);
  pass(-1.0);
  pass(100.0);
  EXPECT_EQ(intake_->numWaiting(), 0U);
  EXPECT_FALSE(intake_->awaitsTf());
}

}  // namespace
}  // namespace cuboid_mapping_ros
