// SPDX-License-Identifier: BSD-3-Clause
#include "parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

std::vector<ParameterDeclaration> declareGround() {
  return {
      {"base_frame_id", "",
       FrameKind{[](P& p) -> std::string& { return p.octomap_server.base_frame_id; }, false},
       "Frame of the robot whose z is 0 on the ground; for filter_ground."},
      {"filter_ground", "",
       BooleanKind{[](P& p) -> bool& { return p.octomap_server.filter_ground; }},
       "Whether points of the ground free the space before them, and are no obstacles."},
      {"ground_filter/distance", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.ground_filter.distance_m; }, 0.001,
                  1.0},
       "Points so near to the plane of the ground belong to it."},
      {"ground_filter/angle", "rad",
       NumberKind{[](P& p) -> double& { return p.octomap_server.ground_filter.angle_rad; }, 0.001,
                  15.0},
       "Greatest angle between the plane of the ground and z = 0 of base_frame_id."},
      {"ground_filter/plane_distance", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.ground_filter.plane_distance_m; },
                  0.001, 1.0},
       "Greatest distance between the plane of the ground and z = 0 of base_frame_id."},
  };
}

std::vector<ParameterDeclaration> declareProducts() {
  return {
      {"occupancy_min_z", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.occupancy_min_z_m; }},
       "Cells below are left out of octomap_server's markers, points and projected_map."},
      {"occupancy_max_z", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.occupancy_max_z_m; }},
       "Cells above are left out of octomap_server's markers, points and projected_map."},
      {"min_x_size", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.min_x_size_m; }, 0.0, 1e4},
       "projected_map is at least so wide along x, around the origin."},
      {"min_y_size", "m",
       NumberKind{[](P& p) -> double& { return p.octomap_server.min_y_size_m; }, 0.0, 1e4},
       "projected_map is at least so wide along y, around the origin."},
      {"filter_speckles", "",
       BooleanKind{[](P& p) -> bool& { return p.octomap_server.filter_speckles; }},
       "Whether occupied voxels without any occupied neighbour (of 26) are left out of "
       "octomap_server's markers, points and projected_map."},
      {"publish_free_space", "",
       BooleanKind{[](P& p) -> bool& { return p.octomap_server.publish_free_space; }},
       "Whether free_cells_vis_array is published. free_cuboids always is."},
      {"incremental_2D_projection", "",
       BooleanKind{[](P& p) -> bool& { return p.octomap_server.is_projection_incremental; }},
       "Taken from octomap_server without effect: projected_map is always brought up to date where "
       "the map has changed."},
      {"compress_map", "", BooleanKind{[](P& p) -> bool& { return p.octomap_server.compress_map; }},
       "Taken from octomap_server without effect: octrees are always pruned."},
  };
}

/// The channels of a colour; `Field` gives the array of the parameters.
template <std::array<double, 4> OctomapServerParameters::*Field>
std::vector<ParameterDeclaration> declareColor(const std::string& key, const std::string& what) {
  return {
      {key + "/r", "",
       NumberKind{[](P& p) -> double& { return (p.octomap_server.*Field)[0]; }, 0, 1},
       "Red of " + what},
      {key + "/g", "",
       NumberKind{[](P& p) -> double& { return (p.octomap_server.*Field)[1]; }, 0, 1},
       "Green of " + what},
      {key + "/b", "",
       NumberKind{[](P& p) -> double& { return (p.octomap_server.*Field)[2]; }, 0, 1},
       "Blue of " + what},
      {key + "/a", "",
       NumberKind{[](P& p) -> double& { return (p.octomap_server.*Field)[3]; }, 0, 1},
       "Opacity of " + what},
  };
}

std::vector<ParameterDeclaration> declareColors() {
  return {
      {"height_map", "", BooleanKind{[](P& p) -> bool& { return p.octomap_server.is_height_map; }},
       "Whether occupied_cells_vis_array is coloured by height."},
      {"color_factor", "",
       NumberKind{[](P& p) -> double& { return p.octomap_server.color_factor; }, 0.0, 1.0},
       "Share of all hues that the height of the map runs through, with height_map."},
      {"colored_map", "",
       BooleanKind{[](P& p) -> bool& { return p.octomap_server.is_colored_map; }},
       "Taken from octomap_server without effect: cells have no colours of their own."},
  };
}

}  // namespace

std::vector<ParameterDeclaration> declareOctomapServer() {
  std::vector<ParameterDeclaration> table = declareGround();
  using S = OctomapServerParameters;
  for (const auto& part :
       {declareProducts(), declareColors(),
        declareColor<&S::color>("color", "occupied_cells_vis_array, without height_map."),
        declareColor<&S::color_free>("color_free", "free_cells_vis_array.")}) {
    table.insert(table.end(), part.begin(), part.end());
  }
  return table;
}

}  // namespace cuboid_mapping_ros
