// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/ray_query.h"

#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

/// A map at 0.5 m with y = z = 0: voxels x = 0 to 3 are free, x = 4 and 6 are occupied.
CuboidMap corridor() {
  MapConfig config;
  config.resolution_m = 0.5;
  CuboidMap map(config);
  ScanUpdate update;
  update.bricks.emplace_back();
  test::markBox(update.bricks[0].misses, {{0, 0, 0}, {4, 1, 1}});
  test::markBox(update.bricks[0].hits, CellBox::ofCell({4, 0, 0}));
  test::markBox(update.bricks[0].hits, CellBox::ofCell({6, 0, 0}));
  map.apply(update);
  return map;
}

/// Casts a ray along the corridor. `sign` is the sign of the direction.
RayQueryResult cast(double from_x_m, double sign, double max_range_m, UnknownPolicy policy) {
  const auto result = castRay(corridor(), {from_x_m, 0.25, 0.25}, {3.0 * sign, 0.0, 0.0},
                              max_range_m, policy, Budget::unlimited());
  if (result.isFound()) return *result;
  ADD_FAILURE() << "no result";
  return {};
}

TEST(RayQuery, endsOnTheFaceOfAnOccupiedCuboid) {
  for (const UnknownPolicy policy : {UnknownPolicy::kFree, UnknownPolicy::kObstacle}) {
    const RayQueryResult result = cast(0.25, 1.0, 10.0, policy);
    EXPECT_EQ(result.end, RayEnd::kOccupied);
    EXPECT_NEAR(result.distance_m, 1.75, 1e-12);
    EXPECT_TRUE(result.point_map.isApprox(Eigen::Vector3d(2.0, 0.25, 0.25)));
    EXPECT_EQ(result.unknown_length_m, 0.0);
    EXPECT_EQ(result.voxel, (Cell{4, 0, 0}));
  }
}

TEST(RayQuery, endsAtOnceInAnOccupiedCuboid) {
  for (const UnknownPolicy policy : {UnknownPolicy::kFree, UnknownPolicy::kObstacle}) {
    const RayQueryResult result = cast(2.25, 1.0, 10.0, policy);
    EXPECT_EQ(result.end, RayEnd::kOccupied);
    EXPECT_EQ(result.distance_m, 0.0);
    EXPECT_TRUE(result.point_map.isApprox(Eigen::Vector3d(2.25, 0.25, 0.25)));
    EXPECT_TRUE(result.voxel.has_value());
  }
}

TEST(RayQuery, endsAtItsMaxRangeWhenNothingIsInTheWay) {
  for (const UnknownPolicy policy : {UnknownPolicy::kFree, UnknownPolicy::kObstacle}) {
    const RayQueryResult result = cast(0.25, 1.0, 1.5, policy);
    EXPECT_EQ(result.end, RayEnd::kMaxRange);
    EXPECT_NEAR(result.distance_m, 1.5, 1e-12);
    EXPECT_TRUE(result.point_map.isApprox(Eigen::Vector3d(1.75, 0.25, 0.25)));
    EXPECT_FALSE(result.voxel.has_value());
  }
  EXPECT_EQ(cast(0.25, 1.0, 1.75, UnknownPolicy::kObstacle).end, RayEnd::kMaxRange)
      << "it only touches the occupied cuboid";
}

TEST(RayQuery, leavesTheMapIntoUnknownSpace) {
  const RayQueryResult stopped = cast(1.25, -1.0, 10.0, UnknownPolicy::kObstacle);
  EXPECT_EQ(stopped.end, RayEnd::kUnknown);
  EXPECT_NEAR(stopped.distance_m, 1.25, 1e-12);
  EXPECT_TRUE(stopped.point_map.isApprox(Eigen::Vector3d(0.0, 0.25, 0.25)));
  EXPECT_FALSE(stopped.voxel.has_value());
  const RayQueryResult passed = cast(1.25, -1.0, 10.0, UnknownPolicy::kFree);
  EXPECT_EQ(passed.end, RayEnd::kMaxRange);
  EXPECT_NEAR(passed.distance_m, 10.0, 1e-12);
  EXPECT_NEAR(passed.unknown_length_m, 8.75, 1e-12);
}

