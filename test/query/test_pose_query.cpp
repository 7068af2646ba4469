// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_query.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "support/bodies.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Edge of a voxel. Lengths of the tests are in voxels of 0.25 m, so that nothing is rounded.
constexpr double kEdge_m = 0.25;
constexpr CellBox kPoseArea{{-24, -24, -16}, {24, 24, 16}};

MapConfig poseConfig() {
  MapConfig config;
  config.resolution_m = kEdge_m;
  return config;
}

/// The half-space n * x <= distance.
struct HalfSpace {
  Eigen::Vector3d normal;
  double distance;
};

/// The half-spaces of a box.
void append(std::vector<HalfSpace>& all, const Eigen::Vector3d& center, const Eigen::Matrix3d& turn,
            const Eigen::Vector3d& half) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d normal = sign * turn.col(axis);
      all.push_back({normal, normal.dot(center) + half[axis]});
    }
  }
}

/// Radius of the largest ball inside all half-spaces; negative: none. It touches four of them.
double radiusInside(const std::vector<HalfSpace>& all) {
  double best = -std::numeric_limits<double>::infinity();
  const std::size_t n = all.size();
  const auto row = [&](std::size_t i) {
    return Eigen::RowVector4d(all[i].normal.x(), all[i].normal.y(), all[i].normal.z(), 1.0);
  };
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      for (std::size_t c = b + 1; c < n; ++c) {
        for (std::size_t d = c + 1; d < n; ++d) {
          Eigen::Matrix4d rows;
          rows << row(a), row(b), row(c), row(d);
          if (std::abs(rows.determinant()) < 1e-9) continue;
          const Eigen::Vector4d ball =
              rows.inverse() *
              Eigen::Vector4d(all[a].distance, all[b].distance, all[c].distance, all[d].distance);
          const bool is_inside = std::all_of(all.begin(), all.end(), [&](const HalfSpace& half) {
            return half.normal.dot(ball.head<3>()) + ball[3] <= half.distance + 1e-9;
          });
          if (is_inside) best = std::max(best, ball[3]);
        }
      }
    }
  }
  return best;
}

/// Depth of a part in a voxel; <= 0: outside.
///@{
double depthOf(const BodySphere& sphere, const Eigen::Isometry3d& pose, const Cell& voxel) {
  const Eigen::Vector3d center = pose * sphere.center_body / kEdge_m;
  const Eigen::Vector3d low = toVector(voxel);
  const Eigen::Vector3d nearest = center.cwiseMax(low).cwiseMin((low.array() + 1.0).matrix());
  return sphere.radius_m / kEdge_m - (center - nearest).norm();
}
double depthOf(const BodyBox& box, const Eigen::Isometry3d& pose, const Cell& voxel) {
  const Eigen::Isometry3d placed = pose * box.T_body_box;
  const Eigen::Vector3d center = placed.translation() / kEdge_m;
  const Eigen::Vector3d voxel_center = toVector(voxel).array() + 0.5;
  const Eigen::Vector3d half = 0.5 * box.size_m / kEdge_m;
  if ((center - voxel_center).norm() > half.norm() + 1.0) return -1.0;
  std::vector<HalfSpace> all;
  append(all, center, placed.linear(), half);
  append(all, voxel_center, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(0.5));
  return radiusInside(all);
}
///@}

double depthOfPart(const Body& body, std::size_t part, const Eigen::Isometry3d& pose,
                   const Cell& voxel) {
  return part < body.spheres.size()
             ? depthOf(body.spheres[part], pose, voxel)
             : depthOf(body.boxes.at(part - body.spheres.size()), pose, voxel);
}

/// Voxels around a part, slightly more than it can meet.
CellBox cellsAround(const Body& body, std::size_t part, const Eigen::Isometry3d& pose) {
  Eigen::Vector3d center_body;
  double reach_m = 0.0;
  if (part < body.spheres.size()) {
    center_body = body.spheres[part].center_body;
    reach_m = body.spheres[part].radius_m;
  } else {
    const BodyBox& box = body.boxes.at(part - body.spheres.size());
    center_body = box.T_body_box.translation();
    reach_m = 0.5 * box.size_m.norm();
  }
  const Eigen::Vector3d center_map = pose * center_body;
  return *Grid(kEdge_m).toCellBox(
      boxAround(center_map, Eigen::Vector3d::Constant(2.0 * (reach_m + kEdge_m))));
}

/// Greatest depth of a part in an obstacle, voxel by voxel, or one that is clearly positive.
double depthInObstacles(const CuboidMap& map, UnknownPolicy policy, const Body& body,
                        std::size_t part, const Eigen::Isometry3d& pose) {
  double depth = -1.0;
  test::visitCells(cellsAround(body, part, pose), [&](const Cell& cell) {
    const Occupancy occupancy = map.voxels().at(cell);
    const bool is_in_the_way =
        occupancy == Occupancy::kOccupied ||
        (occupancy == Occupancy::kUnknown && policy == UnknownPolicy::kObstacle);
    if (is_in_the_way && depth < 1e-3) {
      depth = std::max(depth, depthOfPart(body, part, pose, cell));
    }
  });
  return depth;
}

