// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/fleet/observation_publisher.h"

#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/serialization.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <string>

namespace cuboid_mapping_ros {
namespace {

/// Maximum number of observations that wait for a slow subscriber, or for the rate: some seconds of them.
constexpr std::uint32_t kMaxWaiting = 50;
/// Limit of an answer: clouds wait while it is made.
constexpr std::size_t kMaxAnswer_bytes = 8000000;
constexpr double kSendPeriod_s = 0.05;

double sendTime_s() { return ros::SteadyTime::now().toSec(); }

std::size_t bytesOf(const Observation& message) {
  return ros::serialization::serializationLength(message);
}

}  // namespace

ObservationPublisher::ObservationPublisher(const MapHost& host)
    : is_limited_(host.parameters.of<ObservationParameters>().max_kb_s > 0.0),
      leaves_out_(host.parameters.of<ObservationParameters>().memory_mb == 0),
      budget_(1e3 * host.parameters.of<ObservationParameters>().max_kb_s),
      max_kept_bytes_(
          std::size_t{1000000} *
          static_cast<std::size_t>(host.parameters.of<ObservationParameters>().memory_mb)),
      publisher_(ros::NodeHandle(host.nh).advertise<Observation>(kObservationsTopic, kMaxWaiting)) {
  last_.header.frame_id = withoutSlash(host.parameters.frame_id);
  last_.robot = host.private_nh.getNamespace();
  last_.session = ros::WallTime::now().toNSec();
  last_.resolution = host.parameters.map.resolution_m;
  server_ = offerService<GetObservations>(
      host.services_nh, kGetObservationsService,
      [this](const auto& request, auto& response) { answer(request, response); });
  if (is_limited_) {
    timer_ = Timer(host.services_nh, kSendPeriod_s, [this] {
      const std::lock_guard<std::mutex> lock(mutex_);
      sendDue();
    });
  }
}

std::string ObservationPublisher::name() const { return kObservationsTopic; }

void ObservationPublisher::addStatus(diagnostic_updater::Updater& diagnostics) {
  if (is_limited_) diagnostics.add("observations", this, &ObservationPublisher::fillStatus);
}

void ObservationPublisher::onCloud(const MappedCloud& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_heard = publisher_.getNumSubscribers() > 0;
  if (is_heard && leaves_out_ && !budget_.isFree(sendTime_s())) {
    ++last_.left_out;
    return;
  }
  ++last_.sequence;
  if (!is_heard && max_kept_bytes_ == 0) return;
  const Message message = makeMessage(cloud);
  keep(message);
  if (!is_heard) return;
  waiting_.push_back(message);
  sendDue();
  if (waiting_.size() <= kMaxWaiting) return;
  waiting_.pop_front();
  ++num_overtaken_;
}

ObservationPublisher::Message ObservationPublisher::makeMessage(const MappedCloud& cloud) const {
  const auto message = boost::make_shared<Observation>(last_);
  message->header.stamp = cloud.stamp;
  message->origin = toPoint(cloud.origin_map);
  message->hit = cloud.sensor_model.hit;
  message->miss = cloud.sensor_model.miss;
  message->min = cloud.sensor_model.alpha_min;
  message->max = cloud.sensor_model.alpha_max;
  const std::string bytes = toBytes(cloud.mapped);
  message->data.assign(bytes.begin(), bytes.end());
  return message;
}

void ObservationPublisher::keep(const Message& message) {
  if (max_kept_bytes_ == 0) return;
  kept_.push_back(message);
  num_kept_bytes_ += bytesOf(*message);
  while (num_kept_bytes_ > max_kept_bytes_) {
    num_kept_bytes_ -= bytesOf(*kept_.front());
    kept_.pop_front();
  }
}

void ObservationPublisher::sendDue() {
  if (publisher_.getNumSubscribers() == 0) waiting_.clear();
  while (!waiting_.empty() && budget_.isFree(sendTime_s())) {
    publisher_.publish(waiting_.front());
    const std::size_t num_bytes = bytesOf(*waiting_.front());
    budget_.spend(num_bytes);
    num_sent_bytes_ += num_bytes;
    ++num_sent_;
    waiting_.pop_front();
  }
}

void ObservationPublisher::answer(const GetObservations::Request& request,
                                  GetObservations::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  response.session = last_.session;
  if (request.session != last_.session) return;
  // Waiting observations will be sent anyway.
  const std::uint64_t last = waiting_.empty() ? last_.sequence : waiting_.front()->sequence - 1;
  response.complete_to = last;
  const auto is_before = [](const Message& message, std::uint64_t sequence) {
    return message->sequence < sequence;
  };
  std::size_t num_bytes = 0;
  for (auto kept = std::lower_bound(kept_.begin(), kept_.end(), request.first, is_before);
       kept != kept_.end() && (*kept)->sequence <= last; ++kept) {
    if (num_bytes > kMaxAnswer_bytes || !budget_.isFree(sendTime_s())) {
      response.complete_to = (*kept)->sequence - 1;
      return;
    }
    num_bytes += bytesOf(**kept);
    budget_.spend(bytesOf(**kept));
    response.observations.push_back(**kept);
  }
}

void ObservationPublisher::fillStatus(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  using diagnostic_msgs::DiagnosticStatus;
  status.summary(DiagnosticStatus::OK, "observations are sent within observation_rate");
  const std::uint64_t num_losses = last_.left_out + num_overtaken_;
  if (num_losses > num_reported_losses_) {
    status.summary(DiagnosticStatus::WARN,
                   "observations are more than observation_rate: raise it, or make them fewer with "
                   "a coarser resolution, a smaller sensor_model/max_range or fewer clouds");
  }
  num_reported_losses_ = num_losses;
  status.add("observations sent", num_sent_);
  status.add("bytes sent", num_sent_bytes_);
  status.add("observations waiting", waiting_.size());
  status.add("observations that gave up waiting", num_overtaken_);
  status.add("clouds left out", last_.left_out);
}

std::vector<ParameterDeclaration> ObservationPublisher::declare() {
  return {
      {"observation_rate", "kB/s", number(&ObservationParameters::max_kb_s, 0.0, 1e6),
       "Maximum rate of observations to each listener. Answers of ~get_observations count. With "
       "observation_memory, the last 50 observations above the rate wait, and listeners can "
       "request older ones; without, they are dropped and counted. 0: no limit."},
      {"observation_memory", "MB", integer(&ObservationParameters::memory_mb, 0, 100000),
       "Memory for past observations, so that merging nodes can request lost ones. 0: none is "
       "kept."},
  };
}

}  // namespace cuboid_mapping_ros
