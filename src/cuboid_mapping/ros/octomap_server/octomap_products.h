// SPDX-License-Identifier: BSD-3-Clause
// The messages of octomap_server, made from a map. Pure functions.
#pragma once

#include "cuboid_mapping/io/octree_stream.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/conversions/octomap_messages.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <vector>

namespace cuboid_mapping_ros {

/// octomap_binary and octomap_full: every voxel within +-32768 voxels from the origin; pruned.
/// @param num_left_out  Gets the number of voxels outside, which no octree can hold.
[[nodiscard]] OctomapMessage toOctomapMessage(const cuboid_mapping::MapSnapshot& map,
                                              cuboid_mapping::OctreeKind kind,
                                              const std_msgs::Header& header, double& num_left_out);

/// Occupied voxels of a brick without any occupied neighbour (of 26).
/// @param voxels  Of the map that the brick is from.
[[nodiscard]] cuboid_mapping::BrickMask findSpeckles(const cuboid_mapping::VoxelStore& voxels,
                                                     const cuboid_mapping::VoxelBrick& brick);

/// Makes speckles unknown. @param voxels  Of the map that the bricks are copied from.
void removeSpeckles(const cuboid_mapping::VoxelStore& voxels,
                    std::vector<cuboid_mapping::VoxelBrick>& bricks);

/// Which cells the markers and points of octomap_server show.
enum class ShownCells : unsigned char { kOccupied, kFree };

/// Leaves of an octree, and how much of a map is not in them.
struct ShownLeaves {
  std::vector<cuboid_mapping::OctreeLeaf> leaves;
  double num_left_out = 0.0;  ///< Voxels too far from the rest for one octree.
};

/// The leaves of one class that share a height with [occupancy_min_z, occupancy_max_z]; those that reach beyond are
/// divided. The octree lies around the map, if that is not around the origin.
/// @param kind  kBinary: leaves are of one class; kFull: of one log-odds, as octomap_server's.
[[nodiscard]] ShownLeaves computeShownLeaves(const cuboid_mapping::MapSnapshot& map,
                                             ShownCells cells,
                                             const OctomapServerParameters& parameters,
                                             cuboid_mapping::OctreeKind kind);

/// occupied_cells_vis_array and free_cells_vis_array: 17 markers, one for each depth from 0 to 16,
/// whose id it is; a CUBE_LIST, or DELETE where there is no leaf of that size.
///
/// Far from the origin the poses of the markers carry a multiple of 1024 m, see farAnchor(). Colours: `color` or `color_free`; with height_map, occupied cells by the height of their centre
/// between the lowest and the highest face of all that is known: red at the top, from there
/// `color_factor` of the circle of hues downwards, as octomap_server's.
/// @param num_left_out  Gets that of ShownLeaves.
[[nodiscard]] visualization_msgs::MarkerArray toCellMarkers(
    const cuboid_mapping::MapSnapshot& map, ShownCells cells,
    const OctomapServerParameters& parameters, const std_msgs::Header& header,
    double& num_left_out);

/// octomap_point_cloud_centers: the centres of leaves, see toCloud().
[[nodiscard]] sensor_msgs::PointCloud2 toCenters(
    const std::vector<cuboid_mapping::OctreeLeaf>& leaves, double resolution_m,
    const std_msgs::Header& header);

}  // namespace cuboid_mapping_ros
