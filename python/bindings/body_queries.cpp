// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Map: bodies of boxes and spheres that turn.
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/pose_query.h"
#include "map_access.h"
#include "planner_arrays.h"

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

/// A pose whose rotation is exact.
Eigen::Isometry3d toUnitPose(const Doubles& array, const char* name) {
  Eigen::Isometry3d pose = toPose(array, name);
  pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return pose;
}

/// (n, 4, 4) matrices; an error names the row.
std::vector<Eigen::Isometry3d> toPoses(const Doubles& array, const char* name) {
  require(array.size() == 0 || array.ndim() == 3,
          std::string(name) + " must have the shape (n, 4, 4)");
  std::vector<Eigen::Isometry3d> poses;
  for (py::ssize_t i = 0; i < (array.size() == 0 ? 0 : array.shape(0)); ++i) {
    const Doubles row({array.shape(1), array.shape(2)}, array.data(i, 0, 0));
    poses.push_back(toUnitPose(row, element(name, static_cast<std::size_t>(i)).c_str()));
  }
  return poses;
}

/// @param spheres  (k, 4): centre and radius. @param sizes  (m, 3), of boxes at `box_poses`, by default in the
///                 middle.
Body toBody(const Doubles& spheres, const Doubles& sizes, const py::object& box_poses) {
  require(spheres.size() == 0 || (spheres.ndim() == 2 && spheres.shape(1) == 4),
          "spheres must have the shape (k, 4): centre and radius");
  Body body;
  for (const double* row = spheres.data(); row != spheres.data() + spheres.size(); row += 4) {
    body.spheres.push_back({{row[0], row[1], row[2]}, row[3]});
  }
  for (const Eigen::Vector3d& size : toPoints(sizes, "boxes")) {
    body.boxes.push_back({Eigen::Isometry3d::Identity(), size});
  }
  if (box_poses.is_none()) return body;
  const auto poses = toPoses(box_poses.cast<Doubles>(), "box_poses");
  require(poses.size() == body.boxes.size(),
          "there are " + std::to_string(poses.size()) + " box_poses and " +
              std::to_string(body.boxes.size()) + " boxes: give one pose for each box, or None");
  for (std::size_t i = 0; i < poses.size(); ++i) body.boxes[i].T_body_box = poses[i];
  return body;
}

py::object checkBody(MapAccess& access, const Doubles& pose_array, const Doubles& spheres,
                     const Doubles& boxes, const py::object& box_poses,
                     const std::string& unknown) {
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  const std::vector<Eigen::Isometry3d> poses = toPoses(pose_array, "poses");
  const Body body = toBody(spheres, boxes, box_poses);
  std::vector<std::uint8_t> free(poses.size());
  std::vector<std::int64_t> part(poses.size(), -1);
  std::vector<double> points;
  access.read([&](const CuboidMap& map) {
    const std::string fault = findFault(body, map.grid());
    require(fault.empty(), fault);
    Budget budget = toBudget();
    const auto results = checkPoses(map, body, poses, policy, budget);
    for (std::size_t i = 0; i < results.size(); ++i) {
      const auto contact = valid(results[i], element("poses", i));
      free[i] = static_cast<std::uint8_t>(contact.isNotFound());
      if (contact.isFound()) part[i] = static_cast<std::int64_t>(contact->part);
      append(points,
             contact.isFound() ? map.grid().centerOf(CellBox::ofCell(contact->voxel)) : kNowhere);
    }
  });
  return makeResult("Poses", toArray(std::move(free)).attr("astype")("bool"),
                    toArray(std::move(part)), toRows(std::move(points), 3));
}

py::object checkBodyMotion(MapAccess& access, const Doubles& pose_array, const Doubles& spheres,
                           const Doubles& boxes, const py::object& box_poses,
                           const std::string& unknown) {
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  const std::vector<Eigen::Isometry3d> poses = toPoses(pose_array, "poses");
  const Body body = toBody(spheres, boxes, box_poses);
  const auto motion = access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    return valid(checkMotion(map, body, poses, policy, budget), "motion");
  });
  const bool is_met = motion.isFound();
  const MotionContact& contact = motion.value;
  const double length_m = lengthOf(poses);
  std::vector<double> pose;
  append(pose, is_met ? contact.T_map_body : poses.back());
  std::vector<double> point;
  append(point, is_met ? access.grid().centerOf(CellBox::ofCell(contact.contact.voxel)) : kNowhere);
  return makeResult(
      "Motion", motion.isNotFound(), is_met ? contact.distance_m : length_m, length_m,
      is_met ? static_cast<std::int64_t>(contact.segment) : -1, toArray(std::move(pose), {4, 4}),
      is_met ? static_cast<std::int64_t>(contact.contact.part) : -1, toArray(std::move(point)));
}

