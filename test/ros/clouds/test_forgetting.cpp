// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/forgetting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::Occupancy;

/// First cell of a brick along x: brick 0 holds the cells 0 to 7, and so on.
Cell cellOf(int brick) { return {8 * brick, 0, 0}; }

NodeParameters makeParameters(double after_s, Forget forgotten = Forget::kAll) {
  NodeParameters parameters;
  parameters.source.forget_after_s = after_s;
  parameters.forget = forgotten;
  return parameters;
}

/// A map that forgets after 10 s.
class ForgettingTest : public ::testing::Test {
 protected:
  /// A cloud that hits all voxels of some bricks, whose stamp an empty cloud before it confirms.
  void see(double stamp_s, const std::vector<int>& bricks, std::size_t source = 0) {
    forgetting_.note({}, ros::Time(std::max(0.0, stamp_s - 0.001)), source);
    seeOnce(stamp_s, bricks, source);
  }
  void seeOnce(double stamp_s, const std::vector<int>& bricks, std::size_t source = 0) {
    cuboid_mapping::ScanUpdate update;
    for (const int brick : bricks) {
      update.bricks.emplace_back();
      update.bricks.back().brick = cellOf(brick);
      update.bricks.back().hits = BrickMask::all();
    }
    map_.apply(update);
    forgetting_.note(update, ros::Time(stamp_s), source);
    changes_ = forgetting_.forgetSome(map_);
  }

  [[nodiscard]] std::vector<int> known() const {
    std::vector<int> bricks;
    for (int brick = 0; brick < 5; ++brick) {
      if (map_.voxels().at(cellOf(brick)) != Occupancy::kUnknown) bricks.push_back(brick);
    }
    return bricks;
  }

  using Bricks = std::vector<int>;
  cuboid_mapping::CuboidMap map_;
  Forgetting forgetting_{makeParameters(10.0)};
  cuboid_mapping::ChangeSet changes_;
};

TEST_F(ForgettingTest, WhatIsNotSeenForSoLongBecomesUnknown) {
  see(1000.0, {0, 1, 2});
  see(1005.0, {1});
  see(1010.0, {2});
  EXPECT_EQ(known(), (Bricks{0, 1, 2})) << "not longer than the time";
  const std::uint64_t revision = map_.revision();
  see(1011.1, {2});
  EXPECT_EQ(known(), (Bricks{1, 2}));
  ASSERT_EQ(changes_.bricks.size(), 1U);
  EXPECT_EQ(changes_.bricks[0].brick, cellOf(0));
  EXPECT_TRUE(changes_.bricks[0].has_new_cuboids);
  EXPECT_EQ(changes_.revision, map_.revision());
  EXPECT_GT(map_.revision(), revision);
  see(1016.2, {2});
  EXPECT_EQ(known(), (Bricks{2}));
}

TEST_F(ForgettingTest, ComesBackWhenItIsSeenAgain) {
  see(1000.0, {0});
  see(1020.0, {1});
  EXPECT_EQ(known(), (Bricks{1}));
  see(1021.0, {0});
  EXPECT_EQ(known(), (Bricks{0, 1}));
  EXPECT_FLOAT_EQ(*map_.voxels().logOddsAt(cellOf(0)), map_.sensorModel().hit()) << "anew";
}

