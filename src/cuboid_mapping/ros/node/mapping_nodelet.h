// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nodelet/nodelet.h>

#include <memory>

namespace cuboid_mapping_ros {

class MappingNode;

/// MappingNode as a nodelet.
class MappingNodelet : public nodelet::Nodelet {
 public:
  MappingNodelet();
  ~MappingNodelet() override;

 private:
  /// An argument is the map_file. @throws std::exception  if the node cannot start, with the reason in the log:
  /// the manager then does not load the nodelet, and its loader ends.
  void onInit() override;
  void start();

  std::unique_ptr<MappingNode> node_;
};

}  // namespace cuboid_mapping_ros
