// SPDX-License-Identifier: BSD-3-Clause
// Edits of the map by services.
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/queries/answers.h"

#include <cuboid_mapping/GetLocks.h>
#include <cuboid_mapping/SetBox.h>

#include <ros/service_server.h>
#include <std_srvs/Trigger.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// If one of the boxes is refused, none is set. If memory runs out, the boxes set before stay.
void answer(ServiceCall& call, const SetBox::Request& request, SetBox::Response& response);
void answer(ServiceCall& call, const GetLocks::Request& request, GetLocks::Response& response);

/// Answer of ~undo_edit, see GuardedMap::undoEdit().
[[nodiscard]] std_srvs::Trigger::Response undoEdit(GuardedMap& map);

/// Limit of the bricks of 8 x 8 x 8 voxels that one ~set_box may make free or occupied: each takes memory.
constexpr double kMaxSetBricks = 2e6;

/// ~set_box, ~get_locks and ~undo_edit.
class MapEdits : public MapFeature {
 public:
  explicit MapEdits(const MapHost& host);
  [[nodiscard]] std::string name() const override { return "edits"; }

 private:
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace cuboid_mapping_ros