TEST(RayQuery, startsInUnknownSpaceByPolicy) {
  const RayQueryResult stopped = cast(-1.0, 1.0, 10.0, UnknownPolicy::kObstacle);
  EXPECT_EQ(stopped.end, RayEnd::kUnknown);
  EXPECT_EQ(stopped.distance_m, 0.0);
  const RayQueryResult passed = cast(-1.0, 1.0, 10.0, UnknownPolicy::kFree);
  EXPECT_EQ(passed.end, RayEnd::kOccupied);
  EXPECT_NEAR(passed.distance_m, 3.0, 1e-12);
  EXPECT_NEAR(passed.unknown_length_m, 1.0, 1e-12);
}

TEST(RayQuery, addsUpTheUnknownSpaceThatItPasses) {
  const auto result = castRay(corridor(), {2.75, 0.25, 0.25}, {1.0, 0.0, 0.0}, 10.0,
                              UnknownPolicy::kFree, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_EQ(result->end, RayEnd::kOccupied);
  EXPECT_NEAR(result->unknown_length_m, 0.25, 1e-12);
  EXPECT_EQ(result->voxel, (Cell{6, 0, 0}));
}

TEST(RayQuery, doesNotHitWhatItOnlyTouches) {
  // Rays along the far face of the corridor, and through an edge of the occupied voxel.
  const auto along = castRay(corridor(), {0.25, 0.5, 0.25}, {1.0, 0.0, 0.0}, 10.0,
                             UnknownPolicy::kFree, Budget::unlimited());
  ASSERT_TRUE(along.isFound());
  EXPECT_EQ(along->end, RayEnd::kMaxRange);
  EXPECT_NEAR(along->unknown_length_m, 10.0, 1e-12);
  const auto edge = castRay(corridor(), {1.75, 0.25, 0.25}, {1.0, 1.0, 0.0}, 10.0,
                            UnknownPolicy::kFree, Budget::unlimited());
  ASSERT_TRUE(edge.isFound());
  EXPECT_NEAR(edge->distance_m, 10.0, 1e-12);
  EXPECT_EQ(edge->end, RayEnd::kMaxRange);
}

TEST(RayQuery, doesNotDependOnTheLengthOfTheDirection) {
  for (const double length : {1e-300, 1e-9, 1.0, 1e9, 1e300}) {
    const auto result = castRay(corridor(), {0.25, 0.25, 0.25}, {length, 0.0, 0.0}, 10.0,
                                UnknownPolicy::kObstacle, Budget::unlimited());
    ASSERT_TRUE(result.isFound());
    EXPECT_EQ(result->end, RayEnd::kOccupied) << length;
    EXPECT_NEAR(result->distance_m, 1.75, 1e-12) << length;
  }
}

TEST(RayQuery, isNothingForWhatIsNoRay) {
  const CuboidMap map = corridor();
  const Eigen::Vector3d point(0.25, 0.25, 0.25);
  const Eigen::Vector3d direction(1.0, 0.0, 0.0);
  const auto is_nothing = [&map](const Eigen::Vector3d& origin, const Eigen::Vector3d& along,
                                 double max_range_m) {
    return !castRay(map, origin, along, max_range_m, UnknownPolicy::kFree, Budget::unlimited())
                .isFound() &&
           findFirstHit(map, origin, along, max_range_m, Budget::unlimited()).status ==
               AnswerStatus::kInvalid;
  };
  ASSERT_FALSE(is_nothing(point, direction, 10.0));
  EXPECT_TRUE(is_nothing(point, Eigen::Vector3d::Zero(), 10.0));
  EXPECT_TRUE(is_nothing(point, direction, 0.0));
  EXPECT_TRUE(is_nothing(point, direction, -1.0));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    EXPECT_TRUE(is_nothing({bad, 0.25, 0.25}, direction, 10.0)) << bad;
    EXPECT_TRUE(is_nothing(point, {1.0, bad, 0.0}, 10.0)) << bad;
    EXPECT_TRUE(is_nothing(point, direction, bad)) << bad;
  }
}

