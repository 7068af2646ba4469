// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/node_features.h"

#include <cstddef>
#include <utility>

namespace cuboid_mapping_ros {

NodeFeatures::~NodeFeatures() {
  while (!features_.empty()) features_.pop_back();  // The last one first.
}

void NodeFeatures::make(const MapHost& host) {
  features_ = makeFeatures(host);
  is_behind_.resize(features_.size());
}

void NodeFeatures::start() {
  for (const auto& feature : features_) feature->start();
}

void NodeFeatures::stop() noexcept {
  for (const auto& feature : features_) feature->stop();
}

const ScanUpdate& NodeFeatures::filter(const ScanUpdate& update, const CloudInWork& cloud) {
  const ScanUpdate* left = &update;
  for (const auto& feature : features_) left = &feature->filter(*left, cloud);
  return *left;
}

void NodeFeatures::noteMapped(const MappedCloud& cloud) {
  for (const auto& feature : features_) {
    guard_.run(feature->name(), [&] { feature->onCloud(cloud); });
  }
}

void NodeFeatures::noteReplaced() {
  for (const auto& feature : features_) {
    guard_.run(feature->name(), [&] { feature->onReplaced(); });
  }
}

std::function<void()> NodeFeatures::prepareMove(const VoxelMotion& motion) {
  std::vector<std::function<void()>> steps;
  for (const auto& feature : features_) {
    if (auto step = feature->prepareMove(motion)) steps.push_back(std::move(step));
  }
  return [steps = std::move(steps)] {
    for (const auto& step : steps) step();
  };
}

void NodeFeatures::publish(GuardedMap& map) {
  map.takeChanges([&](const CuboidMap& content, const ros::Time& stamp, const ChangeSet& changed) {
    const ChangeSet everything{changed.revision, true, {}};
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const MapChanges changes{is_behind_[i] ? everything : changed, content, stamp};
      is_behind_[i] = !guard_.run(features_[i]->name(), [&] { features_[i]->onChanges(changes); });
    }
  });
  for (std::size_t i = 0; i < features_.size(); ++i) {
    if (!guard_.run(features_[i]->name(), [&] { features_[i]->publish(); })) is_behind_[i] = true;
  }
}

void NodeFeatures::setParameters(const NodeParameters& parameters) {
  for (const auto& feature : features_) feature->setParameters(parameters);
}

void NodeFeatures::report(NodeReport& report) {
  for (const auto& feature : features_) feature->report(report);
}

void NodeFeatures::addStatus(diagnostic_updater::Updater& diagnostics) {
  for (const auto& feature : features_) feature->addStatus(diagnostics);
}

}  // namespace cuboid_mapping_ros
