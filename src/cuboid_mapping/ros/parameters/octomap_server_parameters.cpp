// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <set>

namespace cuboid_mapping_ros {
namespace {

using O = OctomapServerParameters;
using P = NodeParameters;
using S = SourceParameters;

std::vector<ParameterDeclaration> declareGround() {
  return {
      {"base_frame_id", "", frame({&P::octomap_server, &O::base_frame_id}, false),
       "Frame of the robot with z = 0 on the ground. Only used with filter_ground."},
      {"filter_ground", "", boolean(&S::filter_ground),
       "true: points on the ground are no obstacles, but their beams clear space."},
      {"ground_filter/distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::distance_m}, 0.001, 1.0),
       "Points closer to the ground plane than this belong to the ground."},
      {"ground_filter/angle", "rad",
       number({&S::ground_filter, &GroundFilterConfig::angle_rad}, 0.001, 15.0),
       "Largest angle between the ground plane and the xy plane of base_frame_id."},
      {"ground_filter/plane_distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::plane_distance_m}, 0.001, 1.0),
       "Largest height of the ground plane above or below z = 0 of base_frame_id."},
  };
}

std::vector<ParameterDeclaration> declareProducts() {
  return {
      {"occupancy_min_z", "m", number({&P::octomap_server, &O::occupancy_min_z_m}),
       "Cells below this height are left out of octomap_server's markers, points and "
       "projected_map."},
      {"occupancy_max_z", "m", number({&P::octomap_server, &O::occupancy_max_z_m}),
       "Cells above this height are left out of octomap_server's markers, points and "
       "projected_map."},
      {"min_x_size", "m", number({&P::octomap_server, &O::min_x_size_m}, 0.0, 1e4),
       "Minimum extent of projected_map along x, centred on the origin."},
      {"min_y_size", "m", number({&P::octomap_server, &O::min_y_size_m}, 0.0, 1e4),
       "Minimum extent of projected_map along y, centred on the origin."},
      {"projected_map_memory", "MB", integer({&P::octomap_server, &O::max_projection_mb}, 1, 1000),
       "Maximum size of projected_map, one byte per cell. A larger grid leaves out the cells "
       "farthest from the rest, such as a stray return; the log says where they are."},
      {"filter_speckles", "", boolean({&P::octomap_server, &O::filter_speckles}),
       "true: occupied voxels without an occupied neighbour (of 26) are left out of "
       "octomap_server's markers, points and projected_map."},
      {"publish_free_space", "", boolean({&P::octomap_server, &O::publish_free_space}),
       "true: free_cells_vis_array is published. free_cuboids is always published."},
  };
}

/// The channels of a colour.
std::vector<ParameterDeclaration> declareColor(const std::string& key,
                                               std::array<double, 4> O::*color,
                                               const std::string& what) {
  const std::array<const char*, 4> names{"Red of ", "Green of ", "Blue of ", "Opacity of "};
  std::vector<ParameterDeclaration> table;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Field<double> field([=](P& p) -> double& { return (p.octomap_server.*color)[i]; }, false);
    table.push_back({key + '/' + "rgba"[i], "", number(field, 0.0, 1.0), names[i] + what});
  }
  return table;
}

std::vector<ParameterDeclaration> declareColors() {
  return {
      {"height_map", "", boolean({&P::octomap_server, &O::is_height_map}),
       "true: occupied_cells_vis_array is coloured by height."},
      {"color_factor", "", number({&P::octomap_server, &O::color_factor}, 0.0, 1.0),
       "Part of the colour circle over the height of the map, with height_map."},
  };
}

}  // namespace

bool isOfOctomapServer(const std::string& key) {
  static const std::set<std::string> kTheirs = [] {
    std::vector<std::string> keys = wordsOf(
        "frame_id resolution latch map_file sensor_model/hit sensor_model/miss sensor_model/min "
        "sensor_model/max sensor_model/min_range sensor_model/max_range");
    for (const ParameterDeclaration& declaration : declareOctomapServer()) {
      keys.push_back(declaration.key);
    }
    return std::set<std::string>(keys.begin(), keys.end());
  }();
  return kTheirs.count(key) > 0 || key.rfind("pointcloud_", 0) == 0;
}

const std::map<std::string, std::string>& octomapServerOnly() {
  static const std::string kChanges = "changes are published on cuboid_map_updates";
  static const std::map<std::string, std::string> kNames = {
      {"track_changes", kChanges},
      {"listen_changes", kChanges},
      {"topic_changes", kChanges},
      {"change_id_frame", kChanges},
      {"min_change_pub", kChanges},
      {"incremental_2D_projection", "projected_map is always updated incrementally"},
      {"max_depth", "cells of all sizes are shown"},
      {"compress_map", "octrees are always pruned"},
      {"colored_map", "cells have no colours in this map"},
  };
  return kNames;
}

std::vector<ParameterDeclaration> declareOctomapServer() {
  std::vector<ParameterDeclaration> table = declareGround();
  for (const auto& part :
       {declareProducts(), declareColors(),
        declareColor("color", &O::color, "occupied_cells_vis_array, without height_map."),
        declareColor("color_free", &O::color_free, "free_cells_vis_array.")}) {
    table.insert(table.end(), part.begin(), part.end());
  }
  return table;
}

}  // namespace cuboid_mapping_ros
