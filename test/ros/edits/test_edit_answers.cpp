// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/map/edit_undo.h"

#include "ros/map_in_frame.h"
#include "support/snapshots.h"

#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::GetLocks;
using cuboid_mapping::Occupancy;
using cuboid_mapping::SetBox;

class EditAnswers : public test::MapInFrameTest {
 protected:
  static SetBox::Request makeRequest(std::uint8_t occupancy) {
    SetBox::Request request;
    request.boxes = {box({0.9, 0.0, 0.0}, {1.2, 1.0, 1.0})};
    request.occupancy = occupancy;
    return request;
  }
  Occupancy at(const cuboid_mapping::Cell& cell) {
    return map_.read([&](const CuboidMap& map, const ros::Time&) { return map.voxels().at(cell); });
  }
  std::map<cuboid_mapping::Cell, float> snapshot() {
    return map_.read(
        [](const CuboidMap& map, const ros::Time&) { return cuboid_mapping::test::voxelsOf(map); });
  }
  std::vector<CellBox> lockedBoxes() {
    return map_.read([](const CuboidMap& map, const ros::Time&) { return map.lockedBoxes(); });
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
  const auto response = answer<SetBox>(in_frame_, makeRequest(SetBox::Request::FREE));
  EXPECT_TRUE(response.info.success) << response.info.message;
  EXPECT_EQ(response.info.revision, 2U);
  EXPECT_EQ(response.info.header.stamp, ros::Time(7.0)) << "that of the last cloud";
  ASSERT_EQ(response.boxes.size(), 1U) << "one for each box";
  expectNear(response.boxes[0].min, 0.9, 0.0, 0.0);
  expectNear(response.boxes[0].max, 1.2, 1.0, 1.0);
  EXPECT_EQ(numOccupiedVoxels(), 0.0);
  EXPECT_EQ(numFreeVoxels(), 2000.0);

  EXPECT_TRUE(answer<SetBox>(in_frame_, makeRequest(SetBox::Request::UNKNOWN)).info.success);
  EXPECT_EQ(numFreeVoxels(), 1700.0);
  EXPECT_EQ(at({9, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(at({8, 0, 0}), Occupancy::kFree);
  EXPECT_TRUE(answer<SetBox>(in_frame_, makeRequest(SetBox::Request::OCCUPIED)).info.success);
  EXPECT_EQ(numOccupiedVoxels(), 300.0);
  EXPECT_EQ(at({12, 0, 0}), Occupancy::kFree);
}

TEST_F(EditAnswers, SetTheProbabilityWithinTheClampingThresholds) {
  const auto probabilityOf = [&](std::uint8_t occupancy, float probability) {
    auto request = makeRequest(occupancy);
    request.probability = probability;
    EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
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
  auto request = makeRequest(SetBox::Request::KEEP);
  request.lock = true;
  const auto response = answer<SetBox>(in_frame_, request);
  EXPECT_TRUE(response.info.success);
  EXPECT_EQ(response.info.revision, 1U) << "no voxel has changed";
  EXPECT_EQ(lockedBoxes(), (std::vector<CellBox>{{{9, 0, 0}, {12, 10, 10}}}));
  request.lock = false;
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
  EXPECT_TRUE(lockedBoxes().empty());
}

TEST_F(EditAnswers, AreUndoneOneByOneInEachClassWithTheirLocks) {
  auto request = makeRequest(SetBox::Request::KEEP);
  request.lock = true;
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
  const auto locked = lockedBoxes();
  const auto response = answer<GetLocks>(in_frame_, {});
  ASSERT_EQ(response.boxes.size(), 1U);
  expectNear(response.boxes[0].min, 0.9, 0.0, 0.0);
  expectNear(response.boxes[0].max, 1.2, 1.0, 1.0);
  const auto before = snapshot();
  for (const std::uint8_t occupancy :
       {SetBox::Request::FREE, SetBox::Request::OCCUPIED, SetBox::Request::UNKNOWN}) {
    EXPECT_TRUE(answer<SetBox>(in_frame_, makeRequest(occupancy)).info.success);
    EXPECT_TRUE(answer<GetLocks>(in_frame_, {}).boxes.empty());
    EXPECT_NE(snapshot(), before);
    EXPECT_TRUE(undoEdit(map_).success);
    EXPECT_EQ(snapshot(), before) << "occupancy " << int{occupancy};
    EXPECT_EQ(lockedBoxes(), locked);
  }
  EXPECT_EQ(undoEdit(map_).message, "undone; 0 more can be undone");
  EXPECT_TRUE(lockedBoxes().empty());
  const auto end = undoEdit(map_);
  EXPECT_FALSE(end.success);
  EXPECT_NE(end.message.find("nothing to undo"), std::string::npos) << end.message;
}

TEST_F(EditAnswers, AreUndoneAsAWholeWhereBoxesOverlapAndCloudsCameLater) {
  const auto before = snapshot();
  auto request = makeRequest(SetBox::Request::OCCUPIED);
  request.boxes.push_back(box({0.5, 0.0, 0.0}, {1.1, 1.0, 30.0}));
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
  map_.change(ros::Time(8.0), [](CuboidMap& map) {
    return map.replace({{10, 0, 0}, {11, 3, 10}}, {{{{10, 0, 0}, {11, 3, 10}}, 0.25F}});
  });
  EXPECT_TRUE(undoEdit(map_).success);
  EXPECT_EQ(snapshot(), before);
}

/// A correction of poses would keep the content of the boxes.
TEST_F(EditAnswers, LeaveNothingInTheHistoryOnceTheyAreUndone) {
  map_.setHistory(std::make_unique<KeptHistory>(map_.config(), 0.1 / 16, HistoryLimits()));
  map_.read([&](const CuboidMap& map) { map_.history()->restart(map); });
  KeptObservation observation;
  observation.cloud.stamp_ns = 1000000000;
  const std::vector<Eigen::Vector3f> points = {{1.05F, 0.05F, 0.05F}};
  const Eigen::Vector3d origin(0.05, 0.05, 0.05);
  observation.cloud.scans_body = {makeScan(Eigen::Isometry3d::Identity(), origin, points)};
  roundScan(observation.cloud.scans_body[0], 0.1 / 16);
  map_.history()->change(
      [&](MapHistory& history) { history.add(observation.cloud, observation.config); });
  const PoseTrack track({{0, Eigen::Isometry3d::Identity()},
                         {2000000000, Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.4, 0.0))}});
  const auto corrected = [&] {
    return cuboid_mapping::test::voxelsOf(map_.history()->whole().correct(track).map());
  };
  const auto expected = corrected();
  auto request = makeRequest(SetBox::Request::FREE);
  request.lock = true;
  const auto set = [&] { EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success); };
  set();
  EXPECT_NE(corrected(), expected);
  EXPECT_TRUE(undoEdit(map_).success);
  EXPECT_EQ(corrected(), expected);

  set();
  map_.editIn({{20, 0, 0}, {21, 1, 1}}, [](CuboidMap& map) {
    return map.replace({{20, 0, 0}, {21, 1, 1}}, {{{{20, 0, 0}, {21, 1, 1}}, 0.85F}});
  });
  EXPECT_TRUE(undoEdit(map_).success);
  EXPECT_NE(corrected(), expected) << "another edit came between";
}

TEST_F(EditAnswers, AreNotUndoneInAMapThatWasReplacedNorBeyondTheirNumber) {
  for (std::size_t i = 0; i <= EditUndo::kMaxEdits; ++i) {
    EXPECT_TRUE(answer<SetBox>(in_frame_, makeRequest(SetBox::Request::FREE)).info.success);
  }
  for (std::size_t i = 0; i < EditUndo::kMaxEdits; ++i) EXPECT_TRUE(undoEdit(map_).success);
  EXPECT_FALSE(undoEdit(map_).success);
  EXPECT_TRUE(answer<SetBox>(in_frame_, makeRequest(SetBox::Request::FREE)).info.success);
  map_.replaceAll([](CuboidMap& map, ros::Time& /*stamp*/) { return map.clear(); });
  EXPECT_FALSE(undoEdit(map_).success);
  EXPECT_EQ(numFreeVoxels(), 0.0);
}

TEST_F(EditAnswers, AreDroppedBeyondTheirBytesTheOldestFirst) {
  const CellBox brick{{0, 0, 0}, {8, 8, 8}};
  const CellBox room{{0, 0, 0}, {20, 10, 10}};
  EditUndo undo(300);
  map_.edit([&](CuboidMap& map, const ros::Time& /*stamp*/) {
    for (int i = 0; i < 4; ++i) {
      undo.begin();
      undo.keep(map, {});
      undo.keep(map, brick);
    }
    EXPECT_EQ(undo.size(), 4U);
    EXPECT_EQ(undo.nextBox(), brick);
    undo.begin();
    while (undo.size() > 1) undo.keep(map, brick);
    EXPECT_EQ(undo.size(), 1U);
    undo.keep(map, room);
    EXPECT_EQ(undo.size(), 0U);
    undo.keep(map, brick);  // Belongs to an edit that is too large.
    EXPECT_EQ(undo.size(), 0U);
    return undo.undoPart(map);
  });
}

TEST_F(EditAnswers, SetAllBoxesOrNone) {
  auto request = makeRequest(SetBox::Request::OCCUPIED);
  request.boxes.push_back(box({-1, 0, 0}, {0, 0.1, 0.1}));
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
  EXPECT_EQ(numOccupiedVoxels(), 310.0);
  request.occupancy = SetBox::Request::UNKNOWN;
  request.boxes[1].max.x = std::nan("");
  expectRefusal(answer<SetBox>(in_frame_, request), "boxes[1]");
  EXPECT_EQ(numOccupiedVoxels(), 310.0);
}

TEST_F(EditAnswers, SetManyBoxesInOneCall) {
  SetBox::Request request;
  request.occupancy = SetBox::Request::OCCUPIED;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d min(0.1 * (i % 10), 0.1 * (i / 10 % 10), 0.1 * (i / 100));
    request.boxes.push_back(box(min, min.array() + 0.1));
  }
  const auto response = answer<SetBox>(in_frame_, request);
  EXPECT_EQ(response.info.answered, 1000U);
  EXPECT_EQ(response.boxes.size(), 1000U);
  EXPECT_EQ(numOccupiedVoxels(), 1070.0);
}

TEST_F(EditAnswers, RefuseWhatCannotBeSet) {
  auto request = makeRequest(7);
  expectRefusal(answer<SetBox>(in_frame_, request), "occupancy is 7");
  request = makeRequest(SetBox::Request::FREE);
  request.probability = 0.6F;
  expectRefusal(answer<SetBox>(in_frame_, request), "probability is 0.6: use");
  request = makeRequest(SetBox::Request::OCCUPIED);
  request.probability = 1.0F;
  expectRefusal(answer<SetBox>(in_frame_, request), "probability");
  request.probability = -std::nanf("");
  expectRefusal(answer<SetBox>(in_frame_, request), "probability is NaN");
  request = makeRequest(SetBox::Request::FREE);
  request.boxes[0] = box({0.0, 0.0, 0.0}, {500.0, 500.0, 500.0});
  expectRefusal(answer<SetBox>(in_frame_, request),
                "the boxes contain 244140625 bricks of 8 x 8 x 8 voxels: at most 2000000 can");
  request.occupancy = SetBox::Request::UNKNOWN;
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success) << "costs nothing";
}

