// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/self_filter/self_filter_step.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"
#include "cuboid_mapping/ros/self_filter/robot_description.h"
#include "ros/cloud_messages.h"
#include "ros/node_probe.h"
#include "ros/parameter_groups.h"
#include "support/random_shapes.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::Grid;
using cuboid_mapping::Occupancy;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::randomPoint;
using cuboid_mapping::test::TemporaryFolder;

const FindText kNoParameters = [](const std::string&) { return std::nullopt; };

Eigen::Isometry3d randomPose(Random& random) {
  return Eigen::Translation3d(randomPoint(random, 3.0)) *
         Eigen::AngleAxisd(random.real(-3.0, 3.0), randomPoint(random, 1.0).normalized());
}

cuboid_mapping::MetricBox makeBox(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  return {min_m, max_m};
}

/// Text of the exception from loading the parts; empty if there is none.
std::string loadError(NodeParameters parameters, const FindText& find_text = kNoParameters) {
  try {
    loadRobotParts(parameters, find_text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

std::string makeUrdf(const std::string& links) { return "<robot name='r'>" + links + "</robot>"; }

std::string makeLink(const std::string& geometry, const std::string& origin = "<origin/>") {
  return "<link name='a'><collision>" + origin + "<geometry>" + geometry +
         "</geometry></collision></link>";
}

bool isIn(const Solid& solid, const Eigen::Vector3d& point) {
  return cuboid_mapping::isInside(solid.bounds, point) && solid.contains(point);
}

TEST(RobotParts, ThePointsInThemAreTakenOutAndTheOthersKeepTheirOrder) {
  Random random(4711);
  std::size_t num_removed = 0;
  std::size_t num_kept = 0;
  for (int round = 0; round < 200; ++round) {
    RobotParts parts;
    std::vector<Eigen::Isometry3d> T_part_points;
    for (int i = random.integer(1, 5); i > 0; --i) {
      const Eigen::Vector3d min_m = randomPoint(random, 1.0);
      parts.push_back(makeBoxPart(
          "a", makeBox(min_m, min_m + 1.1 * Eigen::Vector3d::Ones() + randomPoint(random, 1.0))));
      T_part_points.push_back(randomPose(random));
    }
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3f> expected;
    for (int i = 0; i < 300; ++i) {
      points.push_back(randomPoint(random, 2.5).cast<float>());
      bool is_on_robot = false;
      for (std::size_t part = 0; part < parts.size(); ++part) {
        const Eigen::Vector3d point = T_part_points[part] * points.back().cast<double>();
        is_on_robot = is_on_robot || isIn(parts[part].padded, point);
      }
      if (!is_on_robot) expected.push_back(points.back());
    }
    const std::size_t count = removePointsOnRobot(parts, T_part_points, points);
    EXPECT_EQ(points, expected);
    EXPECT_EQ(count + points.size(), 300U);
    num_removed += count;
    num_kept += points.size();
  }
  EXPECT_GT(num_removed, 500U);
  EXPECT_GT(num_kept, 1000U);
}

TEST(RobotParts, TheirVoxelsAreThoseWhoseCentreIsInThem) {
  Random random(4712);
  const Grid grid(0.1);
  const Eigen::Vector3d anchor_map(1024.0, 0.0, -1024.0);
  std::size_t num_voxels = 0;
  for (int round = 0; round < 20; ++round) {
    const RobotParts parts{makeBoxPart("a", makeBox({-0.3, -0.2, 0.1}, {0.4, 0.5, 0.3}))};
    const Eigen::Isometry3d T_map_part = Eigen::Translation3d(anchor_map) * randomPose(random);
    std::set<Cell> expected;
    const Cell middle = *grid.toCell(T_map_part.translation());
    for (int x = -10; x <= 10; ++x) {
      for (int y = -10; y <= 10; ++y) {
        for (int z = -10; z <= 10; ++z) {
          const Cell cell = middle + Cell{x, y, z};
          const Eigen::Vector3d center = grid.centerOf({cell, cell + Cell{1, 1, 1}});
          if (isIn(parts[0].exact, T_map_part.inverse() * center)) expected.insert(cell);
        }
      }
    }
    std::set<Cell> found;
    for (const auto& center : findRobotVoxels(parts, {T_map_part}, grid, anchor_map)) {
      found.insert(*grid.toCell(anchor_map + center.cast<double>()));
    }
    EXPECT_EQ(found, expected);
    num_voxels += found.size();
  }
  EXPECT_GT(num_voxels, 1000U);
}

class RobotDescriptionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!canReadRobotDescriptions()) GTEST_SKIP() << "built without urdf or geometric_shapes";
  }
};

