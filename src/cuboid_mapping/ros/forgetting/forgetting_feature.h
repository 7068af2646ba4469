// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/forgetting.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Forgets voxels that no cloud has seen for too long: forget_after.
class ForgettingFeature : public MapFeature {
 public:
  explicit ForgettingFeature(const MapHost& host) : host_(host), forgetting_(host.parameters) {}
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return Forgetting(parameters).isOn();
  }
  [[nodiscard]] std::string name() const override { return "forgetting"; }

  void onCloud(const MappedCloud& cloud) override {
    if (is_replaced_.exchange(false)) forgetting_ = Forgetting(host_.parameters);
    forgetting_.note(cloud.seen, cloud.stamp, cloud.source);
    while (forgetting_.hasDue()) {
      host_.map.edit([this](CuboidMap& map) { return forgetting_.forgetSome(map); });
    }
  }
  void onReplaced() override { is_replaced_ = true; }
  [[nodiscard]] std::function<void()> prepareMove(const VoxelMotion& motion) override {
    return [this, moved = std::make_shared<Forgetting>(forgetting_.moved(motion))] {
      forgetting_ = std::move(*moved);
    };
  }

 private:
  const MapHost& host_;
  Forgetting forgetting_;
  std::atomic<bool> is_replaced_{false};  ///< What was seen before says nothing about this map.
};

}  // namespace cuboid_mapping_ros
