// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/cloud_receiver.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// tf keeps this more than tf_wait: a cloud that has waited so long still has its transforms.
constexpr double kTfMargin_s = 10.0;

LastCloud describeLastCloud(const CloudLedger::Figures& figures) {
  LastCloud cloud;
  cloud.frame_id = figures.last_header.frame_id;
  cloud.has_stamp = !figures.last_header.stamp.isZero();
  // ros::Duration would throw beyond 2^31 s.
  cloud.age_s = figures.last_arrival.toSec() - figures.last_header.stamp.toSec();
  return cloud;
}

}  // namespace

CloudReceiver::Needs::Needs(const NodeParameters& parameters) {
  for (const SourceParameters& source : sourcesOf(parameters)) {
    frames.emplace_back(parameters, source);
    steps.push_back(makeSteps(parameters, source));
  }
}

CloudReceiver::CloudReceiver(const ros::NodeHandle& nh, const NodeParameters& parameters,
                             CallbackGuard& guard, CloudLedger& ledger)
    : thread_(guard, "receiving"),
      nh_(withQueue(nh, thread_.queue())),
      has_clouds_(parameters.robots.empty()),
      ledger_(ledger),
      sources_(parameters, ledger),
      needs_(parameters),
      tf_(ros::Duration(parameters.tf_wait_s + kTfMargin_s), parameters.tf_gap_s),
      queue_(makeCloudLimits(parameters), queueCallbacks()) {}

void CloudReceiver::start() {
  thread_.start();
  tf_receiver_.emplace(nh_, tf_);
  if (!has_clouds_) return;
  SourceSubscriber::Callbacks callbacks;
  callbacks.arrived = [this](std::size_t source, const std_msgs::Header& header) {
    return ledger_.noteReceived(source, header);
  };
  callbacks.take = [this](const SensorMessage& cloud) { queue_.put(cloud); };
  callbacks.drop = [this](std::size_t source, const std::string& why) {
    ledger_.noteDropped(source, DropReason::kNoCameraInfo, why);
  };
  sources_.listen(nh_, callbacks);
}

void CloudReceiver::stop() {
  sources_.stopListening();
  queue_.stop();
  thread_.stop();
}

void CloudReceiver::setParameters(const NodeParameters& parameters) {
  Needs needs(parameters);
  {
    const std::lock_guard<std::mutex> lock(needs_mutex_);
    needs_ = std::move(needs);
  }
  queue_.searchAgain();
}

CloudQueue::Callbacks CloudReceiver::queueCallbacks() {
  CloudQueue::Callbacks callbacks;
  callbacks.find_poses = [this](const SensorMessage& cloud, const Slices& slices) {
    return search(cloud.source, cloud.header(), slices);
  };
  callbacks.find_slices = [this](const SensorMessage& cloud) {
    const std::lock_guard<std::mutex> lock(needs_mutex_);
    return findSlices(needs_.steps.at(cloud.source), cloud);
  };
  callbacks.drop = [this](std::size_t source, DropReason reason, const std::string& text) {
    ledger_.noteDropped(source, reason, text);
  };
  callbacks.say_waiting = [this](std::size_t source, const std::string& why) {
    ROS_WARN_STREAM_NAMED(kNodeName, "clouds of " << sourceName(source) << " wait for tf: " << why);
  };
  return callbacks;
}

std::string CloudReceiver::sourceName(std::size_t source) const {
  const SourceParameters& of = sources_.at(source);
  return of.name.empty() ? nh_.resolveName(of.topic) : of.name;
}

PoseSearch CloudReceiver::search(std::size_t source, const std_msgs::Header& header,
                                 const Slices& slices) const {
  const std::lock_guard<std::mutex> lock(needs_mutex_);
  return findPoses(tf_, needs_.frames.at(source), header, slices);
}

void CloudReceiver::report(const CloudLedger::Figures& figures, NodeReport& report) {
  report.cloud_topic = sources_.topics();
  report.num_publishers = sources_.numPublishers();
  if (figures.statistics.num_received > 0) report.last_cloud = describeLastCloud(figures);
  if (has_clouds_) {
    report.wrong_types = sources_.findWrongTypes();
    report.other_topics = sources_.otherTopics();
    report.is_published = sources_.isPublished();
  }
  report.silence_s = std::numeric_limits<double>::infinity();
  for (const CloudLedger::Source& source : figures.sources) {
    report.silence_s = std::min(report.silence_s, silenceOf(source, report.num_publishers));
  }
  report.why_waiting = queue_.whyWaiting();
  report.last_drops = figures.last_drops;
  for (std::size_t i = 0; i < figures.sources.size(); ++i) {
    const std::string name = figures.sources.size() == 1 ? "" : nameOf(sources_.at(i));
    if (figures.sources[i].rate_hz) report.rates.push_back({name, *figures.sources[i].rate_hz});
  }
}

}  // namespace cuboid_mapping_ros