TEST(PoseQuery, FindsEveryVoxelThatABodyMeets) {
  Random random(3940);
  int num_free = 0;
  int num_blocked = 0;
  for (int round = 0; round < 300; ++round) {
    const CuboidMap map = test::mapOfUpdates(random, 6, poseConfig());
    const UnknownPolicy policy =
        random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const Body body = test::randomBody(random, kEdge_m);
    std::vector<Eigen::Isometry3d> poses;
    poses.reserve(5);
    for (int i = 0; i < 5; ++i) poses.push_back(test::randomTurnedPose(random, 2.5));
    const std::vector<Answer<PoseContact>> results =
        checkPoses(map, body, poses, policy, Budget::unlimited());
    ASSERT_EQ(results.size(), poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      double depth = -1.0;
      const std::size_t num_parts = body.spheres.size() + body.boxes.size();
      for (std::size_t part = 0; part < num_parts; ++part) {
        depth = std::max(depth, depthInObstacles(map, policy, body, part, poses[i]));
      }
      if (std::abs(depth) < 1e-5) continue;  // It only touches.
      EXPECT_EQ(results[i].isNotFound(), depth < 0.0)
          << "round " << round << ", pose " << i << ", depth " << depth;
      depth < 0.0 ? ++num_free : ++num_blocked;
      EXPECT_EQ(results[i].isFound(), !results[i].isNotFound());
      if (!results[i].isFound()) continue;
      const PoseContact& contact = *results[i];
      EXPECT_GT(depthOfPart(body, contact.part, poses[i], contact.voxel), 0.0);
      const Occupancy met = map.voxels().at(contact.voxel);
      EXPECT_TRUE(met == Occupancy::kOccupied ||
                  (met == Occupancy::kUnknown && policy == UnknownPolicy::kObstacle));
    }
  }
  EXPECT_GT(num_free, 200);
  EXPECT_GT(num_blocked, 200);
}

TEST(PoseQuery, AgreesWithABoxThatDoesNotTurn) {
  Random random(3941);
  for (int round = 0; round < 200; ++round) {
    const CuboidMap map = test::mapOfUpdates(random, 6, poseConfig());
    // Faces lie on faces of voxels, up to rounding.
    const CellBox cells = test::randomBoxInside(random, kPoseArea);
    MetricBox box = map.grid().toMetricBox(cells);
    box.min_m.array() += 1e-8;
    Body body;
    body.boxes.emplace_back();
    body.boxes[0].size_m = box.max_m - box.min_m;
    Eigen::Isometry3d pose(Eigen::Translation3d(0.5 * (box.min_m + box.max_m)));
    // Half of the boxes lie on their side.
    if (random.chance(0.5)) {
      pose.rotate(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
      std::swap(body.boxes[0].size_m.x(), body.boxes[0].size_m.y());
    }
    for (const UnknownPolicy policy : {UnknownPolicy::kObstacle, UnknownPolicy::kFree}) {
      EXPECT_EQ(checkPoses(map, body, {pose}, policy, Budget::unlimited())[0].isNotFound(),
                isFree(map, box, policy, Budget::unlimited()))
          << "round " << round;
    }
  }
}

/// A free room of 8 m with a post of one voxel in its middle.
CuboidMap makeRoom() {
  CuboidMap map(poseConfig());
  map.replace(kAllCells,
              {{{{-16, -16, -16}, {16, 16, 16}}, -1.0F}, {{{0, 0, -16}, {1, 1, 16}}, 1.0F}});
  return map;
}

Body makeBase() { return test::boxBody({2.0, 0.5, 0.5}); }

Eigen::Isometry3d yawed(double x, double y, double yaw) { return test::yawed({x, y, 0.0}, yaw); }

TEST(PoseQuery, LetsALongBasePassOnlyWhenItTurns) {
  const CuboidMap room = makeRoom();
  const auto results =
      checkPoses(room, makeBase(), {yawed(0.125, 0.8, M_PI / 2), yawed(0.125, 0.8, 0.0)},
                 UnknownPolicy::kObstacle, Budget::unlimited());
  ASSERT_TRUE(results[0].isFound());
  EXPECT_EQ(results[0]->voxel.x, 0);
  EXPECT_EQ(results[0]->part, 0U);
  EXPECT_TRUE(results[1].isNotFound());
}

TEST(PoseQuery, SaysWhatIsWrongWithABodyOrAPose) {
  const CuboidMap room = makeRoom();
  const auto fault = [&](auto change) {
    Body body = makeBase();
    body.spheres.push_back({Eigen::Vector3d::Zero(), 0.5});
    change(body);
    std::string text = findFault(body, room.grid());
    EXPECT_EQ(checkPoses(room, body, {yawed(2, 2, 0)}, UnknownPolicy::kFree, Budget::unlimited())[0]
                  .status,
              AnswerStatus::kInvalid);
    return text;
  };
  const auto expect_part = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << "says: " << text;
  };
  expect_part(fault([](Body& b) { b = Body(); }), "no part");
  expect_part(fault([](Body& b) { b.spheres[0].radius_m = 0.0; }), "spheres[0]: radii");
  expect_part(fault([](Body& b) { b.spheres[0].radius_m = NAN; }), "spheres[0]: radii");
  expect_part(fault([](Body& b) { b.spheres[0].center_body.x() = INFINITY; }), "finite");
  expect_part(fault([](Body& b) { b.boxes[0].size_m.y() = -1.0; }), "boxes[0]: radii and edges");
  expect_part(fault([](Body& b) { b.boxes[0].size_m.x() = 5000.0; }), "in metres");
  expect_part(fault([](Body& b) { b.boxes[0].T_body_box.linear() *= 1.1; }), "quaternion");
  EXPECT_EQ(findFault(makeBase(), room.grid()), "");

  Eigen::Isometry3d scaled = yawed(0, 2, 0);
  scaled.linear() *= 0.99;
  Eigen::Isometry3d mirrored = yawed(0, 2, 0);
  mirrored.linear().col(0) *= -1.0;
  const auto results = checkPoses(
      room, makeBase(),
      {yawed(NAN, 0, 0), scaled, mirrored, yawed(1e12, 0, 0), yawed(0, 2, NAN), yawed(0, 2, 0)},
      UnknownPolicy::kFree, Budget::unlimited());
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(results[i].status, AnswerStatus::kInvalid) << i;
  EXPECT_TRUE(results[5].isNotFound()) << "the others do not matter to it";
}

