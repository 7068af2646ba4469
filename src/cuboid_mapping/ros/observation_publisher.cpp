// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/observation_publisher.h"

#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/ros/checked_messages.h"
#include "cuboid_mapping/ros/names.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <boost/make_shared.hpp>

#include <algorithm>
#include <string>

namespace cuboid_mapping_ros {
namespace {

/// Observations that may wait for a slow listener: some seconds of them.
constexpr std::uint32_t kQueueSize = 50;
/// Of an answer: the clouds of the node wait meanwhile.
constexpr std::size_t kMaxAnswer_bytes = 8000000;

std::size_t bytesOf(const cuboid_mapping::Observation& message) {
  return sizeof(message) + message.data.size();
}

}  // namespace

ObservationPublisher::ObservationPublisher(ros::NodeHandle nh, ros::NodeHandle private_nh,
                                           const NodeParameters& parameters)
    : max_kept_bytes_(std::size_t{1000000} *
                      static_cast<std::size_t>(parameters.fleet.observation_memory_mb)),
      publisher_(nh.advertise<cuboid_mapping::Observation>(kObservationsTopic, kQueueSize)) {
  next_.header.frame_id = withoutSlash(parameters.frame_id);
  next_.robot = private_nh.getNamespace();
  next_.session = ros::WallTime::now().toNSec();
  next_.resolution = parameters.map.resolution_m;
  using cuboid_mapping::GetObservations;
  server_ = advertiseGuarded<GetObservations::Request, GetObservations::Response>(
      private_nh, kGetObservationsService,
      [this](GetObservations::Request& request, GetObservations::Response& response) {
        answer(request, response);
        return true;
      });
}

void ObservationPublisher::publish(const ros::Time& stamp, const Eigen::Vector3d& origin_map,
                                   const cuboid_mapping::SensorModelConfig& model,
                                   const cuboid_mapping::ScanUpdate& update) {
  ++next_.sequence;
  const bool is_heard = publisher_.getNumSubscribers() > 0;
  if (!is_heard && max_kept_bytes_ == 0) return;
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
  keep(message);
  if (is_heard) publisher_.publish(message);
}

void ObservationPublisher::keep(const cuboid_mapping::Observation::ConstPtr& message) {
  if (max_kept_bytes_ == 0) return;
  kept_.push_back(message);
  num_kept_bytes_ += bytesOf(*message);
  while (num_kept_bytes_ > max_kept_bytes_) {
    num_kept_bytes_ -= bytesOf(*kept_.front());
    kept_.pop_front();
  }
}

void ObservationPublisher::answer(const cuboid_mapping::GetObservations::Request& request,
                                  cuboid_mapping::GetObservations::Response& response) const {
  response.session = next_.session;
  if (request.session != next_.session) return;
  response.complete_to = next_.sequence;
  if (kept_.empty()) return;
  const std::uint64_t oldest = kept_.front()->sequence;
  std::size_t num_bytes = 0;
  for (std::uint64_t i = std::max(request.first, oldest) - oldest; i < kept_.size(); ++i) {
    num_bytes += bytesOf(*kept_[i]);
    if (num_bytes > kMaxAnswer_bytes && !response.observations.empty()) {
      response.complete_to = oldest + i - 1;
      return;
    }
    response.observations.push_back(*kept_[i]);
  }
}

}  // namespace cuboid_mapping_ros