TEST_F(EditAnswers, RefusePlatesAndRodsOfTooManyBricks) {
  SetBox::Request request;
  request.occupancy = SetBox::Request::OCCUPIED;
  request.boxes = {box({0, 0, 0}, {5000, 5000, 0.1})};  // 2.5e9 voxels, one thick.
  expectRefusal(answer<SetBox>(in_frame_, request), "bricks");
  request.boxes = {box({0, 0, 0}, {3000000, 0.1, 0.1})};  // 3e7 voxels: 3.75e6 bricks.
  expectRefusal(answer<SetBox>(in_frame_, request), "bricks");
}

TEST_F(EditAnswers, LetCloudsInWhileALargeBoxIsSet) {
  in_frame_.limits.max_time_s = 600.0;  // A sanitizer is slow.
  SetBox::Request request;
  request.occupancy = SetBox::Request::OCCUPIED;
  request.lock = true;
  request.boxes = {box({10.3, 0.3, 0.3}, {40.1, 29.7, 20.2})};  // Not aligned to bricks.
  std::uint64_t first_revision = 0;
  std::uint64_t num_between = 0;
  std::atomic<bool> is_done{false};
  std::thread clouds([&] {
    while (!is_done) {
      map_.edit([&](CuboidMap& map, const ros::Time&) {
        if (first_revision == 0) first_revision = map.revision();
        num_between += map.revision() > first_revision ? 1 : 0;
        return cuboid_mapping::ChangeSet{map.revision(), false, {}};
      });
    }
  });
  const auto response = answer<SetBox>(in_frame_, request);
  is_done = true;
  clouds.join();
  EXPECT_TRUE(response.info.success) << response.info.message;
  EXPECT_FALSE(response.info.truncated);
  EXPECT_EQ(response.info.answered, 1U);
  EXPECT_GT(response.info.revision, 10U) << "in parts";
  map_.read([&](const CuboidMap& map, const ros::Time&) {
    EXPECT_EQ(map.voxels().numOccupiedVoxels(), 70.0 + 298.0 * 294.0 * 199.0);
    EXPECT_EQ(map.lockedBoxes().size(), 1U);
    return 0;
  });
}

