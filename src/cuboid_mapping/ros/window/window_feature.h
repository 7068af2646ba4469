// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Keeps only a window of the map in memory: parameters window/*.
class WindowFeature : public MapFeature {
 public:
  /// Opens or creates the store of the window, and locks the boxes that were locked when it was saved.
  explicit WindowFeature(const MapHost& host);
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& loaded);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return parameters.window.isOn();
  }
  [[nodiscard]] std::string name() const override { return "window"; }
  void report(NodeReport& report) override;

 private:
  const GuardedMap& map_;
  std::uint64_t num_reported_failures_ = 0;
};

}  // namespace cuboid_mapping_ros
