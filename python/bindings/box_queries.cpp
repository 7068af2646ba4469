// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Map: covers and free boxes, frontiers, and distances.
#include "arrays.h"
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/free_boxes.h"
#include "cuboid_mapping/query/distance_field.h"
#include "cuboid_mapping/query/frontier_query.h"
#include "map_access.h"
#include "planner_arrays.h"

#include <cmath>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

CellBox toRegion(MapAccess& access, const py::object& region) {
  return region.is_none() ? kAllCells : toCellBox(access.grid(), region.cast<Doubles>(), "region");
}

std::size_t toMaxBoxes(long max_boxes) {
  if (max_boxes > 0) return static_cast<std::size_t>(max_boxes);
  throw Error("max_boxes is " + std::to_string(max_boxes) + ": it must be > 0");
}

template <typename BoxesT>
py::array_t<double> toMetres(MapAccess& access, const BoxesT& boxes) {
  const Grid grid = access.grid();
  std::vector<double> rows;
  for (const CellBox& box : boxes) append(rows, grid.toMetricBox(box));
  return toRows(std::move(rows), 6);
}

/// Edges of a robot: one number for all, or three.
Eigen::Vector3d toEdges(const Doubles& array, const char* name) {
  return array.ndim() == 0 ? Eigen::Vector3d::Constant(*array.data()) : toVector(array, name);
}

py::object cover(MapAccess& access, long max_boxes, const py::object& region,
                 const py::object& keep_free, const Doubles& keep_passages,
                 const py::object& previous) {
  CoverTask task;
  task.keep_passages_m = toEdges(keep_passages, "keep_passages");
  task.max_boxes = toMaxBoxes(max_boxes);
  task.region = toRegion(access, region);
  if (!keep_free.is_none()) {
    task.keep_free = toCellBoxes(access.grid(), keep_free.cast<Doubles>(), "keep_free");
  }
  if (!previous.is_none()) {
    task.previous = toCellBoxes(access.grid(), previous.cast<Doubles>(), "previous");
  }
  const auto answer = access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    return valid(coverOccupied(map, task, budget), "cover_occupied");
  });
  const BoxCover& found = answer.value;
  if (answer.isNotFound()) {
    throw Error("max_boxes is " + std::to_string(max_boxes) +
                ": because of keep_free or of voxels far from all others " +
                std::to_string(found.boxes.size()) + " are needed; or choose a region");
  }
  return makeResult("BoxCover", toMetres(access, found.boxes), found.occupied_volume_m3,
                    found.added_volume_m3, found.left_out_volume_m3, toMetres(access, found.lost));
}

py::object findFree(MapAccess& access, long max_boxes, const py::object& region, bool overlap) {
  FreeBoxesTask task;
  task.max_boxes = toMaxBoxes(max_boxes);
  task.region = toRegion(access, region);
  task.may_overlap = overlap;
  const FreeBoxes found = access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    return valid(findFreeBoxes(map, task, budget), "free_boxes").value;
  });
  return makeResult("FreeBoxes", toMetres(access, found.boxes), found.covered_volume_m3,
                    found.missing_volume_m3);
}

py::object frontiers(MapAccess& access, const Doubles& size, const py::object& region,
                     std::size_t min_voxels, double max_distance_m, double view_range_m) {
  FrontierTask task;
  task.region = toRegion(access, region);
  task.min_voxels = min_voxels;
  task.size_m = toVector(size, "size");
  task.max_distance_m = max_distance_m;
  task.view_range_m = view_range_m;
  const auto found = access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    return complete(findFrontiers(map, task, budget), "frontiers");
  });
  const Grid grid = access.grid();
  std::vector<double> centers;
  std::vector<double> places;
  std::vector<double> volumes;
  std::vector<double> voxels;
  std::vector<std::int64_t> ends;
  for (const Frontier& frontier : found.value) {
    append(centers, frontier.center_map);
    append(places, frontier.place_map.value_or(Eigen::Vector3d::Constant(NAN)));
    volumes.push_back(frontier.unknown_volume_m3);
    for (const Cell& cell : frontier.voxels) append(voxels, grid.centerOf(CellBox::ofCell(cell)));
    ends.push_back(static_cast<std::int64_t>(voxels.size() / 3));
  }
  return makeResult("Frontiers", toRows(std::move(centers), 3), toRows(std::move(places), 3),
                    toArray(std::move(volumes)), toRows(std::move(voxels), 3),
                    toArray(std::move(ends)));
}

