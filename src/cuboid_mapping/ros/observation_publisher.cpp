// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/observation_publisher.h"

#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/ros/names.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <boost/make_shared.hpp>

#include <string>

namespace cuboid_mapping_ros {
namespace {

/// Observations that may wait for a slow listener: some seconds of them.
constexpr std::uint32_t kQueueSize = 50;

}  // namespace

ObservationPublisher::ObservationPublisher(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                                           const NodeParameters& parameters)
    : publisher_(nh.advertise<cuboid_mapping::Observation>(kObservationsTopic, kQueueSize)) {
  next_.header.frame_id = withoutSlash(parameters.frame_id);
  next_.robot = private_nh.getNamespace();
  next_.session = ros::WallTime::now().toNSec();
  next_.resolution = parameters.map.resolution_m;
}

void ObservationPublisher::publish(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
                                   const cuboid_mapping::SensorModelConfig& model,
                                   const cuboid_mapping::ScanUpdate& update) {
  ++next_.sequence;
  if (publisher_.getNumSubscribers() == 0) return;
  const auto message = boost::make_shared<cuboid_mapping::Observation>(next_);
  message->header.stamp = stamp;
  message->origin.x = origin_map.x();
  message->origin.y = origin_map.y();
  message->origin.z = origin_map.z();
  message->hit = model.hit;
  message->miss = model.miss;
  message->min = model.alpha_min;
  message->max = model.alpha_max;
  const std::string bytes = toBytes(update);
  message->data.assign(bytes.begin(), bytes.end());
  publisher_.publish(message);
}

}  // namespace cuboid_mapping_ros
