// SPDX-License-Identifier: BSD-3-Clause
// Which camera_info belongs to a depth image.
#include "cuboid_mapping/ros/mapping/source_subscriber.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Notes the outcome of images and of camera_info, by their stamps.
class DepthPairsTest : public ::testing::Test {
 protected:
  using Pairs = std::vector<std::pair<double, double>>;

  void image(double stamp_s) {
    const auto message = boost::make_shared<sensor_msgs::Image>();
    message->header.stamp = ros::Time(stamp_s);
    pairs_.add(sensor_msgs::Image::ConstPtr(message));
  }
  void camera(double stamp_s) {
    const auto message = boost::make_shared<sensor_msgs::CameraInfo>();
    message->header.stamp = ros::Time(stamp_s);
    pairs_.add(sensor_msgs::CameraInfo::ConstPtr(message));
  }

  Pairs taken_;
  int num_dropped_ = 0;
  DepthPairs pairs_{{[this](const DepthImage& depth) {
                       taken_.emplace_back(depth.image->header.stamp.toSec(),
                                           depth.camera->header.stamp.toSec());
                     },
                     [this] { ++num_dropped_; }}};
};

TEST_F(DepthPairsTest, BringImageAndCameraOfOneStampTogether) {
  image(1.0);
  EXPECT_TRUE(taken_.empty());
  camera(1.0);
  camera(2.0);
  image(2.0);
  image(3.0);
  image(4.0);
  camera(3.0);
  camera(4.0);
  EXPECT_EQ(taken_, (Pairs{{1.0, 1.0}, {2.0, 2.0}, {3.0, 3.0}, {4.0, 4.0}}));
  camera(0.5);
  image(0.5);
  EXPECT_EQ(taken_.back(), Pairs::value_type(0.5, 0.5)) << "time has jumped back";
}

TEST_F(DepthPairsTest, TakeACameraInfoThatComesALittleLater) {
  for (int i = 1; i <= 20; ++i) {
    image(i);
    camera(i + 0.003);
    ASSERT_EQ(taken_.size(), static_cast<std::size_t>(i)) << "without waiting for the next";
    EXPECT_EQ(taken_.back().second, i + 0.003);
  }
  EXPECT_EQ(num_dropped_, 0);
}

TEST_F(DepthPairsTest, TakeACameraInfoWithoutStamp) {
  image(1.0);
  camera(0.0);
  for (int i = 2; i <= 20; ++i) image(i);
  EXPECT_EQ(taken_.size(), 20U);
}

TEST_F(DepthPairsTest, TakeACameraInfoThatComesOnce) {
  camera(0.5);
  for (int i = 1; i <= 20; ++i) image(i);
  EXPECT_EQ(taken_.size(), 20U);
  EXPECT_EQ(num_dropped_, 0);
  image(21.0);
  EXPECT_EQ(taken_.size(), 21U) << "at once";
}

TEST_F(DepthPairsTest, DropImagesWithoutAnyCameraInfo) {
  for (int i = 1; i <= 30; ++i) image(i);
  EXPECT_EQ(num_dropped_, 20);
  camera(100.0);
  EXPECT_EQ(taken_.size(), 10U) << "it comes late, but not too late for the last ones";
}

}  // namespace
}  // namespace cuboid_mapping_ros