/// The box around points, in voxels.
CellBox boundsOf(const Grid& grid, const std::vector<Eigen::Vector3d>& points) {
  std::optional<CellBox> bounds;
  for (const Eigen::Vector3d& point : points) {
    const auto cell = grid.toCell(point);
    if (!cell) throw Error("points must be finite and within the range of the grid");
    bounds = bounds ? unite(*bounds, CellBox::ofCell(*cell)) : CellBox::ofCell(*cell);
  }
  return *bounds;
}

py::object distances(MapAccess& access, const Doubles& array, double bound_m,
                     const std::string& unknown) {
  const std::vector<Eigen::Vector3d> points = toPoints(array, "points");
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  std::vector<double> distance;
  std::vector<double> gradient;
  if (!points.empty()) {
    const CellBox region = boundsOf(access.grid(), points);
    const DistanceField field = access.read(
        [&](const CuboidMap& map) { return DistanceField(map, region, bound_m, policy); });
    const py::gil_scoped_release release;
    for (const Eigen::Vector3d& point : points) {
      distance.push_back(*field.distanceAt(point));
      append(gradient, *field.gradientAt(point));
    }
  }
  return makeResult("Distances", toArray(std::move(distance)), toRows(std::move(gradient), 3));
}

}  // namespace

void bindBoxQueries(MapClass& map) {
  map.def("cover_occupied", cover, "max_boxes"_a, "region"_a = py::none(),
          "keep_free"_a = py::none(), "keep_passages"_a = 0.5, "previous"_a = py::none(),
          R"(Covers all occupied voxels by at most max_boxes boxes that add little volume.

max_boxes: > 0. region: (6,), metres; None: the whole map.
keep_free: (k, 6), metres, such as the robot: no box of the answer shares a voxel with one of these.
keep_passages: (3,), edges of a robot's box, metres, or one number for all. What it can reach in the map stays
reachable beside the boxes, or `lost` names the places; 0: not checked.
previous: (k, 6), metres, boxes of the last answer: those that still fit are taken over, at their places in the list.
Returns results.BoxCover, the largest box first unless `previous` is given; boxes may overlap.
The added volume need not be the least possible.
Raises ValueError if more boxes are needed: keep_free lies between the voxels, or these are very far apart.)");
  map.def("free_boxes", findFree, "max_boxes"_a, "region"_a = py::none(), "overlap"_a = false,
          R"(Finds at most max_boxes free boxes that hold much of the free space.

max_boxes: > 0. region: (6,), metres; None: the whole map.
overlap: whether a voxel may lie in two boxes.
Returns results.FreeBoxes. Their volume need not be the greatest possible.)");
  map.def("find_frontiers", frontiers, "size"_a, "region"_a = py::none(), "min_voxels"_a = 1,
          "max_distance"_a = 2.0, "view_range"_a = 2.0,
          R"(Finds frontiers: clusters of free voxels beside unknown ones, the largest first.

size: (3,), metres: edges of the robot, a box that does not turn. region: (6,), metres; None: the whole map.
min_voxels: smaller clusters are left out.
max_distance: maximum distance of a place to stand from its frontier, metres.
view_range: range of view from there, metres, at most 500 voxels; 0: views are not computed.
Returns results.Frontiers. O(frontier voxels), and a ray to each unknown voxel in the range of each place.)");
  map.def(
      "distances", distances, "points"_a, "bound"_a, "unknown"_a = "free",
      R"(Distances from points to the nearest obstacle: exact, from voxel centre to voxel centre.

points: (n, 3), metres. bound: metres, at most 127 voxels; farther obstacles are ignored.
unknown: 'obstacle' or 'free'.
Returns results.Distances. O(voxels of the box around all points and the bound): put points that lie together into one
call.)");
}

}  // namespace cuboid_map_python