py::object searchPosePath(MapAccess& access, const PosePathTask& task, UnknownPolicy policy,
                          double time_limit_s) {
  const auto answer = access.read([&](const CuboidMap& map) {
    Budget budget = toBudget(time_limit_s);
    return valid(findPosePath(map, task, policy, budget), "path");
  });
  const PosePath& path = answer.value;
  std::vector<double> poses;
  for (const Eigen::Isometry3d& pose : path.T_map_body) append(poses, pose);
  const auto num_poses = static_cast<py::ssize_t>(path.T_map_body.size());
  return makeResult("PosePath", toCorridorEnd(answer), toArray(std::move(poses), {num_poses, 4, 4}),
                    path.length_m, path.num_poses, path.start_distance_m, path.goal_distance_m,
                    toPointOf(access.grid(), path.met));
}

void bindPosePath(MapClass& map) {
  map.def(
      "find_path",
      [](MapAccess& access, const Doubles& start, const Doubles& goal, const Doubles& spheres,
         const Doubles& boxes, const py::object& box_poses, const std::string& unknown, bool climb,
         double time_limit_s, const py::object& region, double clearance_m,
         double start_tolerance_m, double goal_tolerance_m) {
        PosePathTask task;
        task.clearance_m = clearance_m;
        task.start_tolerance_m = start_tolerance_m;
        task.goal_tolerance_m = goal_tolerance_m;
        task.body = toBody(spheres, boxes, box_poses);
        task.start_map = toUnitPose(start, "start");
        task.goal_map = toUnitPose(goal, "goal");
        task.may_climb = climb;
        if (!region.is_none()) {
          task.region = toCellBox(access.grid(), region.cast<Doubles>(), "region");
        }
        return searchPosePath(access, task, toUnknownPolicy(unknown), time_limit_s);
      },
      "start"_a, "goal"_a, "spheres"_a = Doubles(py::array::ShapeContainer{0, 4}),
      "boxes"_a = Doubles(py::array::ShapeContainer{0, 3}), "box_poses"_a = py::none(),
      "unknown"_a = "obstacle", "climb"_a = false, "time_limit"_a = kInfinity,
      "region"_a = py::none(), "clearance"_a = 0.0, "start_tolerance"_a = 0.0,
      "goal_tolerance"_a = 0.0,
      R"(Finds a way for a body that moves in any direction, and turns about z.

start, goal: (4, 4): upright poses of the body. spheres, boxes, box_poses: as for check_poses().
unknown: 'obstacle' or 'free'. climb: whether it may move along z.
time_limit: seconds, >= 0. region: (6,), metres: the body may not leave it; None: the map and some room around it.
clearance: metres along its x and y that the body keeps where there is room. start_tolerance, goal_tolerance: as for
find_corridor().
Returns results.PosePath, whose motions check_motion() finds free, except for a way out of the start. The search uses voxel
centres and 16 headings: it may miss passages less than a voxel wider than the body.)");
}

}  // namespace

void bindBodyQueries(MapClass& map) {
  map.def(
      "check_poses", checkBody, "poses"_a, "spheres"_a = Doubles(py::array::ShapeContainer{0, 4}),
      "boxes"_a = Doubles(py::array::ShapeContainer{0, 3}), "box_poses"_a = py::none(),
      "unknown"_a = "obstacle",
      R"(Checks whether a body of spheres and boxes, turned in any way, meets an obstacle. Exact.

poses: (n, 4, 4): poses of the body.
spheres: (k, 4), metres: centre, in the frame of the body, and radius.
boxes: (m, 3), metres: edges. box_poses: (m, 4, 4), in the frame of the body; None: all in its middle.
unknown: 'obstacle' or 'free'.
Returns results.Poses: arrays with an element for each pose. O(bricks that the body overlaps) for each pose.)");
  map.def("check_motion", checkBodyMotion, "poses"_a,
          "spheres"_a = Doubles(py::array::ShapeContainer{0, 4}),
          "boxes"_a = Doubles(py::array::ShapeContainer{0, 3}), "box_poses"_a = py::none(),
          "unknown"_a = "obstacle",
          R"(Finds the first obstacle that a body meets on its way from pose to pose.

Between two poses the body moves straight, and turns the shortest way at an even rate. `free` is exact; a free motion with
less than 0.1 voxels of room may count as blocked.
poses: (n, 4, 4), n > 0. spheres, boxes, box_poses, unknown: as for check_poses().
Returns results.Motion. O(length), more near obstacles.)");
  bindPosePath(map);
}

}  // namespace cuboid_map_python
