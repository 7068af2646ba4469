// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/forgetting.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Forgets voxels that no cloud has seen for too long: forget_after.
class ForgettingFeature : public MapFeature {
 public:
  explicit ForgettingFeature(const MapHost& host) : map_(host.map), forgetting_(host.parameters) {}
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return Forgetting(parameters).isOn();
  }
  [[nodiscard]] std::string name() const override { return "forgetting"; }

  void onCloud(const MappedCloud& cloud) override {
    forgetting_.note(cloud.seen, cloud.stamp, cloud.source);
    while (forgetting_.hasDue()) {
      map_.edit([this](CuboidMap& map) { return forgetting_.forgetSome(map); });
    }
  }
  [[nodiscard]] std::function<void()> prepareMove(const VoxelMotion& motion) override {
    return [this, moved = std::make_shared<Forgetting>(forgetting_.moved(motion))] {
      forgetting_ = std::move(*moved);
    };
  }

 private:
  GuardedMap& map_;
  Forgetting forgetting_;
};

}  // namespace cuboid_mapping_ros
