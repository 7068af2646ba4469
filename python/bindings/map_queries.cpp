// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Map: properties of a map, points and boxes, and files.
#include "arrays.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "map_access.h"

#include <cmath>
#include <limits>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

constexpr double kMaxDenseVoxels = 4e9;

py::array_t<std::uint8_t> classify(MapAccess& access, const Doubles& array) {
  const std::vector<Eigen::Vector3d> points = toPoints(array, "points");
  std::vector<std::uint8_t> classes(points.size());
  access.read([&](const CuboidMap& map) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::optional<Cell> cell = map.grid().toCell(points[i]);
      if (cell) classes[i] = static_cast<std::uint8_t>(map.voxels().at(*cell));
    }
  });
  return toArray(std::move(classes));
}

py::array_t<float> findLogOdds(MapAccess& access, const Doubles& array) {
  const std::vector<Eigen::Vector3d> points = toPoints(array, "points");
  std::vector<float> values(points.size(), std::numeric_limits<float>::quiet_NaN());
  access.read([&](const CuboidMap& map) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::optional<Cell> cell = map.grid().toCell(points[i]);
      if (!cell) continue;
      if (const std::optional<float> found = map.voxels().logOddsAt(*cell)) values[i] = *found;
    }
  });
  return toArray(std::move(values));
}

py::object queryBoxes(MapAccess& access, const Doubles& array) {
  const std::vector<CellBox> boxes = toCellBoxes(access.grid(), array, "boxes");
  std::vector<std::uint8_t> occupancy(boxes.size());
  std::vector<double> free(boxes.size());
  std::vector<double> occupied(boxes.size());
  std::vector<double> unknown(boxes.size());
  access.read([&](const CuboidMap& map) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const BoxQueryResult result = *queryCells(map, boxes[i], Budget::unlimited());
      occupancy[i] = static_cast<std::uint8_t>(result.occupancy());
      free[i] = result.free_volume_m3;
      occupied[i] = result.occupied_volume_m3;
      unknown[i] = result.unknown_volume_m3;
    }
  });
  return makeResult("Boxes", toArray(std::move(occupancy)), toArray(std::move(free)),
                    toArray(std::move(occupied)), toArray(std::move(unknown)));
}

/// Columns of cuboid_map.results.Cuboids.
struct CuboidColumns {
  std::vector<std::int32_t> cells;
  std::vector<double> boxes;
  std::vector<std::uint8_t> occupancy;
  std::vector<float> probability;

  void add(const CuboidMap& map, const Cuboid& cuboid) {
    for (const Cell& corner : {cuboid.box.min, cuboid.box.max}) {
      cells.insert(cells.end(), {corner.x, corner.y, corner.z});
    }
    append(boxes, map.grid().toMetricBox(cuboid.box));
    occupancy.push_back(static_cast<std::uint8_t>(cuboid.occupancy));
    probability.push_back(
        static_cast<float>(meanProbability(map, cuboid.box, Budget::unlimited()).valueOr(NAN)));
  }
};

py::object findCuboids(MapAccess& access, const py::object& box, const std::string& classes,
                       bool is_clipped, bool are_joined) {
  const CellBox region =
      box.is_none() ? kAllCells : toCellBox(access.grid(), box.cast<Doubles>(), "box");
  CuboidSelection selection;
  selection.filter = toFilter(classes);
  selection.is_clipped = is_clipped;
  CuboidColumns columns;
  access.read([&](const CuboidMap& map) {
    Budget& budget = Budget::unlimited();
    const auto found = are_joined ? joinCuboids(map, region, selection.filter, budget)
                                  : selectCuboids(map, region, selection, budget);
    for (const Cuboid& cuboid : found.value) columns.add(map, cuboid);
  });
  return makeResult("Cuboids", toRows(std::move(columns.cells), 6),
                    toRows(std::move(columns.boxes), 6), toArray(std::move(columns.occupancy)),
                    toArray(std::move(columns.probability)));
}

py::array_t<std::uint8_t> makeDense(MapAccess& access, const Doubles& array) {
  const CellBox box = toCellBox(access.grid(), array, "box");
  if (box.numVoxels() > kMaxDenseVoxels) {
    throw Error("box has " + toText(box.numVoxels()) + " voxels, but at most " +
                toText(kMaxDenseVoxels) + " go into one array");
  }
  const Cell size = box.size();
  std::vector<std::uint8_t> classes(static_cast<std::size_t>(box.numVoxels()));
  access.read([&](const CuboidMap& map) {
    map.voxels().forEachIn(box, [&](const VoxelBrick& brick) {
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick.brick)));
      forEachCell(brick.brick, brick.voxels.known() & part, [&](const Cell& cell) {
        const Cell at = cell - box.min;
        const auto place = (static_cast<std::size_t>(at.x) * static_cast<std::size_t>(size.y) +
                            static_cast<std::size_t>(at.y)) *
                               static_cast<std::size_t>(size.z) +
                           static_cast<std::size_t>(at.z);
        classes[place] = static_cast<std::uint8_t>(brick.voxels.at(voxelIndex(cell)));
      });
    });
  });
  return toArray(std::move(classes), {size.x, size.y, size.z});
}