TEST(PoseQuery, EndsWithItsBudget) {
  const CuboidMap room = makeRoom();
  QueryLimits limits;
  limits.max_bricks = 4;
  Budget budget(limits);
  const auto results = checkPoses(room, makeBase(), {yawed(0, 2, 0), yawed(2, -2, 0.3)},
                                  UnknownPolicy::kFree, budget);
  EXPECT_TRUE(budget.isSpent());
  EXPECT_EQ(results[1].status, AnswerStatus::kBudgetSpent);
}

TEST(PoseQuery, LooksAtMoreBricksThanItKeeps) {
  Random random(3942);
  CuboidMap map(poseConfig());
  std::vector<UniformBox> boxes;
  boxes.reserve(4000);
  for (int i = 0; i < 4000; ++i) {
    boxes.push_back({test::randomBox(random, {{-160, -160, -160}, {160, 160, 160}}, 12), 1.0F});
  }
  map.replace(kAllCells, boxes);
  std::vector<Eigen::Isometry3d> poses;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4000; ++i) {
    place += test::randomPoint(random, 3.0) - 0.01 * place;  // Stays near.
    poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(place)));
  }
  Body body;
  body.spheres.push_back({Eigen::Vector3d::Zero(), 0.3});
  const auto results = checkPoses(map, body, poses, UnknownPolicy::kFree, Budget::unlimited());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double depth = depthInObstacles(map, UnknownPolicy::kFree, body, 0, poses[i]);
    if (std::abs(depth) < 1e-5) continue;
    EXPECT_EQ(results[i].isNotFound(), depth < 0.0) << i;
  }
}

TEST(PoseQuery, FindsEveryVoxelThatABallBesideAnotherMeets) {
  Random random(3943);
  int num_free = 0;
  int num_blocked = 0;
  for (int round = 0; round < 150; ++round) {
    const CuboidMap map = test::mapOfUpdates(random, 6, poseConfig());
    const UnknownPolicy policy =
        random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    Body ball;
    const double radius = random.chance(0.1) ? random.real(12.0, 18.0) : random.real(0.2, 6.0);
    ball.spheres.push_back({Eigen::Vector3d::Zero(), radius * kEdge_m});
    std::vector<Eigen::Isometry3d> poses;
    Eigen::Vector3d place = test::randomPoint(random, 6.0);
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    for (int i = 0; i < 40; ++i) {
      if (i % 10 == 0) step = random.real(0.1, 2.0) * kEdge_m * test::randomDirection(random);
      poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(place += step)));
    }
    const std::vector<Answer<PoseContact>> results =
        checkPoses(map, ball, poses, policy, Budget::unlimited());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const double depth = depthInObstacles(map, policy, ball, 0, poses[i]);
      if (std::abs(depth) < 1e-5) continue;  // It only touches.
      EXPECT_EQ(results[i].isNotFound(), depth < 0.0)
          << "round " << round << ", pose " << i << ", depth " << depth;
      depth < 0.0 ? ++num_free : ++num_blocked;
      if (results[i].isFound()) {
        EXPECT_GT(depthOfPart(ball, 0, poses[i], results[i]->voxel), 0.0);
      }
    }
  }
  EXPECT_GT(num_free, 1000);
  EXPECT_GT(num_blocked, 1000);
}

}  // namespace
}  // namespace cuboid_mapping
