// SPDX-License-Identifier: BSD-3-Clause
// Objects that live on when a call has had no memory: the call made again gives the right answer, and so do all later
// ones.
#include "cuboid_mapping/query/distance_field.h"
#include "cuboid_mapping/query/sphere_query.h"
#include "cuboid_mapping/scan/void_space.h"
#include "cuboid_mapping/sharing/observation_order.h"
#include "cuboid_mapping/sharing/shared_map_follower.h"
#include "fault_campaign.h"
#include "support/random_bricks.h"
#include "support/snapshots.h"

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::campaign {
namespace {

using test::Random;

/// Few calls of these objects need memory: nearly all are tried.
constexpr std::size_t kManyTrials = 80;

ScanUpdate someUpdate(Random& random, int num_bricks = 12) {
  return test::randomUpdate(random, {{-4, -4, -4}, {4, 4, 4}}, num_bricks);
}

/// A map of many bricks with obstacles.
CuboidMap someMap() {
  MapConfig config;
  config.resolution_m = 0.25;
  CuboidMap map(config);
  Random random(21);
  for (int i = 0; i < 6; ++i) map.apply(someUpdate(random, 200));
  return map;
}

/// Small balls in every second voxel, in a random order.
std::vector<Sphere> manySpheres(const CuboidMap& map) {
  std::vector<Sphere> spheres;
  test::visitCells({{-16, -16, -16}, {16, 16, 16}}, [&](const Cell& cell) {
    spheres.push_back({map.grid().centerOf(CellBox::ofCell(cell + cell)), 0.05});
  });
  std::shuffle(spheres.begin(), spheres.end(), std::mt19937(22));
  return spheres;
}

TEST(ObjectFaults, aSphereCheckerFindsWhatIsThere) {
  const Trial trial = [](const Act& act) -> std::string {
    const CuboidMap map = someMap();
    const std::vector<Sphere> spheres = manySpheres(map);
    const auto expected =
        SphereChecker(map, UnknownPolicy::kFree, Budget::unlimited()).check(spheres);
    SphereChecker checker(map, UnknownPolicy::kFree, Budget::unlimited());
    std::vector<AnswerStatus> answers;
    if (act([&] { answers = checker.check(spheres); })) answers = checker.check(spheres);
    return answers == expected ? "" : "other answers";
  };
  EXPECT_GT(expectNothingWrong("check spheres", FaultKind::kMemory, trial, kManyTrials), 0U);
}

TEST(ObjectFaults, aDistanceFieldIsThatOfTheMap) {
  const Trial trial = [](const Act& act) -> std::string {
    CuboidMap map = someMap();
    constexpr CellBox kRegion{{-20, -20, -20}, {20, 20, 20}};
    DistanceField field(map, kRegion, 2.0, UnknownPolicy::kFree);
    Random random(23);
    const ChangeSet changes = map.apply(someUpdate(random));
    if (act([&] { field.update(map, changes); })) field.update(map, changes);
    const ChangeSet later = map.apply(someUpdate(random));
    field.update(map, later);
    const DistanceField expected(map, kRegion, 2.0, UnknownPolicy::kFree);
    std::string wrong;
    test::visitCells(kRegion, [&](const Cell& cell) {
      const Eigen::Vector3d center_map = map.grid().centerOf(CellBox::ofCell(cell));
      if (field.distanceAt(center_map) != expected.distanceAt(center_map)) wrong = "a distance";
    });
    return wrong;
  };
  EXPECT_GT(expectNothingWrong("update distances", FaultKind::kMemory, trial, kManyTrials), 0U);
}

TEST(ObjectFaults, voidSpaceIsForgottenAsAWhole) {
  const Trial trial = [](const Act& act) -> std::string {
    ScanUpdate update;
    for (std::int32_t x = 0; x < 40; ++x) {
      update.bricks.push_back({{8 * x, 0, 0}, {}, BrickMask::all()});
    }
    VoidSpace plain;
    plain.add(update);
    VoidSpace space;
    if (act([&] { space.add(update); })) space.forgetOutside({{-9, -9, -9}, {-8, -8, -8}}, 0);
    if (space.numBricks() != 0 && space.numBricks() != plain.numBricks()) return "it stays";
    space.add(update);
    return space.numBricks() == plain.numBricks() ? "" : "another space";
  };
  EXPECT_GT(expectNothingWrong("add void space", FaultKind::kMemory, trial, kManyTrials), 0U);
}

RobotObservation observationOf(std::uint64_t sequence) {
  RobotObservation observation;
  observation.robot = "a robot whose name is longer than what a string holds without memory";
  observation.session = 1;
  observation.sequence = sequence;
  observation.stamp_ns = 100'000'000 * static_cast<std::int64_t>(sequence);
  return observation;
}

/// In the order of arrival: gaps that are filled later, and one observation twice.
constexpr std::uint64_t kArrivals[] = {1, 2, 5, 4, 7, 9, 3, 4, 8, 6, 12, 11, 10};

TEST(ObjectFaults, anObservationIsReleasedOnce) {
  const Trial trial = [](const Act& act) -> std::string {
    ObservationOrder order(0.2);
    std::vector<std::uint64_t> released;
    double now_s = 0.0;
    const auto release = [&](double seconds) {
      now_s += seconds;
      for (const RobotObservation& due : order.takeDue(now_s)) released.push_back(due.sequence);
    };
    for (const std::uint64_t sequence : kArrivals) {
      const auto put = [&] { (void)order.put(observationOf(sequence), now_s); };
      if (sequence == 3 || sequence == 6) {
        if (act(put)) put();  // It is sent again.
      } else {
        put();
      }
    }
    release(10.0);
    std::vector<std::uint64_t> expected;
    for (std::uint64_t sequence = 1; sequence <= 12; ++sequence) expected.push_back(sequence);
    if (released != expected) return std::to_string(released.size()) + " are released";
    return order.findQuestions(now_s).at(0).first == 13 ? "" : "asks for one that it has";
  };
  EXPECT_GT(expectNothingWrong("put an observation", FaultKind::kMemory, trial, kManyTrials), 0U);
}

TEST(ObjectFaults, observationsThatAreDueAreNotLost) {
  const Trial trial = [](const Act& act) -> std::string {
    ObservationOrder order(0.2);
    for (const std::uint64_t sequence : kArrivals) (void)order.put(observationOf(sequence), 0.0);
    std::vector<RobotObservation> due;
    if (act([&] { due = order.takeDue(10.0); })) due = order.takeDue(10.0);
    if (order.counts().num_late != 0) return "some count as late";
    return due.size() == 12 ? "" : std::to_string(due.size()) + " are released";
  };
  EXPECT_GT(expectNothingWrong("take observations", FaultKind::kMemory, trial, kManyTrials), 0U);
}

TEST(ObjectFaults, aSharedFollowerGoesOnlyOn) {
  const Trial trial = [](const Act& act) -> std::string {
    CuboidMap map = someMap();
    SharedMapFollower follower;
    (void)follower.take(makeImage(map, 3, MapDetail::kValues));
    Random random(24);
    std::vector<SharedMapFollower::Version> readers;
    const auto next = [&] {
      const std::uint64_t base = map.revision();
      return makeDelta(map, map.apply(someUpdate(random)), 3, base, MapDetail::kValues);
    };
    std::string wrong;
    const auto take = [&](const MapDelta& delta) {
      const FollowResult result = follower.take(delta);
      if (result != FollowResult::kApplied && result != FollowResult::kOld) wrong = "refused";
    };
    for (int step = 0; step < 8; ++step) {
      readers.push_back(follower.read());
      if (step > 3) readers.erase(readers.begin(), readers.begin() + 2);
      const MapDelta delta = next();
      if (step == 4) {
        if (act([&] { take(delta); })) take(delta);
      } else {
        take(delta);
      }
      if (follower.read()->revision() != map.revision()) wrong = "goes back";
    }
    if (test::voxelsOf(*follower.read()->map()) != test::voxelsOf(map)) wrong = "another map";
    return wrong;
  };
  EXPECT_GT(expectNothingWrong("share changes", FaultKind::kMemory, trial, kManyTrials), 0U);
}

}  // namespace
}  // namespace cuboid_mapping::campaign
