// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using O = OctomapServerParameters;
using P = NodeParameters;

}  // namespace

std::vector<ParameterDeclaration> OctomapServerFeature::declare() {
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
      {"filter_speckles", "", boolean({&P::octomap_server, &O::filter_speckles}),
       "true: occupied voxels without an occupied neighbour (of 26) are left out of "
       "octomap_server's markers, points and projected_map."},
  };
}

std::vector<ParameterError> OctomapServerFeature::check(const LoadedParameters& loaded) {
  const O& octomap_server = loaded.parameters.octomap_server;
  std::vector<ParameterError> errors;
  checkOrder(loaded, "occupancy_min_z", octomap_server.occupancy_min_z_m, "occupancy_max_z",
             octomap_server.occupancy_max_z_m, errors);
  return errors;
}

}  // namespace cuboid_mapping_ros