/// A search along a ray, in units of cells.
struct RaySearch {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double t_end;
};

struct RayPart {
  double first;
  double last;
  double tolerance;  ///< Bound of the rounding errors of both.
};

/// The part of a ray in a box; last < first when there is none.
RayPart findPart(const RaySearch& ray, const CellBox& box) {
  long double first = 0.0L;
  long double last = ray.t_end;
  double least_component = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const long double origin = ray.origin[axis];
    const long double direction = ray.direction[axis];
    if (direction == 0.0L) {
      if (origin < box.min[axis] || box.max[axis] <= origin) return {1.0, -1.0, 0.0};
      continue;
    }
    const long double a = (box.min[axis] - origin) / direction;
    const long double b = (box.max[axis] - origin) / direction;
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
    least_component = std::min(least_component, std::abs(ray.direction[axis]));
  }
  RayPart part{static_cast<double>(first), static_cast<double>(last), 0.0};
  part.tolerance = 1e-14 * ((100.0 + ray.origin.cwiseAbs().maxCoeff()) / least_component +
                            std::abs(part.first) + std::abs(part.last));
  return part;
}

/// A known voxel on a ray, in units of voxels.
struct Passed {
  double first;
  double last;
  Cell cell;
  float log_odds;
};

/// Whether a voxel is near the ray, to save time.
bool isNear(const RaySearch& ray, const Cell& cell) {
  for (int axis = 0; axis < 3; ++axis) {
    const double end = ray.origin[axis] + ray.t_end * ray.direction[axis];
    if (cell[axis] + 2.0 < std::min(ray.origin[axis], end)) return false;
    if (cell[axis] - 1.0 > std::max(ray.origin[axis], end)) return false;
  }
  return true;
}

/// Known voxels that a ray passes for more than a touch, in order.
std::vector<Passed> passedVoxels(const test::VoxelMap& voxels, const RaySearch& ray) {
  std::vector<Passed> passed;
  for (const auto& [cell, log_odds] : voxels.voxels()) {
    if (!isNear(ray, cell)) continue;
    const RayPart part = findPart(ray, CellBox::ofCell(cell));
    if (part.last - part.first >= 1e-9) passed.push_back({part.first, part.last, cell, log_odds});
  }
  std::sort(passed.begin(), passed.end(),
            [](const Passed& a, const Passed& b) { return a.first < b.first; });
  return passed;
}

/// Expected answer of castRay, in units of voxels.
struct Expected {
  RayEnd end;
  double distance;
  double unknown_length = 0.0;
  Cell cell = {};
  std::optional<double> first_unknown = {};
};

Expected stepThroughVoxels(const test::VoxelMap& voxels, const RaySearch& ray,
                           UnknownPolicy policy) {
  Expected expected{RayEnd::kMaxRange, ray.t_end};
  double at = 0.0;
  const auto pass_unknown = [&](double until) {
    if (until - at <= 1e-9) return true;
    if (!expected.first_unknown) expected.first_unknown = at;
    if (policy == UnknownPolicy::kObstacle) return false;
    expected.unknown_length += until - at;
    return true;
  };
  for (const Passed& voxel : passedVoxels(voxels, ray)) {
    if (!pass_unknown(voxel.first)) return {RayEnd::kUnknown, at, 0.0, {}, at};
    if (voxel.log_odds >= 0.0F) {
      return {RayEnd::kOccupied, voxel.first, expected.unknown_length, voxel.cell,
              expected.first_unknown};
    }
    at = voxel.last;
  }
  if (!pass_unknown(ray.t_end)) return {RayEnd::kUnknown, at, 0.0, {}, at};
  return expected;
}

/// A point in or near the map, in metres; one in four lies on voxel faces.
Eigen::Vector3d randomOrigin(Random& random, const Eigen::Vector3d& center) {
  Eigen::Vector3d point = test::randomPoint(random, 1.8);
  if (random.chance(0.25)) point = (point / 0.1).array().round().matrix() * 0.1;
  return center + point;
}

