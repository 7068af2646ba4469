// SPDX-License-Identifier: BSD-3-Clause
// Clouds whose fields, sizes, strides and byte order say anything, from the message to the map.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/cloud_pipeline.h"

#include "fuzz_input.h"

#include <boost/make_shared.hpp>

#include <cmath>
#include <cstdlib>

namespace {

using namespace cuboid_mapping_ros;
using cuboid_mapping::FuzzInput;

/// Small numbers that fit together mostly, and any other.
std::uint32_t takeSize(FuzzInput& input, std::uint32_t usual) {
  switch (input.upTo(7)) {
    case 0: return input.take<std::uint32_t>();
    case 1: return static_cast<std::uint32_t>(input.upTo(32));
    default: return usual;
  }
}

sensor_msgs::PointField takeField(FuzzInput& input, std::uint32_t index) {
  const char* names[] = {"x", "y", "z", "rgb", ""};
  sensor_msgs::PointField field;
  field.name = names[input.chance() ? index : input.upTo(4)];
  field.offset = takeSize(input, 4 * index);
  field.count = takeSize(input, 1);
  field.datatype = input.upTo(15) == 0 ? input.take<std::uint8_t>()
                                       : std::uint8_t{sensor_msgs::PointField::FLOAT32};
  return field;
}

sensor_msgs::PointCloud2 takeCloud(FuzzInput& input) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = "lidar";
  const auto num_fields = static_cast<std::uint32_t>(input.upTo(4));
  for (std::uint32_t i = 0; i < num_fields; ++i) cloud.fields.push_back(takeField(input, i));
  cloud.is_bigendian = static_cast<std::uint8_t>(input.chance());
  cloud.height = takeSize(input, 1 + static_cast<std::uint32_t>(input.upTo(7)));
  cloud.point_step = takeSize(input, 12);
  cloud.width = takeSize(input, 1 + static_cast<std::uint32_t>(input.upTo(31)));
  cloud.row_step = takeSize(input, cloud.width * cloud.point_step);
  const std::string data = input.rest();
  cloud.data.assign(data.begin(), data.end());
  // So that most clouds have all their points, whatever the length of the input.
  const std::size_t wanted = std::size_t{cloud.row_step} * cloud.height;
  if (wanted > data.size() && wanted < 4096 && !data.empty()) {
    for (std::size_t i = data.size(); i < wanted; ++i) {
      cloud.data.push_back(static_cast<std::uint8_t>(data[i % data.size()]));
    }
  }
  return cloud;
}

NodeParameters takeParameters(FuzzInput& input) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.5;
  parameters.threads = 1;
  parameters.max_range_m = input.chance() ? 20.0 : 100.0;
  parameters.no_return_range_m = input.chance() ? 15.0 : 0.0;
  parameters.no_return_points = static_cast<NoReturnPoints>(input.upTo(15));
  return parameters;
}

void require(bool holds) {
  if (!holds) std::abort();
}

/// What convertCloud() promises.
void checkConversion(const sensor_msgs::PointCloud2& cloud, const NodeParameters& parameters) {
  CloudOptions options;
  options.no_return_range_m = parameters.no_return_range_m;
  options.no_return_points = parameters.no_return_points;
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

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput input(data, size);
  const NodeParameters parameters = takeParameters(input);
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Isometry3d::Identity();
  poses.T_map_cloud.translation() =
      Eigen::Vector3d(0.1 * static_cast<double>(input.upTo(200)), 0, 1);
  poses.T_map_sensor = poses.T_map_cloud;
  const sensor_msgs::PointCloud2 cloud = takeCloud(input);
  checkConversion(cloud, parameters);
  CloudPipeline pipeline(parameters);
  NodeStatistics statistics;
  std::optional<CloudError> error;
  const auto* update = pipeline.compute({boost::make_shared<sensor_msgs::PointCloud2>(cloud)},
                                        poses, statistics, error);
  require((update == nullptr) == error.has_value());
  if (update == nullptr) return 0;
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  map.apply(*update);
  const bool is_empty = map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels() == 0.0;
  require(is_empty == (map.voxels().size() == 0));
  return 0;
}
