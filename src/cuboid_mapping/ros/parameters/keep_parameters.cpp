// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <cstdint>

namespace cuboid_mapping_ros {

using P = NodeParameters;

HistoryLimits KeepParameters::limits() const {
  return {static_cast<std::uint64_t>(memory_mb) * 1000000, max_age_s};
}

std::vector<ParameterDeclaration> declareKeep() {
  return {
      {"keep_clouds/memory", "MB", integer({&P::keep, &KeepParameters::memory_mb}, 0, 1000000),
       "Size of the clouds that are kept, packed to about 2 bytes a point, so that ~correct_poses "
       "and corrected_path can make the map anew. Points are rounded to a sixteenth of a voxel. "
       "Older clouds become a fixed part of the map. Needs memory for a second whole map, also "
       "with a "
       "window. 0: no cloud is kept."},
      {"keep_clouds/max_age", "s", number({&P::keep, &KeepParameters::max_age_s}, 0.1, 1e9),
       "A cloud that is older than the newest one by more becomes a fixed part of the map."},
      {"keep_clouds/body_frame", "", frame({&P::keep, &KeepParameters::body_frame}, true),
       "Frame whose corrected poses come. Empty: the frame of each cloud."},
      {"keep_clouds/tolerance", "m", number({&P::keep, &KeepParameters::tolerance_m}, 0.0, 1000.0),
       "A message on corrected_path moves no cloud of which no point 10 m from the body moves by "
       "more. "
       "If there is no other cloud, the message is ignored."},
  };
}

std::vector<ParameterError> checkKeep(const NodeParameters& parameters) {
  if (!parameters.keep.isOn()) return {};
  std::vector<ParameterError> errors;
  const auto refuse = [&](const std::string& key, const std::string& why) {
    errors.push_back(
        {"keep_clouds/memory", "does not go with " + key + ": " + why + ". Change one of them"});
  };
  if (!parameters.fleet.robots.empty()) {
    refuse("merge/robots", "this node does not get the robots' clouds");
  }
  if (parameters.source.forget_after_s > 0.0) {
    refuse("forget_after", "a rebuilt map would have the forgotten voxels again");
  }
  if (parameters.moving_points == MovingPoints::kLeaveOut) {
    refuse("moving_points: leave_out", "which points move depends on the poses");
  }
  if (parameters.window.isOn() && !parameters.window.keeps()) {
    refuse("this window/outside", "voxels outside would come back");
  }
  return errors;
}

}  // namespace cuboid_mapping_ros
