// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <set>

namespace cuboid_mapping_ros {

bool isOfOctomapServer(const std::string& key) {
  static const std::vector<std::string> kNames = wordsOf(
      "frame_id base_frame_id resolution map_file filter_ground ground_filter/distance "
      "ground_filter/angle ground_filter/plane_distance sensor_model/hit sensor_model/miss "
      "sensor_model/min sensor_model/max sensor_model/min_range sensor_model/max_range "
      "occupancy_min_z occupancy_max_z min_x_size min_y_size filter_speckles");
  static const std::set<std::string> kTheirs(kNames.begin(), kNames.end());
  return kTheirs.count(key) > 0 || key.rfind("pointcloud_", 0) == 0;
}

const std::map<std::string, std::string>& octomapServerOnly() {
  static const std::string kChanges = "changes are published on cuboid_map_updates";
  static const std::string kColors =
      "occupied_cells_vis_array is coloured by height, and free_cells_vis_array is green";
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
      {"height_map", kColors},
      {"color_factor", kColors},
      {"color", kColors},
      {"color_free", kColors},
      {"publish_free_space", "free_cells_vis_array is published for whoever subscribes to it"},
      {"latch", "a new subscriber always gets the current map at once"},
  };
  return kNames;
}

}  // namespace cuboid_mapping_ros
