// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"

#include "cuboid_mapping/ros/conversions/point_cloud.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/publishers/marker_colors.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::kOctreeDepth;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::OctreeKind;
using cuboid_mapping::OctreeLeaf;
using cuboid_mapping::VoxelBrick;
using cuboid_mapping::VoxelStore;

constexpr int kNumDepths = kOctreeDepth + 1;

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

geometry_msgs::Point centerOf(const OctreeLeaf& leaf, double resolution_m) {
  const double half = 0.5 * leaf.edge();
  geometry_msgs::Point center;
  center.x = (leaf.min.x + half) * resolution_m;
  center.y = (leaf.min.y + half) * resolution_m;
  center.z = (leaf.min.z + half) * resolution_m;
  return center;
}

std_msgs::ColorRGBA toColor(const std::array<double, 4>& rgba) {
  std_msgs::ColorRGBA color;
  color.r = static_cast<float>(rgba[0]);
  color.g = static_cast<float>(rgba[1]);
  color.b = static_cast<float>(rgba[2]);
  color.a = static_cast<float>(rgba[3]);
  return color;
}

/// Colours by height, between the lowest and the highest face of the known voxels.
class HeightColors {
 public:
  HeightColors(const MapSnapshot& map, double color_factor) : color_factor_(color_factor) {
    for (const VoxelBrick& brick : map.bricks) {
      if (!cuboid_mapping::kOctreeCells.contains(brick.brick)) continue;
      for (int z = 0; z < cuboid_mapping::kBrickEdge; ++z) {
        if (brick.voxels.known()[z] == 0) continue;
        min_m_ = std::min(min_m_, (brick.brick.z + z) * map.resolution_m);
        max_m_ = std::max(max_m_, (brick.brick.z + z + 1) * map.resolution_m);
      }
    }
  }

  /// @pre A known voxel shares this height.
  [[nodiscard]] std_msgs::ColorRGBA at(double z_m) const {
    return toHueColor((max_m_ - z_m) / (max_m_ - min_m_) * color_factor_);
  }

 private:
  double color_factor_;
  double min_m_ = std::numeric_limits<double>::infinity();
  double max_m_ = -std::numeric_limits<double>::infinity();
};

std::vector<visualization_msgs::Marker> makeEmptyMarkers(double resolution_m,
                                                         const std_msgs::Header& header) {
  std::vector<visualization_msgs::Marker> markers(kNumDepths);
  for (int depth = 0; depth < kNumDepths; ++depth) {
    visualization_msgs::Marker& marker = markers[static_cast<std::size_t>(depth)];
    marker.header = header;
    marker.ns = "map";
    marker.id = depth;
    marker.type = visualization_msgs::Marker::CUBE_LIST;
    marker.pose.orientation.w = 1.0;
    marker.frame_locked = static_cast<std::uint8_t>(true);  // As in MarkerCache.
    const double edge_m = resolution_m * (1 << (kOctreeDepth - depth));
    marker.scale.x = marker.scale.y = marker.scale.z = edge_m;
  }
  return markers;
}

}  // namespace

OctomapMessage toOctomapMessage(const MapSnapshot& map, OctreeKind kind,
                                const std_msgs::Header& header, double& num_left_out) {
  const cuboid_mapping::OctreeStream tree = toOctreeStream(map.bricks, kind);
  num_left_out = tree.num_left_out;
  OctomapMessage message;
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
    if (!hasOccupiedNeighbour(voxels, cell)) speckles.set(cuboid_mapping::voxelIndex(cell));
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

std::vector<OctreeLeaf> computeShownLeaves(const MapSnapshot& map, ShownCells cells,
                                           const OctomapServerParameters& parameters) {
  std::vector<OctreeLeaf> leaves = computeOctreeLeaves(map.bricks, OctreeKind::kBinary);
  const auto is_hidden = [&](const OctreeLeaf& leaf) {
    const bool is_occupied = leaf.log_odds >= 0.0F;
    return is_occupied != (cells == ShownCells::kOccupied) ||
           (leaf.min.z + leaf.edge()) * map.resolution_m <= parameters.occupancy_min_z_m ||
           leaf.min.z * map.resolution_m >= parameters.occupancy_max_z_m;
  };
  leaves.erase(std::remove_if(leaves.begin(), leaves.end(), is_hidden), leaves.end());
  return leaves;
}

visualization_msgs::MarkerArray toCellMarkers(const MapSnapshot& map, ShownCells cells,
                                              const OctomapServerParameters& parameters,
                                              const std_msgs::Header& header) {
  visualization_msgs::MarkerArray array;
  array.markers = makeEmptyMarkers(map.resolution_m, header);
  const bool is_occupied = cells == ShownCells::kOccupied;
  const bool is_by_height = is_occupied && parameters.is_height_map;
  const HeightColors heights(map, parameters.color_factor);
  for (const OctreeLeaf& leaf : computeShownLeaves(map, cells, parameters)) {
    visualization_msgs::Marker& marker = array.markers[static_cast<std::size_t>(leaf.depth)];
    marker.points.push_back(centerOf(leaf, map.resolution_m));
    if (is_by_height) marker.colors.push_back(heights.at(marker.points.back().z));
  }
  for (visualization_msgs::Marker& marker : array.markers) {
    marker.color = toColor(is_occupied ? parameters.color : parameters.color_free);
    marker.action = marker.points.empty() ? visualization_msgs::Marker::DELETE
                                          : visualization_msgs::Marker::ADD;
  }
  return array;
}

sensor_msgs::PointCloud2 toCenters(const std::vector<OctreeLeaf>& leaves, double resolution_m,
                                   const std_msgs::Header& header) {
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(leaves.size());
  for (const OctreeLeaf& leaf : leaves) centers.push_back(toVector(centerOf(leaf, resolution_m)));
  return toCloud(centers, header);
}

}  // namespace cuboid_mapping_ros
