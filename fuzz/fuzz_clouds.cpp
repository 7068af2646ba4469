// SPDX-License-Identifier: BSD-3-Clause
// Clouds with arbitrary fields, sizes, strides and byte order, from the message to the map.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"

#include "fuzz_cloud_message.h"
#include "fuzz_target.h"

#include <boost/make_shared.hpp>

#include <cmath>

namespace {

using namespace cuboid_mapping_ros;
using cuboid_mapping::FuzzInput;
using cuboid_mapping::require;
using cuboid_mapping::takeCloud;

NodeParameters takeParameters(FuzzInput& input) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.5;
  parameters.threads = 1;
  parameters.source.max_range_m = input.chance() ? 20.0 : 100.0;
  parameters.source.no_return_range_m = input.chance() ? 15.0 : 0.0;
  parameters.source.no_return_points = static_cast<NoReturnPoints>(input.upTo(15));
  return parameters;
}

/// Checks the guarantees of convertCloud().
void checkConversion(const sensor_msgs::PointCloud2& cloud, const NodeParameters& parameters) {
  CloudOptions options;
  options.no_return_range_m = parameters.source.no_return_range_m;
  options.no_return_points = parameters.source.no_return_points;
  const auto result = convertCloud(cloud, options);
  if (const auto* error = std::get_if<CloudError>(&result)) return require(!error->text.empty());
  const auto& points = std::get<CloudPoints>(result);
  require(!points.points.empty() || !points.no_returns.empty());
  require(points.points.size() + points.num_invalid == std::size_t{cloud.width} * cloud.height);
  require(points.no_returns.size() + points.num_skipped == points.num_invalid);
  for (const Eigen::Vector3f& point : points.points) require(point.allFinite());
  for (const Eigen::Vector3f& point : points.no_returns) require(point.allFinite());
}

}  // namespace

FUZZ_TARGET(fuzz_clouds) {
  FuzzInput input(data, size);
  const NodeParameters parameters = takeParameters(input);
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Isometry3d::Identity();
  poses.T_map_cloud.translation() =
      Eigen::Vector3d(0.1 * static_cast<double>(input.upTo(200)), 0, 1);
  poses.T_map_sensor = poses.T_map_cloud;
  const sensor_msgs::PointCloud2 cloud = takeCloud(input);
  checkConversion(cloud, parameters);
  SensorInput sensor(parameters, parameters.source);
  const Observed observed =
      sensor.compute({boost::make_shared<sensor_msgs::PointCloud2>(cloud)}, poses);
  const auto* update = observed.update;
  require((update == nullptr) == observed.error.has_value());
  if (update == nullptr) return 0;
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  map.apply(*update);
  const bool is_empty = map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels() == 0.0;
  require(is_empty == (map.voxels().size() == 0));
  return 0;
}
