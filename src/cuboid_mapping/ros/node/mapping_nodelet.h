// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/node/mapping_node.h"

#include <nodelet/nodelet.h>

#include <memory>

namespace cuboid_mapping_ros {

/// MappingNode as a nodelet.
class MappingNodelet : public nodelet::Nodelet {
 public:
  /// False before onInit, and for good after one that found bad parameters: the nodelet then does
  /// nothing, and its manager goes on with the others.
  [[nodiscard]] bool isRunning() const { return node_ != nullptr; }

 private:
  /// Logs every bad parameter, or the parameters in use. An argument is the map_file. Throws nothing.
  void onInit() override;

  std::unique_ptr<MappingNode> node_;
};

}  // namespace cuboid_mapping_ros