std::size_t save(MapAccess& access, const FileName& name) {
  const std::string& file = name.text;
  if (!formatOfName(file)) {
    throw Error(file + ": the name must end in one of " + knownEndings());
  }
  const std::string frame_id = access.frame_id;
  const MapSnapshot snapshot =
      access.read([&](const CuboidMap& map) { return takeSnapshot(map, frame_id); });
  const py::gil_scoped_release release;
  return writeMapFile(file, snapshot);
}

void bindPoints(MapClass& map) {
  map.def("classify", classify, "points"_a, R"(Class of the voxel that holds each point.

points: (n, 3), metres, map frame.
Returns (n,) uint8 of Occupancy; UNKNOWN outside the map, and for points that are not finite. A point on a face
between two voxels belongs to the one with the greater coordinates. O(1) for each point.)");
  map.def("log_odds", findLogOdds, "points"_a,
          R"(Log-odds of the voxel that holds each point; >= 0 is occupied.

points: (n, 3), metres, map frame.
Returns (n,) float32; NaN for unknown voxels, and for points that are not finite. A MapFollower whose messages carry
no values (publish_values) has those of the clamping thresholds. O(1) for each point.)");
}

void bindBoxes(MapClass& map) {
  map.def("query_boxes", queryBoxes, "boxes"_a, R"(Class and volumes of boxes.

boxes: (n, 6), metres, map frame: min x, y, z, max x, y, z. Every voxel that a box overlaps counts as
  a whole.
Returns results.Boxes: arrays with an element for each box.
Raises ValueError for a box that is flat, inverted, not finite, or out of range.
O(bricks of 8 x 8 x 8 voxels in the box).)");
  map.def("cuboids", findCuboids, "box"_a = py::none(), "classes"_a = "all", "clip"_a = false,
          "joined"_a = false, R"(The cuboids of the map: disjoint boxes of voxels of one class.

box: (6,), metres, map frame: only cuboids that share a voxel with it. None: all.
classes: 'all', 'free' or 'occupied'.
clip: cut them at the faces of the box.
joined: join them across bricks: a wall is one cuboid, not tiles of eight voxels. Joined cuboids are always cut at the faces
  of the box, and do not depend on the order of scans.
Returns results.Cuboids, in no particular order. O(log n + k) for k cuboids.)");
  map.def("dense", makeDense, "box"_a, R"(The classes of all voxels in a box as an array.

box: (6,), metres, map frame; every voxel that it overlaps is in the array.
Returns (x, y, z) uint8 of Occupancy, the least voxel first. O(voxels of the box).
Raises ValueError for a box that query_boxes() refuses, or of more than 4e9 voxels.)");
}

}  // namespace

MapClass bindMap(py::module& module) {
  MapClass map(module, "Map", R"(The queries of a 3D occupancy map; Mapper and MapFollower are maps.

Points and boxes are in metres, in the frame of the map.

Threads: any thread may call all functions, which release the GIL while they work. Queries run side by side. In a Mapper,
changes wait for queries, and queries for changes. Ctrl-C ends a search.)");
  map.def_property_readonly(
      "resolution", [](MapAccess& access) { return access.grid().resolution(); },
      "Edge of a voxel in metres.");
  map.def_property_readonly(
      "num_cuboids",
      [](MapAccess& access) {
        return access.read([](const CuboidMap& m) { return countCuboids(m).total(); });
      },
      "Number of cuboids, free and occupied. O(n).");
  map.def_property_readonly(
      "num_bytes",
      [](MapAccess& access) {
        return access.read([](const CuboidMap& m) { return m.numBytes(); });
      },
      "Memory of the map.");
  map.def_readwrite(
      "frame_id", &MapAccess::frame_id,
      "Name of the frame of the map, kept in .cuboids and .sqlite files; '' if it is not known.");
  bindPoints(map);
  bindBoxes(map);
  map.def("save", save, "file"_a, R"(Replaces a file by the map; its extension chooses the format.

file: .cuboids and .sqlite (everything), .ot and .bt (OctoMap), .pcd, .ply, .csv.
Returns the size of the file in bytes. Raises MapFileError for a failure of the disk, or a map that the format cannot
hold; ValueError for another extension. The map can be changed while the file is written.)");
  return map;
}

}  // namespace cuboid_map_python