TEST_F(RobotDescriptionTest, EachShapeIsWhereItsLinkHasIt) {
  const RobotParts parts = readRobotDescription(
      makeUrdf(makeLink("<box size='2 0.2 0.4'/>", "<origin xyz='1 0 0' rpy='0 0 1.5707963268'/>") +
               "<link name='b'><collision><geometry><cylinder radius='0.5' length='2'/></geometry>"
               "</collision><collision><origin xyz='0 0 5'/><geometry><sphere radius='1'/>"
               "</geometry></collision></link><link name='c'/>"
               "<joint name='ab' type='fixed'><parent link='a'/><child link='b'/></joint>"
               "<joint name='bc' type='fixed'><parent link='b'/><child link='c'/></joint>"),
      0.1, {});
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].frame_id, "a");
  EXPECT_EQ(parts[1].frame_id, "b");
  EXPECT_EQ(parts[2].frame_id, "b");
  struct Probe {
    std::size_t part;
    Eigen::Vector3d point;
    bool is_in_exact;
    bool is_in_padded;
  };
  for (const Probe& probe :
       {Probe{0, {1.05, 0.95, 0.15}, true, true}, Probe{0, {1.15, 0.95, 0.15}, false, true},
        Probe{0, {1.05, 1.05, 0.15}, false, true}, Probe{0, {1.05, 1.15, 0.15}, false, false},
        Probe{0, {0.0, 0.0, 0.0}, false, false}, Probe{1, {0.3, 0.3, 0.95}, true, true},
        Probe{1, {0.4, 0.4, 0.95}, false, true}, Probe{1, {0.3, 0.3, 1.05}, false, true},
        Probe{1, {0.45, 0.45, 0.0}, false, false}, Probe{2, {0.5, 0.5, 5.5}, true, true},
        Probe{2, {0.6, 0.6, 5.6}, false, true}, Probe{2, {0.7, 0.7, 5.7}, false, false}}) {
    SCOPED_TRACE(probe.point.transpose());
    EXPECT_EQ(isIn(parts[probe.part].exact, probe.point), probe.is_in_exact);
    EXPECT_EQ(isIn(parts[probe.part].padded, probe.point), probe.is_in_padded);
  }
}

TEST_F(RobotDescriptionTest, AMeshCountsAsItsConvexHull) {
  const TemporaryFolder folder;
  const std::string file = folder / "corner.stl";
  std::ofstream(file) << "solid corner\n"
                         "facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 2 0\nvertex 2 0 "
                         "0\nendloop\nendfacet\n"
                         "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 0 "
                         "2\nendloop\nendfacet\n"
                         "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 2\nvertex 0 2 "
                         "0\nendloop\nendfacet\n"
                         "facet normal 1 1 1\nouter loop\nvertex 2 0 0\nvertex 0 2 0\nvertex 0 0 "
                         "2\nendloop\nendfacet\n"
                         "endsolid corner\n";
  const std::string urdf =
      makeUrdf(makeLink("<mesh filename='file://" + file + "' scale='0.5 0.5 1'/>"));
  const RobotParts parts = readRobotDescription(urdf, 0.0, {});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_TRUE(isIn(parts[0].exact, {0.3, 0.3, 0.5}));
  EXPECT_FALSE(isIn(parts[0].exact, {0.6, 0.6, 0.5}));
  EXPECT_TRUE(isIn(parts[0].exact, {0.05, 0.05, 1.7}));
  EXPECT_FALSE(isIn(parts[0].exact, {-0.1, 0.3, 0.3}));
}

TEST_F(RobotDescriptionTest, WhatCannotBeReadIsSaid) {
  const std::string ball = makeLink("<sphere radius='1'/>");
  const auto error_of = [](const std::string& urdf, const std::string& ignored = "") {
    NodeParameters parameters;
    parameters.of<SelfFilterParameters>().robot_description = "robot_description";
    parameters.of<SelfFilterParameters>().ignored_links = ignored;
    return loadError(parameters, [&](const std::string& name) {
      return name == "robot_description" ? std::optional<std::string>(urdf) : std::nullopt;
    });
  };
  EXPECT_EQ(error_of(makeUrdf(ball)), "");
  EXPECT_EQ(error_of("<robot"), "the robot description is no URDF");
  EXPECT_EQ(error_of(""),
            "self_filter/robot_description: there is no parameter robot_description with a URDF");
  EXPECT_EQ(error_of(makeUrdf("<link name='a'/>")),
            "the robot description has no collision shapes");
  EXPECT_EQ(error_of(makeUrdf(ball), "a"), "the robot description has no collision shapes");
  EXPECT_EQ(error_of(makeUrdf(ball), "wheel a"), "the robot has no link wheel to ignore");
  EXPECT_EQ(error_of(makeUrdf(makeLink("<mesh filename='file:///none.stl'/>"))),
            "link a of the robot has a mesh that cannot be read: file:///none.stl; correct it, or "
            "ignore the link");
}

