// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"

#include "cuboid_mapping/ros/conversions/marker_colors.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/conversions/points.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

namespace cuboid_mapping_ros {
namespace {

constexpr int kNumDepths = kOctreeDepth + 1;
/// Part of the circle of hues over the height of the map; color_factor of octomap_server.
constexpr double kHueShare = 0.8;

bool hasOccupiedNeighbour(const VoxelStore& voxels, const Cell& cell) {
  const Cell one{1, 1, 1};
  const CellBox around{cell - one, cell + one + one};
  bool found = false;
  voxels.forEachIn(around, [&](const VoxelBrick& brick) {
    if (found || !brick.voxels.isAnyOccupied()) return;
    const CellBox part = intersect(around, brickBox(brick.brick));
    BrickMask neighbours = brick.voxels.occupied() & BrickMask::ofBox(part);
    if (part.contains(cell)) neighbours &= ~BrickMask::ofBox(CellBox::ofCell(cell));
    found = !neighbours.isEmpty();
  });
  return found;
}

Eigen::Vector3d centerOf(const OctreeLeaf& leaf, double resolution_m) {
  const Eigen::Vector3d min(leaf.min.x, leaf.min.y, leaf.min.z);
  return (min.array() + 0.5 * leaf.edge()) * resolution_m;
}

/// Centre of an octree that can hold the map: a multiple of 1024 voxels, so that leaves up to that size have
/// the places of the octree at the origin. Nothing if that octree holds the whole map.
std::optional<Cell> middleOf(const std::vector<VoxelBrick>& bricks) {
  const bool fits = std::all_of(bricks.begin(), bricks.end(), [](const VoxelBrick& brick) {
    return kOctreeCells.contains(brick.brick);
  });
  if (fits) return std::nullopt;
  // Median of the bricks, not centre of their bounds: one far brick must not displace the others.
  std::vector<Cell> cells;
  cells.reserve(bricks.size());
  for (const VoxelBrick& brick : bricks) cells.push_back(brick.brick);
  const Cell middle = medianOf(cells);
  return Cell{middle.x & ~1023, middle.y & ~1023, middle.z & ~1023};
}

/// Bricks relative to a cell, without those beyond an octree there.
std::vector<VoxelBrick> moveBricks(const std::vector<VoxelBrick>& bricks, const Cell& middle,
                                   double& num_left_out) {
  std::vector<VoxelBrick> moved;
  moved.reserve(bricks.size());
  for (const VoxelBrick& brick : bricks) {
    const Cell at = brick.brick - middle;
    if (kOctreeCells.contains(at)) {
      moved.push_back({at, brick.voxels});
    } else {
      num_left_out += brick.voxels.known().count();
    }
  }
  return moved;
}

std::array<OctreeLeaf, 8> childrenOf(const OctreeLeaf& leaf) {
  std::array<OctreeLeaf, 8> children{};
  const std::int32_t half = leaf.edge() / 2;
  for (std::size_t i = 0; i < children.size(); ++i) {
    const Cell offset{(i & 1) != 0 ? half : 0, (i & 2) != 0 ? half : 0, (i & 4) != 0 ? half : 0};
    children.at(i) = {leaf.min + offset, leaf.depth + 1, leaf.log_odds};
  }
  return children;
}

/// From the lowest to the highest face of the known voxels; infinite without any.
HeightRange findHeights(const MapSnapshot& map) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  HeightRange heights{kInfinity, -kInfinity};
  for (const VoxelBrick& brick : map.bricks) {
    for (int z = 0; z < kBrickEdge; ++z) {
      if (brick.voxels.known()[z] == 0) continue;
      heights.min_m = std::min(heights.min_m, (brick.brick.z + z) * map.resolution_m);
      heights.max_m = std::max(heights.max_m, (brick.brick.z + z + 1) * map.resolution_m);
    }
  }
  return heights;
}

std::vector<visualization_msgs::Marker> makeEmptyMarkers(double resolution_m,
                                                         const std_msgs::Header& header) {
  std::vector<visualization_msgs::Marker> markers;
  for (int depth = 0; depth < kNumDepths; ++depth) {
    const double edge_m = resolution_m * (1 << (kOctreeDepth - depth));
    markers.push_back(makeCubeList(header, "map", depth, Eigen::Vector3d::Constant(edge_m)));
  }
  return markers;
}

}  // namespace

Cell medianOf(const std::vector<Cell>& cells) {
  Cell median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::int32_t> values;
    values.reserve(cells.size());
    for (const Cell& cell : cells) values.push_back(cell[axis]);
    median[axis] = quantileOf(values);
  }
  return median;
}

octomap_msgs::Octomap toOctomapMessage(const MapSnapshot& map, OctreeKind kind,
                                       const std_msgs::Header& header, double& num_left_out) {
  const OctreeStream tree = toOctreeStream(map.bricks, kind);
  num_left_out = tree.num_left_out;
  octomap_msgs::Octomap message;
  message.header = header;
  message.binary = kind == OctreeKind::kBinary ? 1 : 0;
  message.id = "OcTree";
  message.resolution = map.resolution_m;
  message.data.assign(tree.bytes.begin(), tree.bytes.end());
  return message;
}

