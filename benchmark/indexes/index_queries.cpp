// SPDX-License-Identifier: BSD-3-Clause
#include "indexes/index_queries.h"

#include "cuboid_mapping/query/path_query.h"

#include <cmath>
#include <cstring>
#include <optional>

namespace cuboid_mapping::bench {
namespace {

constexpr std::size_t kNearest = 5;
constexpr double kRegion_m = 20.0;
constexpr double kGraph_m = 4.0;

std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return (a * 0x9E3779B97F4A7C15ULL ^ b) * 0xC2B2AE3D27D4EB4FULL;
}

std::uint64_t hashOf(const CellBox& box) { return mix(CellHash()(box.min), CellHash()(box.max)); }

std::uint64_t hashOf(const Cuboid& cuboid) {
  return hashOf(cuboid.box) + static_cast<std::uint64_t>(cuboid.isOccupied());
}

std::uint64_t sumIn(const CuboidIndex& index, const CellBox& window, CuboidFilter filter) {
  std::uint64_t sum = 0;
  index.visitBox(window, filter, [&sum](const Cuboid& cuboid) {
    sum += hashOf(cuboid);
    return Visit::kContinue;
  });
  return sum;
}

std::uint64_t isAnyOccupied(const CuboidIndex& index, const CellBox& window) {
  std::uint64_t is_any = 0;
  index.visitBox(window, CuboidFilter::kOccupied, [&is_any](const Cuboid& /*cuboid*/) {
    is_any = 1;
    return Visit::kStop;
  });
  return is_any;
}

std::uint64_t sumNearest(const CuboidIndex& index, const Eigen::Vector3d& point) {
  std::uint64_t sum = 0;
  for (const double distance : index.nearest(point, kNearest, CuboidFilter::kOccupied)) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &distance, sizeof(bits));
    sum = mix(sum, bits);
  }
  return sum;
}

/// Cubes round the places of the sensor.
std::vector<CellBox> cubesAround(const Grid& grid, const std::vector<Eigen::Vector3d>& places_map,
                                 double edge_m) {
  std::vector<CellBox> cubes;
  for (const Eigen::Vector3d& place : places_map) {
    if (const auto cube = grid.toCellBox(boxAround(place, Eigen::Vector3d::Constant(edge_m)))) {
      cubes.push_back(*cube);
    }
  }
  return cubes;
}

IndexQueries ofBoxes(const std::string& name, const std::vector<CellBox>& boxes,
                     std::uint64_t (*ask)(const CuboidIndex&, const CellBox&)) {
  return {name, boxes.size(),
          [&boxes, ask](const CuboidIndex& index, std::size_t i) { return ask(index, boxes[i]); }};
}

std::uint64_t sumOfAll(const CuboidIndex& index, const CellBox& box) {
  return sumIn(index, box, CuboidFilter::kAll);
}
std::uint64_t sumOfOccupied(const CuboidIndex& index, const CellBox& box) {
  return sumIn(index, box, CuboidFilter::kOccupied);
}
std::uint64_t sumOfPortals(const CuboidIndex& index, const CellBox& box) {
  return findPortals(index, box).sum;
}

/// With boxes of its own.
IndexQueries ofCubes(const std::string& name, std::vector<CellBox> cubes,
                     std::uint64_t (*ask)(const CuboidIndex&, const CellBox&)) {
  const std::size_t count = cubes.size();
  return {name, count, [cubes = std::move(cubes), ask](const CuboidIndex& index, std::size_t i) {
            return ask(index, cubes[i]);
          }};
}

IndexQueries ofPoints(const std::string& name, const Grid& grid,
                      const std::vector<Eigen::Vector3d>& points_map) {
  return {name, points_map.size(), [&](const CuboidIndex& index, std::size_t i) {
            const auto cell = grid.toCell(points_map[i]);
            const auto found = cell ? index.find(*cell) : std::nullopt;
            return found ? hashOf(*found) : 0;
          }};
}

IndexQueries ofNearest(const std::string& name, const Grid& grid,
                       const std::vector<Eigen::Vector3d>& points_map) {
  return {name, points_map.size(), [&](const CuboidIndex& index, std::size_t i) {
            return sumNearest(index, grid.toCellUnits(points_map[i]));
          }};
}

}  // namespace

Portals findPortals(const CuboidIndex& index, const CellBox& region) {
  std::vector<CellBox> boxes;
  index.visitBox(region, CuboidFilter::kFree, [&](const Cuboid& cuboid) {
    boxes.push_back(intersect(cuboid.box, region));
    return Visit::kContinue;
  });
  Portals portals;
  for (const CellBox& box : boxes) {
    for (int axis = 0; axis < 3; ++axis) {
      CellBox beyond = box;
      beyond.min[axis] = box.max[axis];
      beyond.max[axis] = box.max[axis] + 1;
      const CellBox inside = intersect(beyond, region);
      if (inside.isEmpty()) continue;
      index.visitBox(inside, CuboidFilter::kFree, [&](const Cuboid& cuboid) {
        portals.sum += hashOf(intersect(cuboid.box, inside));
        ++portals.count;
        return Visit::kContinue;
      });
    }
  }
  return portals;
}

std::vector<IndexQueries> makeIndexQueries(const CuboidMap& map, const ByPlace<QuerySet>& queries,
                                           const std::vector<Eigen::Vector3d>& places_map) {
  const Grid& grid = map.grid();
  return {ofCubes("visit all", {kAllCells}, sumOfAll),
          ofCubes("visit occupied", {kAllCells}, sumOfOccupied),
          ofBoxes("boxes of 2 m, anywhere", queries.uniform.boxes, sumOfAll),
          ofBoxes("boxes of 2 m, at surfaces", queries.near_surface.boxes, sumOfAll),
          ofBoxes("any occupied in 2 m, at surfaces", queries.near_surface.boxes, isAnyOccupied),
          ofCubes("regions of 20 m", cubesAround(grid, places_map, kRegion_m), sumOfAll),
          ofCubes("occupied in regions of 20 m", cubesAround(grid, places_map, kRegion_m),
                  sumOfOccupied),
          ofPoints("points, anywhere", grid, queries.uniform.points_map),
          ofPoints("points, at surfaces", grid, queries.near_surface.points_map),
          ofNearest("5 nearest occupied, anywhere", grid, queries.uniform.points_map),
          ofNearest("5 nearest occupied, at surfaces", grid, queries.near_surface.points_map),
          ofCubes("free graphs of 4 m", cubesAround(grid, places_map, kGraph_m), sumOfPortals)};
}

}  // namespace cuboid_mapping::bench