TEST(SelfFilterParameters, Arrive) {
  XmlRpcValue boxes;
  boxes[0]["frame"] = "/base";
  for (int axis = 0; axis < 3; ++axis) {
    boxes[0]["min"][axis] = axis == 2 ? 0.25 : -1.0;
    boxes[0]["max"][axis] = 0.5;
  }
  const auto read =
      readInto<SelfFilterParameters>({{"self_filter/boxes", boxes},
                                      {"self_filter/robot_description", "robot_description"},
                                      {"self_filter/padding", 0.1},
                                      {"self_filter/ignored_links", "left_wheel right_wheel"},
                                      {"self_filter/keep_free", false}});
  ASSERT_EQ(read.boxes.size(), 1U);
  EXPECT_EQ(read.boxes[0].frame_id, "base");
  EXPECT_EQ(read.boxes[0].exact.bounds.min_m, Eigen::Vector3d(-1.0, -1.0, 0.25));
  EXPECT_EQ(read.boxes[0].padded.bounds.max_m, Eigen::Vector3d(0.5, 0.5, 0.5));
  EXPECT_EQ(read.robot_description, "robot_description");
  EXPECT_EQ(read.padding_m, 0.1);
  EXPECT_EQ(read.ignored_links, "left_wheel right_wheel");
  EXPECT_FALSE(read.keep_free);
}

TEST_F(RobotDescriptionTest, MayBeAFile) {
  const TemporaryFolder folder;
  NodeParameters parameters;
  parameters.of<SelfFilterParameters>().robot_description = folder / "robot.urdf";
  EXPECT_EQ(loadError(parameters),
            "self_filter/robot_description: cannot read " + folder / "robot.urdf");
  std::ofstream(folder / "robot.urdf") << makeUrdf(makeLink("<sphere radius='1'/>"));
  parameters.of<SelfFilterParameters>().boxes = {
      makeBoxPart("base", makeBox({0, 0, 0}, {1, 1, 1}))};
  loadRobotParts(parameters, kNoParameters);
  ASSERT_EQ(parameters.of<SelfFilterParameters>().parts.size(), 2U);
  EXPECT_EQ(parameters.of<SelfFilterParameters>().parts[0].frame_id, "base");
  EXPECT_EQ(parameters.of<SelfFilterParameters>().parts[1].frame_id, "a");
}

/// A robot with a box in front of the lidar, which moves with "arm".
NodeParameters makeParameters() {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.1;
  parameters.of<SelfFilterParameters>().keep_free = false;
  parameters.of<SelfFilterParameters>().boxes = {
      makeBoxPart("arm", makeBox({-0.25, -0.25, -0.25}, {0.25, 0.25, 0.25}))};
  loadRobotParts(parameters, kNoParameters);
  return parameters;
}

TEST(SelfFilter, ARobotOfTooManyVoxelsIsNotKeptFree) {
  NodeParameters parameters = makeParameters();
  parameters.map.resolution_m = 0.001;
  EXPECT_EQ(loadError(parameters), "");
  parameters.of<SelfFilterParameters>().keep_free = true;
  EXPECT_EQ(
      loadError(parameters),
      "self_filter/keep_free: the robot has 1.25e+08 voxels, but may have 1e+06: give meshes in "
      "millimetres a scale of 0.001 in the URDF; else choose a greater resolution, or set it "
      "to false");
}

TEST(SelfFilter, StaysWhenOtherParametersAreChanged) {
  dynamic_reconfigure::Config request;
  request.doubles.emplace_back();
  request.doubles.back().name = "sensor_model_miss";
  request.doubles.back().value = 0.2;
  const LoadedParameters changed = applyConfig(makeParameters(), request);
  EXPECT_EQ(changed.parameters.source.sensor_model.miss, 0.2);
  ASSERT_EQ(changed.parameters.of<SelfFilterParameters>().parts.size(), 1U);
  EXPECT_EQ(changed.parameters.of<SelfFilterParameters>().parts[0].frame_id, "arm");
}