void checkRay(const ModelledMap& model, const Eigen::Vector3d& origin,
              const Eigen::Vector3d& direction, double range_m, UnknownPolicy policy,
              std::size_t* num_by_end) {
  const auto result = castRay(model.map, origin, direction, range_m, policy, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  const RaySearch ray{model.map.grid().toCellUnits(origin), direction.normalized(), range_m / 0.1};
  const Expected expected = stepThroughVoxels(model.voxels, ray, policy);
  ASSERT_EQ(result->end, expected.end);
  ASSERT_NEAR(result->distance_m, 0.1 * expected.distance, 1e-7);
  ASSERT_NEAR(result->unknown_length_m, 0.1 * expected.unknown_length, 1e-6);
  ASSERT_LT((result->point_map - origin - result->distance_m * direction.normalized()).norm(),
            1e-8);
  ASSERT_EQ(result->first_unknown_m.has_value(), expected.first_unknown.has_value());
  if (expected.first_unknown) {
    ASSERT_NEAR(*result->first_unknown_m, 0.1 * *expected.first_unknown, 1e-7);
  }
  ASSERT_EQ(result->voxel.has_value(), expected.end == RayEnd::kOccupied);
  if (result->voxel) {
    ASSERT_EQ(*result->voxel, expected.cell);
  }
  ++num_by_end[static_cast<std::size_t>(expected.end)];

  const Expected passing = stepThroughVoxels(model.voxels, ray, UnknownPolicy::kFree);
  const auto hit = findFirstHit(model.map, origin, direction, range_m, Budget::unlimited());
  const bool is_hit = passing.end == RayEnd::kOccupied;
  ASSERT_EQ(hit.status, is_hit ? AnswerStatus::kFound : AnswerStatus::kNotFound);
  if (!is_hit) return;
  ASSERT_EQ(hit->voxel, passing.cell);
  ASSERT_NEAR(hit->distance_m, 0.1 * passing.distance, 1e-7);
  ASSERT_LT((hit->point_map - origin - hit->distance_m * direction.normalized()).norm(), 1e-8);
}

TEST(RayQuery, agreesWithSteppingThroughVoxels) {
  Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_by_end[3] = {0, 0, 0};
  std::size_t num_in_occupied = 0;
  for (const Cell& offset : {Cell{0, 0, 0}, Cell{10000000, -10000000, 800}, Cell{-8, 0, 8}}) {
    MapConfig config;
    config.resolution_m = 0.1;
    config.rtree = {8, 3};
    const ModelledMap model = randomMap(random, config, offset);
    const Eigen::Vector3d center = 0.1 * Eigen::Vector3d(offset.x, offset.y, offset.z);
    for (int i = 0; i < 4000; ++i, ++num_cases) {
      const Eigen::Vector3d origin = randomOrigin(random, center);
      const Eigen::Vector3d direction = random.chance(0.3)
                                            ? Eigen::Vector3d(randomOrigin(random, center) - origin)
                                            : test::randomDirection(random);
      if (direction.norm() < 0.01) continue;
      const UnknownPolicy policy = i % 2 == 0 ? UnknownPolicy::kFree : UnknownPolicy::kObstacle;
      checkRay(model, origin, direction, random.real(0.01, 3.0), policy, num_by_end);
      ASSERT_FALSE(HasFailure()) << "from " << origin.transpose() << " along "
                                 << direction.transpose() << test::seedNote(num_cases);
      const auto cell = model.map.grid().toCell(origin);
      num_in_occupied += model.voxels.find(*cell).value_or(-1.0F) >= 0.0F ? 1 : 0;
    }
  }
  EXPECT_GE(num_by_end[0] + num_by_end[1] + num_by_end[2], 11900U);
  for (const std::size_t count : num_by_end) EXPECT_GT(count, num_cases / 100);
  EXPECT_GT(num_in_occupied, num_cases / 1000);
}

}  // namespace
}  // namespace cuboid_mapping
