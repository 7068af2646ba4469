// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/corrections/pose_corrections.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

}  // namespace

std::vector<ParameterDeclaration> PoseCorrections::declare() {
  return {
      {"keep_clouds/memory", "MB", integer({&P::keep, &KeepParameters::memory_mb}, 0, 1000000),
       "Memory for kept clouds, from which ~correct_poses and corrected_path rebuild the map. A "
       "point takes 1 to 2 bytes, and is rounded to a sixteenth of a voxel. When the memory is "
       "full, the oldest clouds become a fixed part of the map. A rebuild needs memory for a "
       "second whole map, also with a window. 0: no cloud is kept."},
      {"keep_clouds/max_age", "s", number({&P::keep, &KeepParameters::max_age_s}, 0.1, 1e9),
       "Largest age of a kept cloud, relative to the newest one. Older clouds become a fixed part "
       "of the map."},
      {"keep_clouds/body_frame", "", frame({&P::keep, &KeepParameters::body_frame}, true),
       "Frame whose poses corrected_path and ~correct_poses give, such as base_link. Empty: the "
       "frame of each cloud."},
      {"keep_clouds/tolerance", "m", number({&P::keep, &KeepParameters::tolerance_m}, 0.0, 1000.0),
       "A path on corrected_path moves a cloud only if a point 10 m from the body moves by more "
       "than this. A path that moves no cloud is ignored."},
  };
}

std::vector<ParameterError> PoseCorrections::check(const LoadedParameters& loaded) {
  const NodeParameters& parameters = loaded.parameters;
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