TEST_F(ForgettingTest, LockedVoxelsStay) {
  map_.lock(CellBox{{0, 0, 0}, {4, 8, 8}});
  map_.unlock(CellBox{{0, 0, 0}, {4, 8, 8}});
  see(1000.0, {0});
  map_.lock(CellBox{{0, 0, 0}, {4, 8, 8}});
  see(1020.0, {1});
  EXPECT_EQ(map_.voxels().at({3, 7, 7}), Occupancy::kOccupied);
  EXPECT_EQ(map_.voxels().at({4, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map_.voxels().numOccupiedVoxels(), 256.0 + 512.0);
}

TEST_F(ForgettingTest, OfOneClassLeavesTheOtherAsItWas) {
  using cuboid_mapping::UniformBox;
  const CellBox free_half{{0, 0, 0}, {8, 8, 4}};
  const CellBox occupied_half{{0, 0, 4}, {8, 8, 8}};
  for (const Forget forgotten : {Forget::kAll, Forget::kOccupied, Forget::kFree}) {
    map_.clear();
    forgetting_ = Forgetting(makeParameters(10.0, forgotten));
    see(1000.0, {0});
    (void)map_.replace(free_half, std::vector<UniformBox>{{free_half, -1.0F}});
    see(1020.0, {1});
    const bool stays_free = forgotten == Forget::kOccupied;
    const bool stays_occupied = forgotten == Forget::kFree;
    EXPECT_EQ(map_.voxels().logOddsAt(free_half.min).value_or(0.0F), stays_free ? -1.0F : 0.0F);
    EXPECT_EQ(map_.voxels().at(occupied_half.min),
              stays_occupied ? Occupancy::kOccupied : Occupancy::kUnknown);
    EXPECT_EQ(map_.voxels().numFreeVoxels(), stays_free ? 256.0 : 0.0);
    EXPECT_EQ(map_.voxels().numOccupiedVoxels(), 512.0 + (stays_occupied ? 256.0 : 0.0));
  }
}

TEST_F(ForgettingTest, OfOneClassForgetsWhatHasComeBack) {
  forgetting_ = Forgetting(makeParameters(10.0, Forget::kOccupied));
  see(1000.0, {0});
  see(1020.0, {1});
  EXPECT_EQ(known(), (Bricks{1}));
  see(1021.0, {0});
  see(1040.0, {1});
  EXPECT_EQ(known(), (Bricks{1})) << "time is counted again after the first was forgotten";
}

TEST_F(ForgettingTest, WhatNoCloudHasSeenStays) {
  (void)map_.replace(
      cuboid_mapping::brickBox(cellOf(3)),
      std::vector<cuboid_mapping::UniformBox>{{cuboid_mapping::brickBox(cellOf(3)), -1.0F}});
  see(1000.0, {0});
  see(1100.0, {1});
  EXPECT_EQ(known(), (Bricks{1, 3}));
}

TEST_F(ForgettingTest, BeginsAnewWhenStampsJumpBack) {
  see(1000.0, {0});
  see(50.0, {1});
  see(59.0, {1});
  EXPECT_EQ(known(), (Bricks{0, 1}));
  see(61.1, {1});
  EXPECT_EQ(known(), (Bricks{1}));
}

TEST_F(ForgettingTest, ManyAreForgottenSomeAtATimeButNotWhatIsSeenInBetween) {
  Bricks bricks(2500);
  std::iota(bricks.begin(), bricks.end(), 0);
  see(1000.0, bricks);
  see(1020.0, {});
  EXPECT_LT(changes_.bricks.size(), bricks.size()) << "others have the map in between";
  ASSERT_TRUE(forgetting_.hasDue());
  see(1020.5, bricks);
  while (forgetting_.hasDue()) forgetting_.forgetSome(map_);
  EXPECT_EQ(map_.voxels().size(), bricks.size());
  see(1040.0, {});
  while (forgetting_.hasDue()) forgetting_.forgetSome(map_);
  EXPECT_EQ(map_.voxels().size(), 0U);
}

TEST_F(ForgettingTest, NothingIsForgottenWithoutATimeOrAStamp) {
  forgetting_ = Forgetting(makeParameters(0.0));
  EXPECT_FALSE(forgetting_.isOn());
  see(1000.0, {0});
  see(1e6, {1});
  EXPECT_EQ(known(), (Bricks{0, 1}));
  forgetting_ = Forgetting(makeParameters(10.0));
  EXPECT_TRUE(forgetting_.isOn());
  see(0.0, {2});
  see(0.0, {3});
  EXPECT_EQ(known(), (Bricks{0, 1, 2, 3}));
}

TEST_F(ForgettingTest, EachSourceRemembersForATimeOfItsOwn) {
  NodeParameters parameters;
  for (const double after_s : {100.0, 10.0, 0.0}) {
    parameters.sources.push_back(makeParameters(after_s).source);
  }
  forgetting_ = Forgetting(parameters);
  see(1000.0, {0, 3}, 0);
  see(1000.0, {1, 3}, 1);
  see(1000.0, {2}, 2);
  see(1005.0, {0}, 1);
  see(1011.5, {4}, 2);
  EXPECT_EQ(known(), (Bricks{0, 2, 3, 4})) << "only the second source has seen block 1";
  see(1080.0, {3}, 1);
  see(1101.5, {4}, 2);
  EXPECT_EQ(known(), (Bricks{2, 4})) << "the first one has not seen block 3 for 100 s, either";
  see(1e6, {1}, 1);
  EXPECT_EQ(known(), (Bricks{1, 2, 4})) << "the third one never forgets";
  see(500.0, {0}, 1);
  see(509.0, {0}, 0);
  EXPECT_EQ(known(), (Bricks{0, 1, 2, 4}));
  see(519.5, {0}, 0);
  EXPECT_EQ(known(), (Bricks{0, 2, 4})) << "after a jump back all have as long as they had";
}

TEST_F(ForgettingTest, OneStampThatLeadsTheOthersForgetsNothing) {
  for (const double leading_s : {4.0, 48.0, 3600.0, 1e9}) {
    map_.clear();
    forgetting_ = Forgetting(makeParameters(10.0));
    seeOnce(1000.0, {0, 1});
    seeOnce(1000.5, {2});
    for (int twin = 0; twin < 2; ++twin) seeOnce(1000.6 + leading_s, {2});
    seeOnce(1000.7, {2});
    seeOnce(1000.8, {3});
    EXPECT_EQ(known(), (Bricks{0, 1, 2, 3})) << leading_s;
    for (double stamp_s = 1001.5; stamp_s < 1013.0; stamp_s += 0.75) seeOnce(stamp_s, {3});
    EXPECT_EQ(known(), Bricks{3}) << "and remembers nothing for longer";
  }
}

TEST_F(ForgettingTest, AStepOfTheStampsCountsOnceItIsConfirmed) {
  seeOnce(1000.0, {0, 1});
  seeOnce(1060.0, {1});
  EXPECT_EQ(known(), (Bricks{0, 1}));
  seeOnce(1060.1, {2});
  EXPECT_EQ(known(), (Bricks{1, 2})) << "block 1 was seen at 1060 s";
}

TEST_F(ForgettingTest, SourcesMayHaveClocksOfTheirOwn) {
  NodeParameters parameters;
  parameters.sources.resize(2, makeParameters(10.0).source);
  forgetting_ = Forgetting(parameters);
  for (int i = 0; i < 30; ++i) {
    seeOnce(5000.0 + 0.5 * i, {0}, 0);
    seeOnce(3800.0 + 0.5 * i, {i < 5 ? 1 : 2}, 1);
    EXPECT_TRUE(map_.voxels().at(cellOf(0)) == Occupancy::kOccupied) << i;
  }
  EXPECT_EQ(known(), (Bricks{0, 2})) << "block 1 was seen 12 s before";
}

TEST_F(ForgettingTest, VoxelsMayKeepTheirClassAsIfSeenOnce) {
  forgetting_ = Forgetting(makeParameters(10.0, Forget::kSeenOnce));
  for (int i = 0; i < 5; ++i) see(1000.0 + i, {0});
  const CellBox free_half{{0, 0, 0}, {8, 8, 4}};
  (void)map_.replace(
      free_half, std::vector<cuboid_mapping::UniformBox>{{free_half, map_.sensorModel().min()}});
  const CellBox locked{{0, 0, 7}, {8, 8, 8}};
  map_.lock(locked);
  see(1020.0, {1});
  const auto log_odds_at = [this](const Cell& cell) { return *map_.voxels().logOddsAt(cell); };
  const auto& model = map_.sensorModel();
  EXPECT_EQ(log_odds_at({0, 0, 5}), model.hit());
  EXPECT_EQ(log_odds_at({0, 0, 0}), model.miss());
  EXPECT_GT(log_odds_at(locked.min), 2.0F * model.hit());
  const std::uint64_t revision = map_.revision();
  see(1040.0, {});
  EXPECT_EQ(map_.revision(), revision) << "that is all";
}

TEST_F(ForgettingTest, InAnotherFrameABlockIsAsOldAsTheYoungestInIt) {
  const auto shift = [](double x) {
    return *cuboid_mapping::VoxelMotion::of(Eigen::Isometry3d(Eigen::Translation3d(x, 0, 0)), 1.0);
  };
  see(1000.0, {0});
  see(1005.0, {1});
  forgetting_ = forgetting_.moved(shift(8.0));  // Shifts by a block.
  see(1011.1, {3});
  EXPECT_EQ(known(), (Bricks{0, 3})) << "block 1 is what block 0 was";
  forgetting_ = forgetting_.moved(shift(4.0));  // Voxels of block 2 reach into block 3.
  see(1016.2, {4});
  EXPECT_EQ(known(), (Bricks{0, 3, 4}));
  see(1027.0, {0});
  EXPECT_EQ(known(), (Bricks{0}));
}

TEST_F(ForgettingTest, InAnotherFrameAStampIsConfirmedForTheBlocksThere) {
  seeOnce(1000.0, {0, 1, 2});
  seeOnce(1060.0, {1});
  forgetting_ = forgetting_.moved(
      *cuboid_mapping::VoxelMotion::of(Eigen::Isometry3d(Eigen::Translation3d(8, 0, 0)), 1.0));
  seeOnce(1060.1, {4});
  EXPECT_EQ(known(), (Bricks{0, 2, 4})) << "block 2 is what block 1 was; block 0 is not remembered";
}

}  // namespace
}  // namespace cuboid_mapping_ros
