// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/node_sources.h"

#include <ros/time.h>

namespace cuboid_mapping_ros {

NodeSources::NodeSources(const NodeParameters& parameters)
    : has_list_(!parameters.sources.empty()),
      sources_(makeSources(parameters)),
      figures_(sources_.size()) {}

void NodeSources::listen(const ros::NodeHandle& nh, const SourceSubscriber::Take& take) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    subscribers_.push_back(std::make_unique<SourceSubscriber>(nh, at(i).parameters, i, take));
    topics_ += (i == 0 ? "" : ", ") + subscribers_.back()->topic();
  }
}

bool NodeSources::receive(const SensorMessage& message) {
  Figures& figures = figures_.at(message.source);
  figures.last_received = Clock::now();
  const bool is_wanted = at(message.source).rate_limit.lets(message.header().stamp);
  ++(is_wanted ? figures.now.num_received : figures.now.num_ignored);
  return is_wanted;
}

void NodeSources::noteLost(std::size_t source, std::size_t count) {
  figures_.at(source).now.num_received += count;
}

void NodeSources::noteDropped(std::size_t source, const std::string& why) {
  SourceStatistics& now = figures_.at(source).now;
  ++now.num_dropped;
  now.last_drop = why;
}

std::size_t NodeSources::numPublishers() const {
  std::size_t count = 0;
  for (const auto& subscriber : subscribers_) count += subscriber->numPublishers();
  return count;
}

void NodeSources::addDiagnostics(diagnostic_updater::Updater& diagnostics) {
  if (!has_list_) return;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    diagnostics.add(
        "source " + nameOf(at(i).parameters),
        [this, i](diagnostic_updater::DiagnosticStatusWrapper& status) { report(i, status); });
  }
}

void NodeSources::report(std::size_t source, diagnostic_updater::DiagnosticStatusWrapper& status) {
  if (source >= subscribers_.size()) return;  // The node is just starting, or stopping.
  Figures& figures = figures_[source];
  const SourceSubscriber& subscriber = *subscribers_[source];
  SourceReport report;
  figures.now.num_without_camera = subscriber.numWithoutCamera();
  report.statistics = figures.now;
  report.topic = subscriber.topic();
  report.type = toString(at(source).parameters.source.type);
  report.num_publishers = subscriber.numPublishers();
  report.silence_s = std::chrono::duration<double>(Clock::now() - figures.last_received).count();
  report.is_simulated_time = ros::Time::isSimTime();
  fillStatus(report, figures.reported, status);
  figures.reported = figures.now;
}

}  // namespace cuboid_mapping_ros