BrickMask findSpeckles(const VoxelStore& voxels, const VoxelBrick& brick) {
  BrickMask speckles;
  forEachCell(brick.brick, brick.voxels.occupied(), [&](const Cell& cell) {
    if (!hasOccupiedNeighbour(voxels, cell)) speckles.set(voxelIndex(cell));
  });
  return speckles;
}

void removeSpeckles(const VoxelStore& voxels, std::vector<VoxelBrick>& bricks) {
  for (auto& [brick, content] : bricks) {
    content.replace(findSpeckles(voxels, {brick, content}), {}, content);
  }
  bricks.erase(std::remove_if(bricks.begin(), bricks.end(),
                              [](const VoxelBrick& brick) { return brick.voxels.isEmpty(); }),
               bricks.end());
}

ShownLeaves computeShownLeaves(const MapSnapshot& map, ShownCells cells,
                               const OctomapServerParameters& parameters, OctreeKind kind) {
  const std::optional<Cell> far_middle = middleOf(map.bricks);
  const Cell middle = far_middle.value_or(Cell{0, 0, 0});
  ShownLeaves shown;
  std::vector<VoxelBrick> moved;
  if (far_middle) moved = moveBricks(map.bricks, middle, shown.num_left_out);
  const auto add = [&](const OctreeLeaf& leaf, const auto& again) -> void {
    const std::int32_t min_z = leaf.min.z + middle.z;
    const bool is_in_band =
        (min_z + leaf.edge()) * map.resolution_m > parameters.occupancy_min_z_m &&
        min_z * map.resolution_m < parameters.occupancy_max_z_m;
    if (!is_in_band) return;
    const bool reaches_out =
        (min_z + leaf.edge()) * map.resolution_m >=
            parameters.occupancy_max_z_m + map.resolution_m ||
        min_z * map.resolution_m <= parameters.occupancy_min_z_m - map.resolution_m;
    if (reaches_out && leaf.depth < kOctreeDepth) {
      for (const OctreeLeaf& child : childrenOf(leaf)) again(child, again);
    } else {
      shown.leaves.push_back({leaf.min + middle, leaf.depth, leaf.log_odds});
    }
  };
  const CuboidFilter classes =
      cells == ShownCells::kOccupied ? CuboidFilter::kOccupied : CuboidFilter::kFree;
  const std::vector<VoxelBrick>& bricks = far_middle ? moved : map.bricks;
  for (const OctreeLeaf& leaf : computeOctreeLeaves(bricks, kind, classes)) add(leaf, add);
  return shown;
}

visualization_msgs::MarkerArray toCellMarkers(const MapSnapshot& map, ShownCells cells,
                                              const OctomapServerParameters& parameters,
                                              const std_msgs::Header& header,
                                              double& num_left_out) {
  const ShownLeaves shown = computeShownLeaves(map, cells, parameters, OctreeKind::kBinary);
  num_left_out = shown.num_left_out;
  const Eigen::Vector3d anchor = shown.leaves.empty()
                                     ? Eigen::Vector3d::Zero().eval()
                                     : farAnchor(centerOf(shown.leaves.front(), map.resolution_m));
  visualization_msgs::MarkerArray array;
  array.markers = makeEmptyMarkers(map.resolution_m, header);
  const bool is_occupied = cells == ShownCells::kOccupied;
  const HeightRange heights = is_occupied ? findHeights(map) : HeightRange();
  for (const OctreeLeaf& leaf : shown.leaves) {
    visualization_msgs::Marker& marker = array.markers[static_cast<std::size_t>(leaf.depth)];
    const Eigen::Vector3d center = centerOf(leaf, map.resolution_m);
    marker.points.push_back(toPoint(center - anchor));
    if (!is_occupied) continue;
    const double share = (heights.max_m - center.z()) / (heights.max_m - heights.min_m);
    marker.colors.push_back(toHueColor(share * kHueShare));
  }
  for (visualization_msgs::Marker& marker : array.markers) {
    marker.pose.position = toPoint(anchor);
    marker.color = is_occupied ? makeColor(0.0, 0.0, 1.0, 1.0) : makeColor(0.0, 1.0, 0.0, 1.0);
    marker.action = marker.points.empty() ? visualization_msgs::Marker::DELETE
                                          : visualization_msgs::Marker::ADD;
  }
  return array;
}

sensor_msgs::PointCloud2 toCenters(const std::vector<OctreeLeaf>& leaves, double resolution_m,
                                   const std_msgs::Header& header) {
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(leaves.size());
  for (const OctreeLeaf& leaf : leaves) centers.push_back(centerOf(leaf, resolution_m));
  return toCloud(centers, header);
}

}  // namespace cuboid_mapping_ros
