// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <array>
#include <string>

namespace cuboid_mapping_ros {
namespace {

using O = OctomapServerParameters;
using P = NodeParameters;

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
      {"filter_speckles", "", boolean({&P::octomap_server, &O::filter_speckles}),
       "true: occupied voxels without an occupied neighbour (of 26) are left out of "
       "octomap_server's markers, points and projected_map."},
      {"publish_free_space", "", boolean({&P::octomap_server, &O::publish_free_space}),
       "true: free_cells_vis_array is published. free_cuboids is always published."},
  };
}

constexpr std::array<const char*, 4> kChannels{"r", "g", "b", "a"};

/// Sets channels of a colour; those that are not given stay.
std::string setColor(std::array<double, 4>& color, const XmlRpc::XmlRpcValue& group) {
  if (group.getType() != XmlRpc::XmlRpcValue::TypeStruct) return "write color/r or {r: 1.0}";
  std::array<double, 4> changed = color;
  for (const auto& [name, value] : group) {
    const auto channel = std::find(kChannels.begin(), kChannels.end(), name);
    const auto number = numberOf(value);
    if (channel == kChannels.end()) return "it has no " + name;
    if (!number || !(*number >= 0.0 && *number <= 1.0)) return name + " is not from 0 to 1";
    changed[static_cast<std::size_t>(channel - kChannels.begin())] = *number;
  }
  color = changed;
  return {};
}

ParameterKind colorKind(std::array<double, 4> O::*color) {
  ParameterKind kind{"a group {r: 0.0, g: 0.0, b: 1.0, a: 1.0}, each from 0 to 1"};
  kind.set = [color](P& p, const XmlRpc::XmlRpcValue& group) {
    return setColor(p.octomap_server.*color, group);
  };
  kind.get = [color](const P& p) {
    XmlRpc::XmlRpcValue group;
    for (std::size_t i = 0; i < kChannels.size(); ++i) {
      group[kChannels[i]] = (p.octomap_server.*color)[i];
    }
    return group;
  };
  return kind;
}

std::vector<ParameterDeclaration> declareColors() {
  return {
      {"height_map", "", boolean({&P::octomap_server, &O::is_height_map}),
       "true: occupied_cells_vis_array is coloured by height."},
      {"color_factor", "", number({&P::octomap_server, &O::color_factor}, 0.0, 1.0),
       "Part of the colour circle over the height of the map, with height_map."},
      {"color", "", colorKind(&O::color), "Of occupied_cells_vis_array, without height_map."},
      {"color_free", "", colorKind(&O::color_free), "Of free_cells_vis_array."},
  };
}

}  // namespace

std::vector<ParameterDeclaration> OctomapServerFeature::declare() {
  std::vector<ParameterDeclaration> table = declareProducts();
  const auto colors = declareColors();
  table.insert(table.end(), colors.begin(), colors.end());
  return table;
}

std::vector<ParameterError> OctomapServerFeature::check(const LoadedParameters& loaded) {
  const O& octomap_server = loaded.parameters.octomap_server;
  std::vector<ParameterError> errors;
  checkOrder(loaded, "occupancy_min_z", octomap_server.occupancy_min_z_m, "occupancy_max_z",
             octomap_server.occupancy_max_z_m, errors);
  return errors;
}

}  // namespace cuboid_mapping_ros
