// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/edit_answers.h"

#include "ros/map_in_frame.h"

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::Occupancy;
using cuboid_mapping::SetBox;

class EditAnswers : public test::MapInFrameTest {
 protected:
  static SetBox::Request makeRequest(std::uint8_t occupancy) {
    SetBox::Request request;
    request.min = {point(0.9, 0.0, 0.0)};
    request.max = {point(1.2, 1.0, 1.0)};
    request.occupancy = occupancy;
    return request;
  }
  Occupancy at(const cuboid_mapping::Cell& cell) {
    return map_.read([&](const CuboidMap& map, const ros::Time&) { return map.voxels().at(cell); });
  }
  double numFreeVoxels() {
    return map_.read(
        [](const CuboidMap& map, const ros::Time&) { return map.voxels().numFreeVoxels(); });
  }
  double numOccupiedVoxels() {
    return map_.read(
        [](const CuboidMap& map, const ros::Time&) { return map.voxels().numOccupiedVoxels(); });
  }
};

TEST_F(EditAnswers, MakeABoxFreeOccupiedOrUnknownAndNothingElse) {
  const auto response = answerSetBox(in_frame_, makeRequest(SetBox::Request::FREE));
  EXPECT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.revision, 2U);
  EXPECT_EQ(response.header.stamp, ros::Time(7.0)) << "that of the last cloud";
  ASSERT_EQ(response.min.size(), 1U) << "one for each box";
  ASSERT_EQ(response.max.size(), 1U);
  expectNear(response.min[0], 0.9, 0.0, 0.0);
  expectNear(response.max[0], 1.2, 1.0, 1.0);
  EXPECT_EQ(numOccupiedVoxels(), 0.0);
  EXPECT_EQ(numFreeVoxels(), 2000.0);

  EXPECT_TRUE(answerSetBox(in_frame_, makeRequest(SetBox::Request::UNKNOWN)).success);
  EXPECT_EQ(numFreeVoxels(), 1700.0);
  EXPECT_EQ(at({9, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(at({8, 0, 0}), Occupancy::kFree);
  EXPECT_TRUE(answerSetBox(in_frame_, makeRequest(SetBox::Request::OCCUPIED)).success);
  EXPECT_EQ(numOccupiedVoxels(), 300.0);
  EXPECT_EQ(at({12, 0, 0}), Occupancy::kFree);
}

TEST_F(EditAnswers, SetTheProbabilityWithinTheClampingThresholds) {
  const auto probabilityOf = [&](std::uint8_t occupancy, float probability) {
    auto request = makeRequest(occupancy);
    request.probability = probability;
    EXPECT_TRUE(answerSetBox(in_frame_, request).success);
    return map_.read([](const CuboidMap& map, const ros::Time&) {
      const auto log_odds = map.voxels().logOddsAt({10, 0, 0});
      return log_odds ? cuboid_mapping::toProbability(*log_odds) : -1.0;
    });
  };
  EXPECT_NEAR(probabilityOf(SetBox::Request::FREE, 0.0F), 0.12, 1e-5);
  EXPECT_NEAR(probabilityOf(SetBox::Request::OCCUPIED, 0.0F), 0.97, 1e-5);
  EXPECT_NEAR(probabilityOf(SetBox::Request::FREE, 0.3F), 0.3, 1e-5);
  EXPECT_NEAR(probabilityOf(SetBox::Request::FREE, 0.01F), 0.12, 1e-5);
  EXPECT_NEAR(probabilityOf(SetBox::Request::OCCUPIED, 0.8F), 0.8, 1e-5);
}

TEST_F(EditAnswers, LockAndUnlock) {
  const auto lockedBoxes = [&] {
    return map_.read([](const CuboidMap& map, const ros::Time&) { return map.lockedBoxes(); });
  };
  auto request = makeRequest(SetBox::Request::KEEP);
  request.lock = true;
  const auto response = answerSetBox(in_frame_, request);
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.revision, 1U) << "no voxel has changed";
  EXPECT_EQ(lockedBoxes(), (std::vector<CellBox>{{{9, 0, 0}, {12, 10, 10}}}));
  request.lock = false;
  EXPECT_TRUE(answerSetBox(in_frame_, request).success);
  EXPECT_TRUE(lockedBoxes().empty());
}

TEST_F(EditAnswers, SetAllBoxesOrNone) {
  auto request = makeRequest(SetBox::Request::OCCUPIED);
  request.min.push_back(point(-1, 0, 0));
  request.max.push_back(point(0, 0.1, 0.1));
  EXPECT_TRUE(answerSetBox(in_frame_, request).success);
  EXPECT_EQ(numOccupiedVoxels(), 310.0);
  request.occupancy = SetBox::Request::UNKNOWN;
  request.max[1].x = std::nan("");
  expectRefusal(answerSetBox(in_frame_, request), "box 1");
  EXPECT_EQ(numOccupiedVoxels(), 310.0);
}

TEST_F(EditAnswers, RefuseWhatCannotBeSet) {
  auto request = makeRequest(7);
  expectRefusal(answerSetBox(in_frame_, request), "occupancy is 7");
  request = makeRequest(SetBox::Request::FREE);
  request.probability = 0.6F;
  expectRefusal(answerSetBox(in_frame_, request), "probability");
  request = makeRequest(SetBox::Request::OCCUPIED);
  request.probability = 1.0F;
  expectRefusal(answerSetBox(in_frame_, request), "probability");
  request.probability = -std::nanf("");
  expectRefusal(answerSetBox(in_frame_, request), "probability is NaN");
  request = makeRequest(SetBox::Request::FREE);
  request.min[0] = point(0.0, 0.0, 0.0);
  request.max[0] = point(500.0, 500.0, 500.0);
  expectRefusal(answerSetBox(in_frame_, request),
                "the boxes contain 244140625 bricks of 8 x 8 x 8 voxels: at most 2000000 can");
  request.occupancy = SetBox::Request::UNKNOWN;
  EXPECT_TRUE(answerSetBox(in_frame_, request).success) << "costs nothing";
}

}  // namespace
}  // namespace cuboid_mapping_ros