TEST_F(EditAnswers, MakeALargeMapUnknownInParts) {
  SetBox::Request request;
  request.occupancy = SetBox::Request::FREE;
  request.boxes = {box({10.3, 0.3, 0.3}, {40.1, 29.7, 20.2})};
  const std::uint64_t first = answer<SetBox>(in_frame_, request).info.revision;
  const double num_free = numFreeVoxels();
  const double num_occupied = numOccupiedVoxels();
  request.occupancy = SetBox::Request::UNKNOWN;
  request.lock = true;
  request.boxes = {box({-5000, -5000, -500}, {5000, 5000, 500})};
  const auto response = answer<SetBox>(in_frame_, request);
  EXPECT_TRUE(response.info.success) << response.info.message;
  EXPECT_EQ(response.info.answered, 1U);
  EXPECT_GT(response.info.revision, first + 5);
  EXPECT_EQ(numFreeVoxels() + numOccupiedVoxels(), 0.0);
  EXPECT_EQ(lockedBoxes().size(), 1U);
  EXPECT_TRUE(undoEdit(map_).success);
  EXPECT_EQ(numFreeVoxels(), num_free);
  EXPECT_EQ(numOccupiedVoxels(), num_occupied);
}

}  // namespace
}  // namespace cuboid_mapping_ros
