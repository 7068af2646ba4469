// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/fleet/robot_merger.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Builds the map from observations of other robots' nodes, instead of clouds: parameters merge/*.
class RobotsFeature : public MapFeature {
 public:
  explicit RobotsFeature(const MapHost& host);
  /// Ends questions first, and then the threads that wait for robots.
  ~RobotsFeature() override;
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return !parameters.robots.empty();
  }
  [[nodiscard]] std::string name() const override { return "merging"; }

  void start() override;
  void report(NodeReport& report) override { merger_->report(report); }
  void addStatus(diagnostic_updater::Updater& diagnostics) override;
  void stop() noexcept override;

 private:
  GuardedThread merging_thread_;
  GuardedThread asking_threads_;  ///< See RobotMerger.
  std::optional<RobotMerger> merger_;
};

}  // namespace cuboid_mapping_ros
