// SPDX-License-Identifier: BSD-3-Clause
// Converts a map to the messages of octomap_server. Pure functions.
#pragma once

#include "cuboid_mapping/io/octree_stream.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <octomap_msgs/Octomap.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <vector>

namespace cuboid_mapping_ros {

/// Parameters of octomap_server that concern its topics.
struct OctomapServerParameters {
  bool filter_speckles = false;  ///< Leave out occupied voxels without occupied neighbours.
  /// Cells below and above are not in its markers, points and projected_map.
  ///@{
  double occupancy_min_z_m = -1e9;
  double occupancy_max_z_m = 1e9;
  ///@}
  double min_x_size_m = 0.0;    ///< Minimum size of projected_map.
  double min_y_size_m = 0.0;    ///< Minimum size of projected_map.
  int max_projection_mb = 100;  ///< Maximum size of projected_map: a byte per cell. No parameter.
};

/// octomap_binary and octomap_full: every voxel within +-32768 voxels from the origin; pruned.
/// @param num_left_out  Gets the number of voxels outside, which no octree can hold.
[[nodiscard]] octomap_msgs::Octomap toOctomapMessage(const MapSnapshot& map, OctreeKind kind,
                                                     const std_msgs::Header& header,
                                                     double& num_left_out);

/// Occupied voxels of a brick without any occupied neighbour among 26.
/// @param voxels  Voxels of the brick's map.
[[nodiscard]] BrickMask findSpeckles(const VoxelStore& voxels, const VoxelBrick& brick);

/// Makes speckles unknown. @param voxels  Voxels of the map from which the bricks were copied.
void removeSpeckles(const VoxelStore& voxels, std::vector<VoxelBrick>& bricks);

/// Median of cells, axis by axis. @pre There are cells.
[[nodiscard]] Cell medianOf(const std::vector<Cell>& cells);

/// Cells that the markers and points of octomap_server show.
enum class ShownCells : unsigned char { kOccupied, kFree };

/// Leaves of an octree, and the part of a map that is not in them.
struct ShownLeaves {
  std::vector<OctreeLeaf> leaves;
  double num_left_out = 0.0;  ///< Voxels too far from the rest for one octree.
};

/// Leaves of one class that share a height with [occupancy_min_z, occupancy_max_z]; leaves that reach beyond
/// are divided. The octree lies around the map if it does not fit around the origin.
/// @param kind  kBinary: leaves have one class; kFull: one log-odds, as in octomap_server.
[[nodiscard]] ShownLeaves computeShownLeaves(const MapSnapshot& map, ShownCells cells,
                                             const OctomapServerParameters& parameters,
                                             OctreeKind kind);

/// Messages of occupied_cells_vis_array and free_cells_vis_array: 17 markers, one for each depth from 0 to 16,
/// which is their id; a CUBE_LIST, or DELETE if there is no leaf of that size.
///
/// Far from the origin the poses of the markers carry a multiple of 1024 m, see farAnchor(). Colours are
/// octomap_server's: green for free cells; occupied ones by the height of their centre between the lowest and the
/// highest known face, from red at the top downwards.
/// @param num_left_out  Gets the number from ShownLeaves.
[[nodiscard]] visualization_msgs::MarkerArray toCellMarkers(
    const MapSnapshot& map, ShownCells cells, const OctomapServerParameters& parameters,
    const std_msgs::Header& header, double& num_left_out);

/// Message of octomap_point_cloud_centers: the centres of leaves, see toCloud().
[[nodiscard]] sensor_msgs::PointCloud2 toCenters(const std::vector<OctreeLeaf>& leaves,
                                                 double resolution_m,
                                                 const std_msgs::Header& header);

}  // namespace cuboid_mapping_ros