TEST(SelfFilter, NeedsTheTransformsOfTheRobot) {
  const NodeParameters parameters = makeParameters();
  EXPECT_EQ(PoseFrames(parameters, parameters.source).needed(), std::vector<std::string>{"arm"});
  TfBuffer tf;
  tf.setTransform(test::makeTransform("map", "lidar", Eigen::Isometry3d::Identity()), "test", true);
  std_msgs::Header header;
  header.frame_id = "lidar";
  header.stamp = ros::Time(5.0);
  const PoseFrames frames(parameters, parameters.source);
  const PoseSearch search = findPoses(tf, frames, header, {});
  EXPECT_FALSE(search.poses) << "never with a wrong pose";
  EXPECT_NE(search.why.find("arm"), std::string::npos) << search.why;
  EXPECT_NE(search.why.find("(a frame of self_filter; see self_filter/ignored_links)"),
            std::string::npos)
      << search.why;
  tf.setTransform(test::makeTransform("map", "arm", test::makeTranslation(3.0, 0.0, 0.0)), "test",
                  true);
  const auto poses = findPoses(tf, frames, header, {}).poses;
  ASSERT_TRUE(poses);
  ASSERT_EQ(poses->T_map_steps.size(), 1U);
  EXPECT_EQ(poses->T_map_steps[0].translation().x(), 3.0);
}

/// Map that an input makes from points in the frame of a lidar at the origin of the map.
cuboid_mapping::CuboidMap makeMap(const NodeParameters& parameters, const CloudPoses& poses,
                                  const std::vector<Eigen::Vector3d>& points,
                                  CloudFigures& figures) {
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(points.size());
  SensorInput input(parameters, parameters.source);
  const Observed observed = input.compute(makeSensorMessage(spec, points), poses);
  const auto* update = observed.update;
  figures = observed.figures;
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  EXPECT_NE(update, nullptr);
  if (update != nullptr) map.apply(*update);
  return map;
}

CloudPoses posesWithArm(const Eigen::Vector3d& arm_map) {
  CloudPoses poses;
  poses.T_map_cloud.setIdentity();
  poses.T_map_sensor.setIdentity();
  poses.T_map_steps.emplace_back(Eigen::Translation3d(arm_map));
  return poses;
}

TEST(SelfFilter, PointsOnTheRobotNeitherMarkNorClear) {
  CloudFigures figures;
  const std::vector<Eigen::Vector3d> points{{0.95, 0.05, 0.05}, {0.05, 2.05, 0.05}};
  const auto map = makeMap(makeParameters(), posesWithArm({1.0, 0.0, 0.0}), points, figures);
  EXPECT_EQ(figures.num_on_robot, 1U);
  EXPECT_EQ(figures.num_points, 1U);
  EXPECT_EQ(map.voxels().at({9, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map.voxels().at({5, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map.voxels().at({0, 20, 0}), Occupancy::kOccupied);
  const auto moved = makeMap(makeParameters(), posesWithArm({3.0, 0.0, 0.0}), points, figures);
  EXPECT_EQ(moved.voxels().at({9, 0, 0}), Occupancy::kOccupied) << "the arm is elsewhere";
}

TEST(SelfFilter, TheVoxelsOfTheRobotAreKeptFreeAsFarAsNothingHitsThem) {
  CloudFigures figures;
  NodeParameters parameters = makeParameters();
  parameters.of<SelfFilterParameters>().keep_free = true;
  // The second point is outside the box, in a voxel whose centre is inside.
  const auto map = makeMap(parameters, posesWithArm({1.01, 0.01, 0.01}),
                           {{0.95, 0.05, 0.05}, {1.0, 0.0, 0.28}}, figures);
  EXPECT_EQ(figures.num_on_robot, 1U);
  EXPECT_EQ(map.voxels().at({9, 0, 0}), Occupancy::kFree);
  EXPECT_EQ(map.voxels().at({10, 0, 2}), Occupancy::kOccupied);
  EXPECT_EQ(map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels(), 125.0 + 10.0)
      << "and the beam before the robot";
  parameters.source.use = SourceUse::kMark;
  const auto marked =
      makeMap(parameters, posesWithArm({1.0, 0.0, 0.0}), {{0.05, 2.05, 0.05}}, figures);
  EXPECT_EQ(marked.voxels().at({9, 0, 0}), Occupancy::kUnknown) << "a source that only marks";
}

TEST(SelfFilter, OfAListOfSourcesAllHaveIt) {
  NodeParameters parameters = makeParameters();
  parameters.sources.resize(2);
  const auto sources = makeSources(parameters);
  ASSERT_EQ(sources.size(), 2U);
  for (const auto& source : sources) EXPECT_EQ(source->frames.steps.size(), 1U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
